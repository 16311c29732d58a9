from __future__ import annotations

from dataclasses import replace

import pytest

from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal import Reason
from gatewayd.core.refusal_log import MAX_PEERS, REFUSAL_INTERVAL, RefusalLog


def refusal(
    time: float, variable: int = 0, writer: int | None = 0, reason: Reason = Reason.HELD, peer: str = ""
) -> Event:
    return Event(time, EventKind.REFUSED, variable=variable, writer=writer, reason=reason, peer=peer)


def test_the_first_is_told_at_once_and_equal_ones_are_counted() -> None:
    reported: list[Event] = []
    log = RefusalLog(reported.append)
    for step in range(50):
        log.add(refusal(step * 0.01))
    assert [(event.time, event.repeats) for event in reported] == [(0.0, 0)]


def test_what_differs_in_writer_variable_or_reason_is_told() -> None:
    reported: list[Event] = []
    log = RefusalLog(reported.append)
    for one in (
        refusal(0.0),
        refusal(0.0, variable=1),
        refusal(0.0, writer=None),
        refusal(0.0, reason=Reason.ROBOT_LOST),
    ):
        log.add(one)
    assert len(reported) == 4


def test_the_next_one_after_the_interval_carries_the_count() -> None:
    reported: list[Event] = []
    log = RefusalLog(reported.append)
    for time in (0.0, 1.0, 2.0, REFUSAL_INTERVAL):
        log.add(refusal(time))
    assert [event.repeats for event in reported] == [0, 2]


def test_what_was_counted_is_told_even_if_no_other_follows() -> None:
    reported: list[Event] = []
    log = RefusalLog(reported.append)
    for time in (0.0, 1.0, 2.0):
        log.add(refusal(time))
    log.tick(REFUSAL_INTERVAL - 0.01)
    assert len(reported) == 1
    log.tick(REFUSAL_INTERVAL)
    assert (reported[1].time, reported[1].repeats, reported[1].detail) == (
        REFUSAL_INTERVAL,
        1,
        "the last 8.0 s ago",
    )
    log.tick(3 * REFUSAL_INTERVAL)
    assert len(reported) == 2


@pytest.mark.parametrize("more, said", [(1, "just now"), (2, "the last just now")])
def test_one_just_before_the_report_was_just_now(more: int, said: str) -> None:
    reported: list[Event] = []
    log = RefusalLog(reported.append)
    for time in (0.0, *more * [REFUSAL_INTERVAL - 0.001]):
        log.add(refusal(time))
    log.tick(REFUSAL_INTERVAL)
    assert reported[1].detail == said


def test_each_interval_tells_one_at_most_and_all_are_accounted_for() -> None:
    reported: list[Event] = []
    log = RefusalLog(reported.append)
    for step in range(1000):
        log.add(refusal(step * 0.05))
        log.tick(step * 0.05)
    log.tick(100.0)
    assert len(reported) <= 7
    assert sum(1 + event.repeats for event in reported) == 1000


def test_nothing_is_remembered_of_what_is_over() -> None:
    log = RefusalLog(lambda _: None)
    for variable in range(1000):
        log.add(refusal(0.0, variable=variable))
    log.tick(REFUSAL_INTERVAL)
    assert not log._reported


def test_refusals_of_one_peer_are_never_told_of_another() -> None:
    reported: list[Event] = []
    log = RefusalLog(reported.append)
    for step in range(10):
        for host in ("192.0.2.30", "192.0.2.31", "[fe80::1]"):
            log.add(refusal(step * 0.1, writer=None, peer=f"{host}:{50_000 + step}"))
    log.tick(REFUSAL_INTERVAL)
    assert [(event.peer.rpartition(":")[0], 1 + event.repeats) for event in reported] == [
        ("192.0.2.30", 1), ("192.0.2.31", 1), ("[fe80::1]", 1),
        ("192.0.2.30", 9), ("192.0.2.31", 9), ("[fe80::1]", 9),
    ]  # fmt: skip


def test_whoever_holds_it_is_named_for_the_refusals_that_were_his_doing() -> None:
    reported: list[Event] = []
    log = RefusalLog(reported.append)
    for holder in (1, 2, 1, 2, 2):
        log.add(replace(refusal(0.0), other=holder))
    log.tick(REFUSAL_INTERVAL)
    assert [(event.other, 1 + event.repeats) for event in reported] == [(1, 1), (2, 1), (1, 1), (2, 2)]


def test_peers_are_told_apart_up_to_a_bound_and_those_beyond_it_have_no_address() -> None:
    reported: list[Event] = []
    log = RefusalLog(reported.append)
    for number in range(1000):
        log.add(refusal(0.0, writer=None, peer=f"[2001:db8::{number:x}]:502"))
    log.tick(REFUSAL_INTERVAL)
    assert sum(1 + event.repeats for event in reported) == 1000
    assert len({event.peer for event in reported if event.peer}) == MAX_PEERS
    assert {event.peer for event in reported[MAX_PEERS:]} == {""}
    log.add(refusal(2 * REFUSAL_INTERVAL, writer=None, peer="192.0.2.30:502"))
    log.tick(4 * REFUSAL_INTERVAL)
    log.add(refusal(5 * REFUSAL_INTERVAL, writer=None, peer="192.0.2.30:502"))
    assert reported[-1].peer == "192.0.2.30:502"


def test_addresses_of_version_6_are_told_apart() -> None:
    """They have colons, and no port."""
    reported: list[Event] = []
    log = RefusalLog(reported.append)
    for peer in ("2001:db8::1", "2001:db8::2"):
        log.add(Event(0.0, EventKind.REFUSED, reason=Reason.NOT_WRITABLE, peer=peer))
    assert [event.peer for event in reported] == ["2001:db8::1", "2001:db8::2"]


def test_merged_requests_that_differ_are_said_to_differ() -> None:
    reported: list[Event] = []
    log = RefusalLog(reported.append)
    for time, request in ((0.0, "read 1"), (1.0, "read 1"), (2.0, "read 2")):
        log.add(Event(time, EventKind.UNSERVED, writer=0, request=request))
    log.tick(REFUSAL_INTERVAL)
    assert (reported[1].request, reported[1].repeats) == ("read 2", 1)
    assert reported[1].detail == "others among them, the last 8.0 s ago"
