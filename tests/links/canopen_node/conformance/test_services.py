"""Emergency, Synchronization and Heartbeat of the conformance tester."""

from __future__ import annotations

from itertools import pairwise

import pytest

from tests.links.canopen_node.conformance.bench import Tester

EMCY = 0x085
HEARTBEAT = 0x705
MASTER = 1
PRODUCER = 0x4000_0000
QUIET = 0.03
SHORT = b"\1"
"""An RPDO that is too short: the error that a tester can provoke."""


def _fail(dut: Tester) -> None:
    dut.send(0x305, SHORT)


def _recover(dut: Tester) -> None:
    dut.send(0x305, bytes(8))


# -- Emergency ---------------------------------------------------------------------------------------------------------


def test_cct_emergency_01_no_error_after_power_on(dut: Tester) -> None:
    assert dut.read(0x1001) == 0
    assert dut.read(0x1003) == 0
    assert dut.upload(0x1003, 1) == 0x0800_0024
    dut.start()
    assert dut.of(EMCY, QUIET) == []


def test_cct_emergency_02_error_and_its_end(dut: Tester) -> None:
    """Code, error register and the manufacturer's bytes, once each; 1001h and 1003h show the same."""
    dut.start()
    _fail(dut)
    _fail(dut)
    assert dut.expect(EMCY) == bytes.fromhex("1082110200000000")
    assert dut.read(0x1001) == 0x11
    assert (dut.read(0x1003), dut.read(0x1003, 1)) == (1, 0x0002_8210)
    _recover(dut)
    assert dut.expect(EMCY) == bytes(8)
    assert dut.read(0x1001) == 0
    assert dut.read(0x1003) == 1
    assert dut.of(EMCY, QUIET) == []


def test_cct_emergency_03_history_is_cleared_by_0_alone(dut: Tester) -> None:
    dut.start()
    _fail(dut)
    for number in (1, 255):
        assert dut.write(0x1003, 0, number, 1) in (0x0609_0030, 0x0609_0031)
    assert dut.write(0x1003, 1, 0, 4) == 0x0601_0002
    dut.set(0x1003, 0, 0, 1)
    assert dut.read(0x1003) == 0


def test_cct_emergency_04_history_is_newest_first_and_bounded(dut: Tester) -> None:
    dut.start()
    for _ in range(6):
        _fail(dut)
        dut.send(0x405, SHORT)
        _recover(dut)
        dut.send(0x405, bytes(8))
    dut.flush()
    assert dut.read(0x1003) == 8
    assert [dut.read(0x1003, number) >> 16 for number in range(1, 9)] == [3, 2] * 4


def test_cct_emergency_05_cob_id(dut: Tester) -> None:
    """Changed only by way of "invalid"; invalid means silent."""
    dut.start()
    assert dut.read(0x1014) == EMCY
    assert dut.write(0x1014, 0, 0x190, 4) == 0x0609_0030
    dut.set(0x1014, 0, 0x8000_0000 | EMCY, 4)
    _fail(dut)
    _recover(dut)
    assert dut.of(EMCY, QUIET) == []
    dut.set(0x1014, 0, 0x190, 4)
    _fail(dut)
    assert dut.expect(0x190)[:2] == b"\x10\x82"
    dut.reset(130)
    assert dut.read(0x1014) == EMCY


def test_cct_emergency_06_inhibit_time(exact: Tester) -> None:
    exact.set(0x1015, 0, 1000, 2)
    exact.start()
    for _ in range(2):
        _fail(exact)
        _recover(exact)
    times = [moment for moment, _ in exact.of(EMCY, 1.0)]
    assert [round(later - sooner, 6) for sooner, later in pairwise(times)] == [0.1] * 3


# -- Synchronization ---------------------------------------------------------------------------------------------------


def _synchronous(dut: Tester) -> None:
    """TPDO 2 with every SYNC, in OPERATIONAL."""
    dut.transmission(0x1801, 1)
    dut.start()
    dut.flush()


def test_cct_synchronization_01_consumer_by_default(dut: Tester) -> None:
    assert dut.read(0x1005) == 0x80
    _synchronous(dut)
    dut.sync()
    assert len(dut.expect(0x285)) == 8


def test_cct_synchronization_02_cob_id_of_a_consumer_moves(dut: Tester) -> None:
    dut.set(0x1005, 0, 0x1B0, 4)
    assert dut.read(0x1005) == 0x1B0
    _synchronous(dut)
    dut.sync()
    assert dut.of(0x285, QUIET) == []
    dut.sync(can_id=0x1B0)
    dut.expect(0x285)


def test_cct_synchronization_03_extended_and_restricted_cob_ids(dut: Tester) -> None:
    for cob_id in (0x2000_0080, 0x0000_0880, 0x000, 0x001, 0x07F, 0x101, 0x180, 0x581, 0x601, 0x701, 0x7FF):
        assert dut.write(0x1005, 0, cob_id, 4) == 0x0609_0030
    assert dut.read(0x1005) == 0x80


def test_cct_synchronization_04_producer_with_its_period(exact: Tester) -> None:
    exact.set(0x1006, 0, 20_000, 4)
    exact.set(0x1005, 0, PRODUCER | 0x80, 4)
    times = [moment for moment, _ in exact.of(0x80, 0.2)]
    assert len(times) >= 10
    assert {round(later - sooner, 6) for sooner, later in pairwise(times)} == {0.02}


def test_cct_synchronization_05_producer_on_a_bus(linked: Tester) -> None:
    linked.set(0x1005, 0, PRODUCER | 0x80, 4)
    assert linked.of(0x80, QUIET) == [], "no period, no SYNC"
    linked.set(0x1006, 0, 5_000, 4)
    assert [linked.expect(0x80) for _ in range(3)] == [b""] * 3
    linked.set(0x1005, 0, 0x80, 4)
    linked.flush()
    assert linked.of(0x80, QUIET) == []


def test_cct_synchronization_06_new_period_and_none(exact: Tester) -> None:
    exact.set(0x1005, 0, PRODUCER | 0x80, 4)
    for period in (10_000, 50_000):
        exact.set(0x1006, 0, period, 4)
        exact.wait(0.001)
        times = [moment for moment, _ in exact.of(0x80, 0.5)]
        assert {round(later - sooner, 6) for sooner, later in pairwise(times)} == {period / 1e6}
    exact.set(0x1006, 0, 0, 4)
    exact.flush()
    assert exact.of(0x80, 1.0) == []


def test_cct_synchronization_07_producer_keeps_its_cob_id(dut: Tester) -> None:
    dut.set(0x1005, 0, PRODUCER | 0x80, 4)
    assert dut.write(0x1005, 0, PRODUCER | 0x90, 4) == 0x0609_0030
    dut.set(0x1005, 0, 0x90, 4)
    dut.set(0x1005, 0, PRODUCER | 0x90, 4)
    dut.set(0x1006, 0, 5_000, 4)
    dut.expect(0x90)


def test_cct_synchronization_08_counter_overflow_values(dut: Tester) -> None:
    for value in (1, 241, 255):
        assert dut.write(0x1019, 0, value, 1) in (0x0609_0030, 0x0609_0031)
    for value in (2, 240, 0):
        dut.set(0x1019, 0, value, 1)
    dut.set(0x1006, 0, 100_000, 4)
    assert dut.write(0x1019, 0, 10, 1) == 0x0800_0022
    assert dut.read(0x1019) == 0


def test_cct_synchronization_09_counter_of_a_producer(exact: Tester) -> None:
    exact.set(0x1019, 0, 3, 1)
    exact.set(0x1006, 0, 10_000, 4)
    exact.set(0x1005, 0, PRODUCER | 0x80, 4)
    counters = [data[0] for _, data in exact.of(0x80, 0.065)]
    assert counters[:6] == [1, 2, 3, 1, 2, 3]
    exact.stop()
    assert exact.of(0x80, 0.1) == []
    exact.pre_operational()
    assert exact.expect(0x80) == b"\1", "after STOPPED it begins with 1"


def test_cct_synchronization_10_window_and_length(dut: Tester) -> None:
    """A SYNC of the wrong length is reported and means nothing; what comes after the window is dropped."""
    dut.transmission(0x1401, 1)
    dut.start()
    dut.sync(7)
    assert dut.expect(EMCY)[:2] == b"\x40\x82"
    dut.sync()
    assert dut.expect(EMCY)[:2] == b"\0\0"
    dut.set(0x1007, 0, 5_000, 4)
    dut.sync()
    dut.wait(0.02)
    dut.send(0x305, b"\5" + bytes(7))
    dut.sync()
    dut.flush()
    assert dut.value("ints_in[0]") == 0


# -- Heartbeat ---------------------------------------------------------------------------------------------------------


def _watch(dut: Tester, milliseconds: int) -> None:
    dut.set(0x1016, 1, MASTER << 16 | milliseconds, 4)
    dut.wait(0.001)


def _beat(dut: Tester, state: int = 5) -> None:
    dut.send(0x700 + MASTER, bytes([state]))


@pytest.mark.parametrize("milliseconds", [10, 100, 1000, 65535])
def test_cct_heartbeat_01_producer_keeps_its_time(exact: Tester, milliseconds: int) -> None:
    exact.heartbeats(milliseconds)
    times = [moment for moment, _ in exact.of(HEARTBEAT, 3.5 * milliseconds / 1000)]
    assert {round(later - sooner, 6) for sooner, later in pairwise(times)} == {milliseconds / 1000}


def test_cct_heartbeat_02_time_0_ends_it(dut: Tester) -> None:
    dut.heartbeats(5)
    assert dut.expect(HEARTBEAT) == b"\x7f"
    dut.heartbeats(0)
    dut.flush()
    assert dut.of(HEARTBEAT, QUIET) == []


def test_cct_heartbeat_03_tells_every_state(dut: Tester) -> None:
    dut.heartbeats(5)
    for command, state in ((1, 5), (2, 4), (128, 127)):
        dut.nmt(command)
        dut.reaches(state)


def test_cct_heartbeat_04_consumer_waits_for_the_first_one(exact: Tester) -> None:
    _watch(exact, 50)
    exact.start()
    assert exact.of(EMCY, 10.0) == []
    _beat(exact)
    assert exact.expect(EMCY, 0.051)[:2] == b"\x30\x81"


def test_cct_heartbeat_05_lost_heartbeat(dut: Tester) -> None:
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


def test_cct_heartbeat_06_heartbeat_is_back(dut: Tester) -> None:
    _watch(dut, 20)
    _beat(dut)
    assert dut.expect(EMCY)[:2] == b"\x30\x81"
    _beat(dut)
    assert dut.expect(EMCY) == bytes(8)


@pytest.mark.parametrize("behaviour, state", [(0, 127), (1, 5), (2, 4)])
def test_cct_heartbeat_07_error_behaviour(dut: Tester, behaviour: int, state: int) -> None:
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
