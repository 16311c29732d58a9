"""Emergency and Synchronization of the conformance tester, and what CiA 301 says of EMCY and SYNC beyond them."""

from __future__ import annotations

from itertools import pairwise

import pytest

from tests.links.canopen_node.conformance.bench import Tester

EMCY = 0x085
PRODUCER = 0x4000_0000
SAVE, LOAD = (int.from_bytes(word, "little") for word in (b"save", b"load"))
QUIET = 0.03
SHORT = b"\1"
"""An RPDO that is too short: the error that a tester can provoke."""


def _fail(dut: Tester) -> None:
    dut.send(0x305, SHORT)


def _recover(dut: Tester) -> None:
    dut.send(0x305, bytes(8))


# -- Emergency ---------------------------------------------------------------------------------------------------------


def test_cct_emergency_01_cob_id_is_the_predefined_one(dut: Tester) -> None:
    assert dut.read(0x1014) == EMCY


def test_cct_emergency_02_error_register_after_power_on(dut: Tester) -> None:
    assert dut.read(0x1001) == 0
    dut.start()
    assert dut.of(EMCY, QUIET) == []


def test_cct_emergency_03_no_error_in_the_history_after_power_on(dut: Tester) -> None:
    assert dut.read(0x1003) == 0
    assert dut.upload(0x1003, 1) == 0x0800_0024


def test_cct_emergency_04_an_rpdo_without_data_is_an_error(dut: Tester) -> None:
    assert _forced(dut)[:2] == b"\x10\x82"


def test_cct_emergency_05_error_register_is_that_of_the_last_message(dut: Tester) -> None:
    """The error ends with OPERATIONAL: in PRE-OPERATIONAL there are no PDOs that it could be about."""
    assert _forced(dut)[2] == 0x11
    assert dut.expect(EMCY) == bytes(8)
    assert dut.read(0x1001) == 0


def test_cct_emergency_06_history_shows_the_message(dut: Tester) -> None:
    """Its code, and the first two of the manufacturer's bytes as additional information."""
    message = _forced(dut)
    assert dut.upload(0x1003, 1) == message[:2] + message[3:5] == bytes.fromhex("10820100")


def _forced(dut: Tester) -> bytes:
    """The message that the tester brings about: the first RPDO without data, while OPERATIONAL."""
    dut.start()
    dut.send(0x205)
    dut.pre_operational()
    return dut.expect(EMCY)


def test_301_error_and_its_end(dut: Tester) -> None:
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


def test_301_history_is_cleared_by_0_alone(dut: Tester) -> None:
    dut.start()
    _fail(dut)
    for number in (1, 255):
        assert dut.write(0x1003, 0, number, 1) in (0x0609_0030, 0x0609_0031)
    assert dut.write(0x1003, 1, 0, 4) == 0x0601_0002
    dut.set(0x1003, 0, 0, 1)
    assert dut.read(0x1003) == 0


def test_301_history_is_newest_first_and_bounded(dut: Tester) -> None:
    dut.start()
    for _ in range(6):
        _fail(dut)
        dut.send(0x405, SHORT)
        _recover(dut)
        dut.send(0x405, bytes(8))
    dut.flush()
    assert dut.read(0x1003) == 8
    assert [dut.read(0x1003, number) >> 16 for number in range(1, 9)] == [3, 2] * 4


def test_301_cob_id_of_emcy_moves_by_way_of_invalid(dut: Tester) -> None:
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


def test_301_inhibit_time_of_emcy(exact: Tester) -> None:
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


def test_cct_synchronization_01_consumer_of_80h_by_default(dut: Tester) -> None:
    assert dut.read(0x1005) == 0x80
    _synchronous(dut)
    dut.sync()
    assert len(dut.expect(0x285)) == 8


def test_cct_synchronization_02_syncs_of_ten_seconds(exact: Tester) -> None:
    exact.set(0x1006, 0, 100_000, 4)
    exact.set(0x1005, 0, PRODUCER | 0x80, 4)
    assert len(exact.of(0x80, 10.0)) in (100, 101)
    exact.set(0x1005, 0, 0x80, 4)
    assert exact.of(0x80, 1.0) == []


@pytest.mark.parametrize("number", range(4))
def test_cct_synchronization_03_one_tpdo_for_ten_syncs(exact: Tester, number: int) -> None:
    exact.transmission(0x1800 + number, 10)
    exact.start()
    exact.flush()
    for _ in range(100):
        exact.sync()
    assert len(exact.of(0x185 + 0x100 * number, 0.1)) == 10


def test_cct_synchronization_04_consumer_without_a_period(dut: Tester) -> None:
    dut.set(0x1005, 0, 0x80, 4)
    dut.set(0x1006, 0, 0, 4)
    assert dut.of(0x80, QUIET) == []


def test_cct_synchronization_05_counter_overflow_of_1(dut: Tester) -> None:
    _consumer(dut)
    assert dut.write(0x1019, 0, 1, 1) in (0x0609_0030, 0x0609_0031)


def test_cct_synchronization_06_no_counter_without_an_overflow_value(dut: Tester) -> None:
    dut.set(0x1019, 0, 0, 1)
    dut.set(0x1006, 0, 10_000, 4)
    dut.set(0x1005, 0, PRODUCER | 0x80, 4)
    assert [dut.expect(0x80) for _ in range(3)] == [b""] * 3


def test_cct_synchronization_07_counter_of_a_producer(dut: Tester) -> None:
    _consumer(dut)
    _count_to_5(dut)
    assert [dut.expect(0x80) for _ in range(10)] == [bytes([number]) for number in (1, 2, 3, 4, 5)] * 2


def test_cct_synchronization_08_counter_is_stored(dut: Tester) -> None:
    """Saved while the SYNC runs; after the reset it runs by itself and counts from 1."""
    _consumer(dut)
    _count_to_5(dut)
    dut.expect(0x80)
    dut.set(0x1010, 1, SAVE, 4)
    booted = dut.reset()
    heard = [dut.timed(0x80) for _ in range(8)]
    assert [data for moment, data in heard if moment > booted][:3] == [b"\1", b"\2", b"\3"]
    dut.set(0x1011, 1, LOAD, 4)
    dut.reset()
    dut.flush()
    assert dut.of(0x80, QUIET) == []


def test_cct_synchronization_09_counter_while_a_period_is_set(dut: Tester) -> None:
    _consumer(dut)
    dut.set(0x1006, 0, 1_000, 4)
    assert dut.write(0x1019, 0, 5, 1) == 0x0800_0022


def test_cct_synchronization_10_counter_is_stored_without_a_period(dut: Tester) -> None:
    _consumer(dut)
    dut.set(0x1019, 0, 5, 1)
    dut.set(0x1010, 1, SAVE, 4)
    dut.reset()
    assert dut.read(0x1019) == 5


def _consumer(dut: Tester) -> None:
    """The state that most of these cases begin with."""
    assert dut.read(0x1005) == 0x80
    dut.set(0x1005, 0, 0x80, 4)
    dut.set(0x1006, 0, 0, 4)


def _count_to_5(dut: Tester) -> None:
    dut.set(0x1019, 0, 5, 1)
    dut.set(0x1006, 0, 10_000, 4)
    dut.set(0x1005, 0, PRODUCER | 0x80, 4)


def test_301_cob_id_of_a_sync_consumer_moves(dut: Tester) -> None:
    dut.set(0x1005, 0, 0x1B0, 4)
    assert dut.read(0x1005) == 0x1B0
    _synchronous(dut)
    dut.sync()
    assert dut.of(0x285, QUIET) == []
    dut.sync(can_id=0x1B0)
    dut.expect(0x285)


def test_301_extended_and_restricted_cob_ids_of_sync(dut: Tester) -> None:
    for cob_id in (0x2000_0080, 0x0000_0880, 0x000, 0x001, 0x07F, 0x101, 0x180, 0x581, 0x601, 0x701, 0x7FF):
        assert dut.write(0x1005, 0, cob_id, 4) == 0x0609_0030
    assert dut.read(0x1005) == 0x80


def test_301_producer_keeps_its_period(exact: Tester) -> None:
    exact.set(0x1006, 0, 20_000, 4)
    exact.set(0x1005, 0, PRODUCER | 0x80, 4)
    times = [moment for moment, _ in exact.of(0x80, 0.2)]
    assert len(times) >= 10
    assert {round(later - sooner, 6) for sooner, later in pairwise(times)} == {0.02}


def test_301_producer_on_a_bus(linked: Tester) -> None:
    linked.set(0x1005, 0, PRODUCER | 0x80, 4)
    assert linked.of(0x80, QUIET) == [], "no period, no SYNC"
    linked.set(0x1006, 0, 5_000, 4)
    assert [linked.expect(0x80) for _ in range(3)] == [b""] * 3
    linked.set(0x1005, 0, 0x80, 4)
    linked.flush()
    assert linked.of(0x80, QUIET) == []


def test_301_new_period_and_none(exact: Tester) -> None:
    exact.set(0x1005, 0, PRODUCER | 0x80, 4)
    for period in (10_000, 50_000):
        exact.set(0x1006, 0, period, 4)
        exact.wait(0.001)
        times = [moment for moment, _ in exact.of(0x80, 0.5)]
        assert {round(later - sooner, 6) for sooner, later in pairwise(times)} == {period / 1e6}
    exact.set(0x1006, 0, 0, 4)
    exact.flush()
    assert exact.of(0x80, 1.0) == []


def test_301_producer_keeps_its_cob_id(dut: Tester) -> None:
    dut.set(0x1005, 0, PRODUCER | 0x80, 4)
    assert dut.write(0x1005, 0, PRODUCER | 0x90, 4) == 0x0609_0030
    dut.set(0x1005, 0, 0x90, 4)
    dut.set(0x1005, 0, PRODUCER | 0x90, 4)
    dut.set(0x1006, 0, 5_000, 4)
    dut.expect(0x90)


def test_301_counter_overflow_values(dut: Tester) -> None:
    for value in (1, 241, 255):
        assert dut.write(0x1019, 0, value, 1) in (0x0609_0030, 0x0609_0031)
    for value in (2, 240, 0):
        dut.set(0x1019, 0, value, 1)
    dut.set(0x1006, 0, 100_000, 4)
    assert dut.write(0x1019, 0, 10, 1) == 0x0800_0022
    assert dut.read(0x1019) == 0


def test_301_counter_begins_anew_after_stopped(exact: Tester) -> None:
    exact.set(0x1019, 0, 3, 1)
    exact.set(0x1006, 0, 10_000, 4)
    exact.set(0x1005, 0, PRODUCER | 0x80, 4)
    counters = [data[0] for _, data in exact.of(0x80, 0.065)]
    assert counters[:6] == [1, 2, 3, 1, 2, 3]
    exact.stop()
    assert exact.of(0x80, 0.1) == []
    exact.pre_operational()
    assert exact.expect(0x80) == b"\1", "after STOPPED it begins with 1"


def test_301_synchronous_window_and_length_of_sync(dut: Tester) -> None:
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
