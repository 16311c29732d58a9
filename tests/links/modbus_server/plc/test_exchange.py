"""The blocks around a Modbus client, stepped through: nothing is written unasked, and no data before their toggle."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from gatewayd.links.modbus_server.plc.st.exchange import cyclic, handshake, sequence
from gatewayd.links.modbus_server.plc.st.triggers import triggers
from tests.links.modbus_server.plc.simulation import instance
from tests.plc_golden import golden_model

MODEL = golden_model()
NAMES = [poll.name for poll in cyclic(MODEL)]


def requests(own: Any, call: Callable[[], None], cycles: int = 300, *, answered: bool = True) -> list[str]:
    """The requests that a client is asked for."""
    found, before = [], False
    for _ in range(cycles):
        call()
        if own.request and not before:
            found.append(NAMES[own.current - 1])
        before = own.request
        own.done = own.request and answered
    return found


@pytest.mark.parametrize("allowed", [{}, {"trusted": True}, {"write": True}])
def test_nothing_is_written_before_the_program_says_so(allowed: dict[str, bool]) -> None:
    own, call = instance(sequence(MODEL), run=True, period=100, time_out=1000, **allowed)
    asked = requests(own, call)
    assert {poll.name for poll in MODEL.polls if not poll.writes} == set(asked)
    assert own.written == 0


def test_every_round_has_all_writes_and_one_of_the_slow_tables() -> None:
    """What others may hold is only written on demand."""
    own, call = instance(sequence(MODEL), run=True, trusted=True, write=True, period=100, time_out=1000)
    asked = requests(own, call)
    assert not {poll.name for poll in MODEL.writes if poll.shared} & set(asked)
    assert asked.count("write1") == asked.count("status1") or asked.count("write1") + 1 == asked.count(
        "status1"
    )
    assert abs(asked.count("status2") - asked.count("status3")) <= 1
    assert own.written > 1
    own.demand_write2 = True
    assert "write2" in requests(own, call)


def test_a_request_without_an_answer_fails_and_the_next_is_sent() -> None:
    own, call = instance(sequence(MODEL), run=True, trusted=True, write=True, period=100, time_out=1000)
    asked = requests(own, call, answered=False)
    assert (asked[:2], own.failures, own.written) == (["status1", "read1"], len(asked) - 1, 0)


def test_the_toggle_follows_the_data_and_the_acknowledgement_ends_it() -> None:
    own, call = instance(handshake(MODEL), trusted=True, time_out=1000, send=True)
    states = []
    for written in (0, 1, 2):
        own.written = written
        call()
        states.append((own.busy, own.toggle))
    assert states == [(True, False), (True, False), (True, True)]
    own.acknowledge = True
    call()
    assert (own.busy, own.done, own.failed) == (False, True, False)


def test_a_handshake_that_nobody_acknowledges_fails_and_is_withdrawn() -> None:
    own, call = instance(handshake(MODEL), trusted=True, time_out=1000, send=True)
    for _ in range(200):
        own.written += 1
        call()
    assert (own.busy, own.failed, own.toggle) == (False, True, True)
    own.send = False
    call()
    own.send = True
    call()
    assert own.toggle == own.acknowledge


def test_triggers_pulse_only_when_asked() -> None:
    own, call = instance(triggers(MODEL), period=100, trusted=True)
    levels = []
    for own.write in (False, True):
        for _ in range(100):
            call()
            levels.append((own.write, own.write1, own.write2))
    assert {level for level in levels if not level[0]} == {(False, False, False)}
    assert {level for level in levels if level[0]} == {(True, False, False), (True, True, False)}
    assert own.written > 1
