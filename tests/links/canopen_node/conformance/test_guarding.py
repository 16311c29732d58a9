"""Guarding and Heartbeat of the conformance tester, one against the other, and what CiA 301 says beyond them."""

from __future__ import annotations

from itertools import pairwise

import pytest

from tests.links.canopen_node.conformance.bench import Tester

EMCY = 0x085
HEARTBEAT = 0x705
MASTER = 1
GUARD_TIME, LIFE_TIME_FACTOR = 0x100C, 0x100D
TESTER = 0x47
"""The node-ID that the tester takes as a producer."""
QUIET = 0.03


# -- Guarding ----------------------------------------------------------------------------------------------------------


def test_cct_guarding_01_guard_time_and_life_time_factor(dut: Tester) -> None:
    assert (dut.read(GUARD_TIME), dut.read(LIFE_TIME_FACTOR)) == (0, 0)


def test_cct_guarding_02_remote_frame_is_answered(dut: Tester) -> None:
    assert dut.guard() == b"\x7f"


def test_cct_guarding_03_toggle_bit(dut: Tester) -> None:
    assert [dut.guard() for _ in range(4)] == [b"\x7f", b"\xff", b"\x7f", b"\xff"]


def test_cct_guarding_04_only_the_own_identifier_is_answered(dut: Tester) -> None:
    for can_id in range(0x701, 0x780):
        dut.send(can_id, remote=True, length=1)
    assert [frame.can_id for _, frame in dut.frames(QUIET)] == [HEARTBEAT]


def test_cct_guarding_05_guard_time_and_life_time_factor_are_written(dut: Tester) -> None:
    _life_time(dut, 500, 3)
    assert (dut.read(GUARD_TIME), dut.read(LIFE_TIME_FACTOR)) == (500, 3)


def test_cct_guarding_06_lost_master(exact: Tester) -> None:
    """Within the node life time nothing, after it EMCY 8130h, with the next request its end."""
    _life_time(exact, 100, 3)
    exact.start()
    for _ in range(10):
        exact.guard()
        assert exact.of(EMCY, 0.25) == []
    assert exact.expect(EMCY, 0.06)[:2] == b"\x30\x81"
    exact.guard()
    assert exact.expect(EMCY)[:2] == b"\0\0"


def _life_time(dut: Tester, milliseconds: int, factor: int) -> None:
    dut.set(GUARD_TIME, 0, milliseconds, 2)
    dut.set(LIFE_TIME_FACTOR, 0, factor, 1)


# -- Heartbeat ---------------------------------------------------------------------------------------------------------


def test_cct_heartbeat_01_heartbeat_time_is_written(dut: Tester) -> None:
    dut.heartbeats(0)
    assert dut.read(0x1017) == 0


def test_cct_heartbeat_02_heartbeats_of_ten_seconds(exact: Tester) -> None:
    exact.heartbeats(100)
    assert len(exact.of(HEARTBEAT, 10.0)) in (100, 101)


def test_cct_heartbeat_03_no_heartbeat(exact: Tester) -> None:
    exact.heartbeats(100)
    exact.heartbeats(0)
    exact.flush()
    assert exact.of(HEARTBEAT, 10.0) == []


def test_cct_heartbeat_04_no_node_is_watched_twice(dut: Tester) -> None:
    assert dut.read(0x1016) == 8
    dut.set(0x1016, 1, MASTER << 16 | 0x1234, 4)
    assert dut.write(0x1016, 2, MASTER << 16 | 0x1234, 4) == 0x0604_0043


def test_cct_heartbeat_05_heartbeats_in_time(exact: Tester) -> None:
    """In every entry of 1016h."""
    exact.start()
    for number in range(1, 9):
        node = 10 + number
        exact.set(0x1016, number, node << 16 | 1000, 4)
        for _ in range(10):
            exact.send(0x700 + node, b"\x7f")
            assert exact.of(EMCY, 0.9) == []
        exact.set(0x1016, number, 0, 4)


def test_cct_heartbeat_06_heartbeats_too_late(exact: Tester) -> None:
    """In every entry of 1016h: nothing before the first heartbeat, then EMCY 8130h and its end, again and again."""
    for number in range(1, 9):
        node = 10 + number
        exact.set(0x1016, number, node << 16 | 1000, 4)
        assert exact.of(EMCY, 10.0) == []
        exact.send(0x700 + node, b"\x7f")
        for _ in range(3):
            assert exact.expect(EMCY, 1.1)[:2] == b"\x30\x81"
            exact.wait(0.1)
            exact.send(0x700 + node, b"\x7f")
            assert exact.expect(EMCY)[:2] == b"\0\0"
        exact.set(0x1016, number, 0, 4)


@pytest.mark.parametrize("number", range(1, 9))
def test_cct_heartbeat_07_lost_heartbeat_ends_operational(exact: Tester, number: int) -> None:
    """From a reset on: OPERATIONAL without and with heartbeats, PRE-OPERATIONAL when they stop."""
    exact.reset()
    exact.heartbeats(500)
    exact.set(0x1016, number, TESTER << 16 | 1000, 4)
    exact.start()
    assert exact.of(EMCY, 10.0) == []
    for _ in range(10):
        exact.send(0x700 + TESTER, b"\x7f")
        exact.wait(0.9)
    exact.send(0x700 + TESTER, b"\x7f")
    exact.stays(5)
    assert exact.expect(EMCY, 1.1)[:2] == b"\x30\x81"
    exact.reaches(127)


# -- Heartbeat versus guarding -----------------------------------------------------------------------------------------


def test_cct_heartbeat_versus_guarding_01_both_have_their_objects(dut: Tester) -> None:
    assert (dut.read(0x1017), dut.read(GUARD_TIME), dut.read(LIFE_TIME_FACTOR)) == (0, 0, 0)


def test_cct_heartbeat_versus_guarding_02_heartbeat_off(dut: Tester) -> None:
    dut.heartbeats(0)
    dut.flush()
    assert dut.of(HEARTBEAT, QUIET) == []


def test_cct_heartbeat_versus_guarding_03_guarding_without_a_heartbeat(dut: Tester) -> None:
    dut.heartbeats(0)
    _life_time(dut, 500, 3)
    assert [dut.guard() for _ in range(3)] == [b"\x7f", b"\xff", b"\x7f"]


def test_cct_heartbeat_versus_guarding_04_heartbeat_without_guarding(dut: Tester) -> None:
    _life_time(dut, 0, 0)
    dut.heartbeats(5)
    assert [dut.expect(HEARTBEAT) for _ in range(3)] == [b"\x7f"] * 3


def test_cct_heartbeat_versus_guarding_05_remote_frames_without_guarding(exact: Tester) -> None:
    _life_time(exact, 0, 0)
    _heartbeats_alone(exact)


def test_cct_heartbeat_versus_guarding_06_heartbeat_goes_before_guarding(exact: Tester) -> None:
    """No heartbeat is missing, and no master is missed."""
    _life_time(exact, 100, 3)
    exact.heartbeats(1000)
    exact.start()
    assert len(exact.of(HEARTBEAT, 10.0)) in (10, 11)
    assert exact.of(EMCY, 1.0) == []


def test_cct_heartbeat_versus_guarding_07_remote_frames_beside_a_heartbeat(exact: Tester) -> None:
    _life_time(exact, 500, 3)
    _heartbeats_alone(exact)


def _heartbeats_alone(exact: Tester) -> None:
    """With a heartbeat, remote frames are not answered."""
    exact.heartbeats(1000)
    exact.wait(0.01)
    exact.flush()
    for _ in range(3):
        exact.send(HEARTBEAT, remote=True, length=1)
    assert exact.of(HEARTBEAT, 0.5) == []
    assert exact.expect(HEARTBEAT, 1.0) == b"\x7f"


# -- Beyond the tester's cases -----------------------------------------------------------------------------------------


def _watch(dut: Tester, milliseconds: int) -> None:
    dut.set(0x1016, 1, MASTER << 16 | milliseconds, 4)
    dut.wait(0.001)


def _beat(dut: Tester, state: int = 5) -> None:
    dut.send(0x700 + MASTER, bytes([state]))


@pytest.mark.parametrize("milliseconds", [10, 100, 1000, 65535])
def test_301_heartbeat_keeps_its_time(exact: Tester, milliseconds: int) -> None:
    exact.heartbeats(milliseconds)
    times = [moment for moment, _ in exact.of(HEARTBEAT, 3.5 * milliseconds / 1000)]
    assert {round(later - sooner, 6) for sooner, later in pairwise(times)} == {milliseconds / 1000}


def test_301_heartbeat_time_0_ends_it(dut: Tester) -> None:
    dut.heartbeats(5)
    assert dut.expect(HEARTBEAT) == b"\x7f"
    dut.heartbeats(0)
    dut.flush()
    assert dut.of(HEARTBEAT, QUIET) == []


def test_301_heartbeat_shows_every_state(dut: Tester) -> None:
    dut.heartbeats(5)
    for command, state in ((1, 5), (2, 4), (128, 127)):
        dut.nmt(command)
        dut.reaches(state)


def test_301_consumer_waits_for_the_first_heartbeat(exact: Tester) -> None:
    _watch(exact, 50)
    exact.start()
    assert exact.of(EMCY, 10.0) == []
    _beat(exact)
    assert exact.expect(EMCY, 0.051)[:2] == b"\x30\x81"


def test_301_lost_heartbeat(dut: Tester) -> None:
    """EMCY 8130h once, with the node, and PRE-OPERATIONAL by the default of 1029h."""
    _watch(dut, 30)
    dut.start()
    for _ in range(4):
        dut.wait(0.01)
        _beat(dut)
    assert dut.expect(EMCY) == bytes.fromhex("3081110100000000")
    dut.heartbeats(5)
    dut.reaches(127)
    assert dut.of(EMCY, QUIET) == []


def test_301_heartbeat_is_back(dut: Tester) -> None:
    _watch(dut, 20)
    _beat(dut)
    assert dut.expect(EMCY)[:2] == b"\x30\x81"
    _beat(dut)
    assert dut.expect(EMCY) == bytes(8)


@pytest.mark.parametrize("behaviour, state", [(0, 127), (1, 5), (2, 4)])
def test_301_error_behaviour(dut: Tester, behaviour: int, state: int) -> None:
    """And: no node is watched twice."""
    _watch(dut, 30)
    assert dut.write(0x1016, 2, MASTER << 16 | 100, 4) == 0x0604_0043
    dut.set(0x1029, 1, behaviour, 1)
    dut.heartbeats(5)
    dut.start()
    dut.reaches(5)
    _beat(dut)
    if state != 4:
        dut.expect(EMCY)
    else:
        dut.wait(0.06)
    dut.reaches(state)
