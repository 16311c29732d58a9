"""PDO 01 to 20 of the conformance tester: transmission types and NMT states; and what CiA 301 says beyond."""

from __future__ import annotations

import struct
from collections.abc import Callable

import pytest

from tests.links.canopen_node.conformance.bench import Tester

TPDO, RPDO = 0x1800, 0x1400
TPDO_MAP, RPDO_MAP = 0x1A00, 0x1600
NO_RTR = 0x4000_0000
MAPPINGS = pytest.mark.parametrize("communication", [RPDO, TPDO], ids=["RPDO", "TPDO"])
QUIET = 0.03
"""Seconds in which nothing may come."""


def _values(number: int) -> bytes:
    """The content of TPDO 2 and RPDO 2 for two integers."""
    return struct.pack("<ii", number, -number)


def _show(dut: Tester, number: int) -> None:
    dut.robot(ints_out__0=number, ints_out__1=-number)


@pytest.mark.parametrize("number", range(4))
def test_cct_pdo_01_rpdo_communication_parameters(dut: Tester, number: int) -> None:
    assert dut.read(RPDO + number, 1) == 0x205 + 0x100 * number
    assert dut.read(RPDO + number, 0) == 5
    assert dut.read(RPDO_MAP + number, 0) == (16, 2, 2, 1)[number]


@pytest.mark.parametrize("number", range(4))
def test_cct_pdo_02_tpdo_communication_parameters(dut: Tester, number: int) -> None:
    assert dut.read(TPDO + number, 1) == 0x4000_0185 + 0x100 * number
    assert dut.read(TPDO + number, 0) == 6
    assert dut.read(TPDO_MAP + number, 0) == (16, 2, 2, 1)[number]


def test_cct_pdo_03_remote_frames_are_not_allowed_and_not_answered(dut: Tester) -> None:
    dut.start()
    _no_remote_frames(dut)


def _no_remote_frames(dut: Tester) -> None:
    """Bit 30 of every TPDO says so, and the tester skips the case."""
    for number in range(4):
        assert NO_RTR & dut.read(TPDO + number, 1)
    dut.frames(0)
    _unanswered_remote_frames(dut)


def _unanswered_remote_frames(dut: Tester) -> None:
    for number in range(4):
        dut.send(0x185 + 0x100 * number, remote=True, length=8)
    assert [frame for _, frame in dut.frames(QUIET) if frame.can_id & 0x780 != 0x580] == []


def test_cct_pdo_04_event_driven_tpdo(dut: Tester) -> None:
    dut.transmission(TPDO + 1, 254, event=100)
    dut.start()
    assert dut.expect(0x285) == _values(0)
    _show(dut, 7)
    assert dut.expect(0x285) == _values(7)
    dut.pre_operational()
    dut.flush()
    _show(dut, 8)
    assert dut.of(0x285, QUIET) == []


def test_cct_pdo_05_event_timer(exact: Tester) -> None:
    exact.transmission(TPDO + 1, 254, event=100)
    exact.start()
    times = [moment for moment, _ in exact.of(0x285, 0.55)]
    assert [round(moment - times[0], 6) for moment in times] == [0, 0.1, 0.2, 0.3, 0.4, 0.5]


def test_301_inhibit_time_holds_changes_back_and_sends_the_newest(exact: Tester) -> None:
    exact.transmission(TPDO + 1, 254, inhibit=500)
    exact.start()
    first, _ = exact.timed(0x285)
    for number in range(1, 5):
        exact.wait(0.01)
        _show(exact, number)
    ((moment, data),) = exact.of(0x285, 0.2)
    assert (round(moment - first, 6), data) == (0.05, _values(4))


def test_cct_pdo_07_type_0_is_sent_with_the_first_sync_and_not_with_the_second(dut: Tester) -> None:
    """The tester wants a second one, though nothing has changed: the case fails, as it does in the trace."""
    dut.transmission(TPDO + 1, 0)
    dut.start()
    dut.flush()
    dut.sync()
    assert dut.expect(0x285) == _values(0)
    dut.sync()
    assert dut.of(0x285, QUIET) == []


def test_301_type_0_is_sent_with_the_sync_after_a_change(dut: Tester) -> None:
    dut.transmission(TPDO + 1, 0)
    dut.start()
    dut.flush()
    _show(dut, 5)
    assert dut.of(0x285, QUIET) == []
    dut.sync()
    assert dut.expect(0x285) == _values(5)
    dut.sync()
    assert dut.of(0x285, QUIET) == []


@pytest.mark.parametrize("kind", [1, 2, 3])
def test_301_first_cyclic_types(dut: Tester, kind: int) -> None:
    _cyclic(dut, kind, 3 * kind)


@pytest.mark.parametrize("kind", [4, 10, 100, 239, 240])
def test_301_greater_cyclic_types(exact: Tester, kind: int) -> None:
    _cyclic(exact, kind, 2 * kind + 1)


def test_301_every_cyclic_type_can_be_set(exact: Tester) -> None:
    for communication in (RPDO, TPDO):
        for kind in range(241):
            exact.set(communication, 2, kind, 1)
            assert exact.read(communication, 2) == kind


def _cyclic(dut: Tester, kind: int, syncs: int) -> None:
    """With the first SYNC, and with every n-th after it, whether anything has changed or not."""
    dut.transmission(TPDO + 1, kind)
    dut.start()
    dut.flush()
    for _ in range(syncs):
        dut.sync()
    count = len(dut.of(0x285, 0.05))
    assert count == -(-syncs // kind)


def test_cct_pdo_06_type_1_is_sent_with_every_sync_as_of_that_moment(dut: Tester) -> None:
    dut.transmission(TPDO + 1, 1)
    dut.start()
    dut.flush()
    for number in (3, 4, 4):
        _show(dut, number)
        dut.sync()
        assert dut.expect(0x285) == _values(number)


def test_301_counting_of_syncs_begins_anew_with_operational(dut: Tester) -> None:
    dut.transmission(TPDO + 1, 3)
    dut.start()
    dut.flush()
    dut.sync()
    dut.expect(0x285)
    dut.pre_operational()
    dut.start()
    dut.flush()
    dut.sync()
    assert dut.expect(0x285) == _values(0)


def test_cct_pdo_08_sync_start_value(dut: Tester) -> None:
    dut.set(0x1019, 0, 10, 1)
    dut.transmission(TPDO + 1, 2, sync_start=3)
    dut.start()
    dut.flush()
    for counter in (1, 2, 3, 4, 5, 6, 7):
        dut.sync(counter)
        if counter in (3, 5, 7):
            dut.expect(0x285)
        assert dut.of(0x285, QUIET) == []


def test_cct_pdo_09_remote_frames_in_stopped(dut: Tester) -> None:
    for number in range(4):
        assert NO_RTR & dut.read(TPDO + number, 1)
    dut.stop()
    _unanswered_remote_frames(dut)


def test_cct_pdo_10_no_event_driven_tpdo_in_stopped(dut: Tester) -> None:
    _silent(dut, dut.stop, 254, event=100)


def test_cct_pdo_11_no_event_timer_in_stopped(exact: Tester) -> None:
    _silent(exact, exact.stop, 254, seconds=2.0, event=100)


def test_cct_pdo_12_no_cyclic_tpdo_in_stopped(dut: Tester) -> None:
    _silent(dut, dut.stop, 1)


def test_cct_pdo_13_no_acyclic_tpdo_in_stopped(dut: Tester) -> None:
    _silent(dut, dut.stop, 0)


def test_cct_pdo_14_no_sync_start_in_stopped(dut: Tester) -> None:
    dut.set(0x1019, 0, 10, 1)
    _silent(dut, dut.stop, 1, counters=(1, 2, 3), sync_start=2)


def test_cct_pdo_15_remote_frames_in_pre_operational(dut: Tester) -> None:
    dut.pre_operational()
    _no_remote_frames(dut)


def test_cct_pdo_16_no_event_driven_tpdo_in_pre_operational(dut: Tester) -> None:
    _silent(dut, dut.pre_operational, 254, event=100)


def test_cct_pdo_17_no_event_timer_in_pre_operational(exact: Tester) -> None:
    _silent(exact, exact.pre_operational, 254, seconds=2.0, event=100)


def test_cct_pdo_18_no_cyclic_tpdo_in_pre_operational(dut: Tester) -> None:
    _silent(dut, dut.pre_operational, 1)


def test_cct_pdo_19_no_acyclic_tpdo_in_pre_operational(dut: Tester) -> None:
    _silent(dut, dut.pre_operational, 0)


def test_cct_pdo_20_no_sync_start_in_pre_operational(dut: Tester) -> None:
    dut.set(0x1019, 0, 10, 1)
    _silent(dut, dut.pre_operational, 1, counters=(1, 2, 3), sync_start=2)


def _silent(
    dut: Tester,
    enter: Callable[[], None],
    kind: int,
    *,
    seconds: float = QUIET,
    counters: tuple[int | None, ...] = (None, None),
    **others: int,
) -> None:
    """No TPDO in this state, whatever its type, the SYNCs and the changes."""
    dut.transmission(TPDO + 1, kind, **others)
    enter()
    _show(dut, 7)
    for counter in counters:
        dut.sync(counter)
    assert [frame for _, frame in dut.frames(seconds) if 0x180 <= frame.can_id < 0x580] == []


def test_301_type_255_is_event_driven(dut: Tester) -> None:
    dut.transmission(TPDO + 1, 255)
    dut.start()
    assert dut.expect(0x285) == _values(0)
    _show(dut, 9)
    assert dut.expect(0x285) == _values(9)


@pytest.mark.parametrize("kind", [241, 242, 250, 251, 252, 253])
@MAPPINGS
def test_301_reserved_types_are_refused(dut: Tester, communication: int, kind: int) -> None:
    """252 and 253 mean an answer to a remote frame, which is not offered."""
    dut.disable(communication)
    assert dut.write(communication, 2, kind, 1) == 0x0609_0030
    assert dut.read(communication, 2) == 254


@pytest.mark.parametrize("kind", [254, 255])
def test_301_event_driven_rpdo_takes_effect_at_once(dut: Tester, kind: int) -> None:
    dut.transmission(RPDO + 1, kind)
    dut.start()
    dut.send(0x305, _values(21))
    dut.becomes("ints_in[0]", 21)
    assert dut.value("ints_in[1]") == -21


@pytest.mark.parametrize("kind", [0, 1, 2, 240])
def test_301_synchronous_rpdo_takes_effect_with_sync(dut: Tester, kind: int) -> None:
    dut.transmission(RPDO + 1, kind)
    dut.start()
    dut.send(0x305, _values(20))
    dut.send(0x305, _values(22))
    dut.flush()
    assert dut.value("ints_in[0]") == 0
    dut.sync()
    dut.becomes("ints_in[0]", 22)


def test_301_pdos_run_in_operational_alone(dut: Tester) -> None:
    for enter in (dut.pre_operational, dut.stop):
        enter()
        dut.send(0x305, _values(23))
        dut.sync()
        _show(dut, 23)
        assert [frame for _, frame in dut.frames(QUIET) if 0x180 <= frame.can_id < 0x580] == []
        assert dut.value("ints_in[0]") == 0


def test_301_rpdo_deadline(exact: Tester) -> None:
    exact.transmission(RPDO + 1, 255, event=50)
    exact.start()
    exact.wait(1.0)
    assert exact.of(0x085, 0) == [], "the first frame starts the supervision"
    exact.send(0x305, _values(1))
    begin = exact.device.now
    moment, data = exact.timed(0x085)
    assert round(moment - begin, 6) == 0.05
    assert data[:3] == bytes.fromhex("508211")
    exact.send(0x305, _values(1))
    assert exact.expect(0x085)[:2] == b"\0\0"


def test_301_tpdo_is_silent_while_invalid(dut: Tester) -> None:
    cob_id = dut.disable(TPDO + 1)
    dut.start()
    _show(dut, 1)
    assert dut.of(0x285, QUIET) == []
    dut.set(TPDO + 1, 1, cob_id, 4)
    assert dut.expect(0x285) == _values(1)


def test_301_rpdo_is_deaf_while_invalid(dut: Tester) -> None:
    cob_id = dut.disable(RPDO + 1)
    dut.start()
    dut.send(0x305, _values(1))
    dut.flush()
    assert dut.value("ints_in[0]") == 0
    dut.set(RPDO + 1, 1, cob_id, 4)
    dut.send(0x305, _values(1))
    dut.becomes("ints_in[0]", 1)


@MAPPINGS
def test_301_cob_id_of_a_pdo_moves_only_while_invalid(dut: Tester, communication: int) -> None:
    cob_id = dut.read(communication + 1, 1)
    moved = cob_id & ~0x7FF | 0x1A0
    assert dut.write(communication + 1, 1, moved, 4) == 0x0609_0030
    dut.disable(communication + 1)
    dut.set(communication + 1, 1, moved, 4)
    dut.start()
    if communication == TPDO:
        assert dut.expect(0x1A0) == _values(0)
    else:
        dut.send(0x1A0, _values(6))
        dut.becomes("ints_in[0]", 6)


@MAPPINGS
def test_301_extended_identifiers_are_refused(dut: Tester, communication: int) -> None:
    """Bit 29: an identifier of 29 bits."""
    cob_id = dut.disable(communication)
    assert dut.write(communication, 1, cob_id | 0x2000_0000, 4) == 0x0609_0030
    assert dut.write(communication, 1, 0x0001_2345, 4) == 0x0609_0030
