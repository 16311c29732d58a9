"""State 01 to 04 and Transition 01 to 04 of the conformance tester: NMT, and what runs in which state."""

from __future__ import annotations

import random

import pytest

from tests.links.canopen_node.conformance.bench import Tester

EMCY, HEARTBEAT = 0x085, 0x705
PRODUCER = 0x4000_0000
QUIET = 0.03
STOPPED, OPERATIONAL, PRE_OPERATIONAL = 4, 5, 127
START, STOP, ENTER_PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 1, 2, 128, 129, 130


def _sync_producer(dut: Tester) -> None:
    dut.set(0x1006, 0, 5_000, 4)
    dut.set(0x1005, 0, PRODUCER | 0x80, 4)


def _tpdo_by_timer(dut: Tester) -> None:
    dut.transmission(0x1801, 254, event=10)


# -- State -------------------------------------------------------------------------------------------------------------


def test_cct_state_01_reset_brings_boot_up_and_defaults(exact: Tester) -> None:
    """Random values into every writable number of the communication profile; after the reset all are as before."""
    entries = exact.device.do(
        lambda node, _cell, _now: [
            (one.index, entry.subindex, entry.type.size)
            for one in node.dictionary
            for entry in one.entries
            if one.index < 0x2000
            and entry.access.writable
            and entry.type.size
            and one.index not in (0x1010, 0x1011)
        ]
    )
    before = {(index, subindex): exact.upload(index, subindex) for index, subindex, _ in entries}
    random_ = random.Random(301)
    taken = 0
    for _ in range(3):
        for index, subindex, size in entries:
            taken += exact.write(index, subindex, random_.randrange(min(1 << 8 * size, 0x8000)), size) == 0
    assert taken > 20
    exact.wait(0.5)
    exact.reset()
    assert {place: exact.upload(*place) for place in before} == before


def test_cct_state_01_boot_up_once_and_pre_operational(dut: Tester) -> None:
    dut.reset()
    assert dut.of(HEARTBEAT, QUIET) == []
    dut.heartbeats(5)
    dut.reaches(PRE_OPERATIONAL)
    dut.heartbeats(0)
    dut.flush()
    assert dut.guard() in (b"\x7f", b"\xff")


def test_cct_state_02_pre_operational(dut: Tester) -> None:
    """SDO, EMCY, SYNC, heartbeat and guarding, and no PDO."""
    _tpdo_by_timer(dut)
    _sync_producer(dut)
    dut.expect(0x80)
    assert dut.read(0x1000) == 0
    dut.heartbeats(5)
    dut.reaches(PRE_OPERATIONAL)
    dut.heartbeats(0)
    dut.send(0x305, b"\1" * 8)
    dut.send(0x305, b"\1")
    dut.flush()
    assert dut.of(0x285, QUIET) == []
    assert dut.value("ints_in[0]") == 0
    assert dut.guard()[0] & 0x7F == PRE_OPERATIONAL


def test_cct_state_03_operational(dut: Tester) -> None:
    """Everything."""
    _tpdo_by_timer(dut)
    _sync_producer(dut)
    dut.start()
    for can_id in (0x285, 0x80, 0x285, 0x80):
        dut.expect(can_id)
    assert dut.read(0x1000) == 0
    dut.send(0x305, b"\1" * 8)
    dut.becomes("ints_in[0]", 0x01010101)
    dut.send(0x305, b"\1")
    dut.expect(EMCY)
    assert dut.guard()[0] & 0x7F == OPERATIONAL
    dut.heartbeats(5)
    dut.reaches(OPERATIONAL)


def test_cct_state_04_stopped(dut: Tester) -> None:
    """NMT, heartbeat and guarding alone."""
    _tpdo_by_timer(dut)
    _sync_producer(dut)
    dut.start()
    dut.expect(0x285)
    dut.stop()
    assert dut.guard()[0] & 0x7F == STOPPED
    dut.frames(0)
    dut.unanswered(bytes.fromhex("40001000"), QUIET)
    dut.send(0x305, b"\1" * 8)
    dut.send(0x305, b"\1")
    dut.robot(ints_out__0=5)
    assert dut.frames(QUIET) == []
    assert dut.value("ints_in[0]") == 0


def test_cct_state_04_sdo_transfer_does_not_survive_it(dut: Tester) -> None:
    dut.sdo(bytes.fromhex("40081000"))
    dut.stop()
    dut.pre_operational()
    assert dut.sdo(b"\x60")[4:] == bytes.fromhex("01000405")


# -- Transition --------------------------------------------------------------------------------------------------------


def test_cct_transition_01_reset_node_and_reset_communication(dut: Tester) -> None:
    for command in (RESET_NODE, RESET_COMMUNICATION):
        dut.heartbeats(5)
        dut.start()
        dut.reaches(OPERATIONAL)
        dut.flush()
        dut.reset(command)
        assert dut.read(0x1017) == 0
        assert dut.of(HEARTBEAT, QUIET) == []


def test_cct_transition_02_enter_pre_operational(dut: Tester) -> None:
    _through(dut, START, ENTER_PRE_OPERATIONAL, STOP, ENTER_PRE_OPERATIONAL)


def test_cct_transition_03_start(dut: Tester) -> None:
    _through(dut, START, STOP, START, START)


def test_cct_transition_04_stop(dut: Tester) -> None:
    _through(dut, STOP, START, STOP, STOP)


def _through(dut: Tester, *commands: int) -> None:
    states = {START: OPERATIONAL, STOP: STOPPED, ENTER_PRE_OPERATIONAL: PRE_OPERATIONAL}
    dut.heartbeats(5)
    for command in commands:
        dut.nmt(command)
        dut.reaches(states[command])


@pytest.mark.parametrize("command", [START, STOP, ENTER_PRE_OPERATIONAL])
def test_cct_transition_04_to_all_nodes_and_to_others(dut: Tester, command: int) -> None:
    dut.heartbeats(5)
    dut.nmt(command, node=6)
    dut.stays(PRE_OPERATIONAL)
    dut.nmt(command, node=0)
    dut.reaches({START: OPERATIONAL, STOP: STOPPED, ENTER_PRE_OPERATIONAL: PRE_OPERATIONAL}[command])
