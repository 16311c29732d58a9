"""The boot of a device: every letter, keep or reset, configuration, and devices that boot in the middle of it."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.canopen.manager.boot import RETRY, Boot
from gatewayd.canopen.manager.boot_steps import NEXT, BootSignal, BootStep
from gatewayd.canopen.manager.letters import BootError
from gatewayd.canopen.manager.node import NodeCondition
from gatewayd.canopen.manager.plan import ExpectedIdentity, ManagedPdo, PdoObject, Setting
from gatewayd.canopen.nmt import NmtCommand, NmtState
from tests.canopen.manager.bench import OUTPUT, POSITION, PRODUCT, REVISION, SERIAL, TPDO, VENDOR, Bench

RESET, START = (NmtCommand.RESET_COMMUNICATION, 5), (NmtCommand.START, 5)
RIGHT = ExpectedIdentity(0x20196, VENDOR, PRODUCT, REVISION, SERIAL)


def test_every_step_that_can_end_has_an_end_for_it() -> None:
    waited = {step for step, _ in NEXT}
    assert waited == {*Boot.ENTRIES, *Boot.WAITS} - {BootStep.READY}
    for step in waited - {BootStep.STATE, BootStep.RESET, BootStep.DATE}:
        assert {signal for at, signal in NEXT if at is step} >= {
            BootSignal.GOOD,
            BootSignal.DIFFERENT,
            BootSignal.REFUSED,
            BootSignal.SILENT,
        }


def test_device_is_identified_reset_configured_watched_and_started() -> None:
    bench = Bench()
    device = bench.device()
    node, diary = bench.attach(expected=RIGHT, settings=(Setting(0x2000, 0, b"\x34\x12"),))
    bench.up()
    bench.run(1.0)
    assert diary.events == ["started"]
    assert bench.commands() == [RESET, START]
    assert device.entries[0x2000, 0].value == b"\x34\x12"
    assert device.heartbeat.enabled
    assert device.nmt.state is NmtState.OPERATIONAL
    assert (node.condition, node.problem, node.boot.letter) == (NodeCondition.OPERATIONAL, "", None)
    assert node.identity == {0: 0x20196, 1: VENDOR, 2: PRODUCT, 3: REVISION, 4: SERIAL}


@pytest.mark.parametrize(
    "expected, letter, detail",
    [
        (ExpectedIdentity(device_type=1), "C", "1000h:00: is 00020196h instead of 00000001h"),
        (ExpectedIdentity(vendor=1), "D", "1018h:01: is 000001F0h instead of 00000001h"),
        (ExpectedIdentity(product=1), "M", "1018h:02: is 00000401h instead of 00000001h"),
        (ExpectedIdentity(revision=1), "N", "1018h:03: is 00010002h instead of 00000001h"),
        (ExpectedIdentity(serial=1), "O", "1018h:04: is 0000004Dh instead of 00000001h"),
    ],
)
def test_another_device_is_left_alone(expected: ExpectedIdentity, letter: str, detail: str) -> None:
    bench = Bench()
    bench.device()
    node, diary = bench.attach(expected=expected)
    bench.up()
    bench.run(1.0)
    assert diary.events == [f"{letter}: {detail}"]
    assert bench.commands() == []
    assert node.condition is NodeCondition.FAILED
    assert node.problem.startswith(f"{letter} another ")
    # Somebody may correct it without a word: it is looked at again.
    bench.run(RETRY)
    assert len(diary.events) == 2


def test_device_that_is_not_there_is_asked_until_it_is() -> None:
    """B; and its boot-up message, sent before anybody listened, is not waited for."""
    bench = Bench()
    node, diary = bench.attach(sdo_timeout=0.5)
    bench.up()
    bench.run(4.0)
    assert set(diary.events) == {"B: read 1000h:00: no answer"}
    assert node.condition is NodeCondition.ABSENT
    assert node.problem == "B no answer (read 1000h:00: no answer)"
    bench.device()
    bench.run(3.0)
    assert diary.events[-1] == "started"


def test_boot_up_message_cuts_the_waiting_short() -> None:
    bench = Bench()
    _, diary = bench.attach()
    bench.up()
    bench.run(1.2)
    assert len(diary.events) == 1
    bench.device()
    bench.run(0.3)
    assert diary.events[-1] == "started"
    # It has just booted: there is nothing to reset.
    assert bench.commands() == [START]


def test_software_version() -> None:
    bench = Bench()
    bench.device()
    node, diary = bench.attach(software="V1.24")
    bench.up()
    bench.run(1.0)
    assert node.boot.letter is BootError.SOFTWARE
    assert diary.events == ["H: 100Ah:00: is 'V1.23 beta' instead of 'V1.24'"]


def test_refused_setting_fails_the_configuration() -> None:
    bench = Bench()
    bench.device()
    _, diary = bench.attach(settings=(Setting(0x2000, 0, b"\1"),))
    bench.up()
    bench.run(1.0)
    assert diary.events == ["J: write 2000h:00: 06070013h too short"]


def test_pdo_that_is_taken_as_it_is_must_be_as_planned() -> None:
    bench = Bench()
    bench.device()
    _, diary = bench.attach(pdos=(ManagedPdo(1, True, 0x185, (POSITION, POSITION)),))
    bench.up()
    bench.run(1.0)
    assert diary.events == ["J: 1A00h:00: is 00000001h instead of 00000002h"]


def test_pdos_are_laid_out_in_the_order_that_devices_demand() -> None:
    bench = Bench()
    device = bench.device()
    pdo = ManagedPdo(1, True, 0x385, (OUTPUT, POSITION), written=True, transmission=1, inhibit=50, event=20)
    bench.attach(pdos=(pdo,), heartbeat=0.0)
    bench.up()
    bench.run(1.0)
    c, m = 0x1800, 0x1A00
    assert device.written == [(c, 1), (c, 2), (c, 3), (c, 5), (m, 0), (m, 1), (m, 2), (m, 0), (c, 1)]
    assert device.entries[c, 1].number == 0x385
    assert [device.entries[m, place].number for place in range(3)] == [2, OUTPUT.entry, POSITION.entry]


@pytest.mark.parametrize("stored", [True, False])
def test_configuration_of_the_same_date_is_skipped(stored: bool) -> None:
    bench = Bench()
    device = bench.device()
    device.stores = stored
    plan: dict[str, Any] = {
        "configured": (15000, 3600),
        "store": True,
        "settings": (Setting(0x2000, 0, b"\1\0"),),
        "pdos": (ManagedPdo(1, True, 0x285, (POSITION,), written=True),),
    }
    _, diary = bench.attach(**plan)
    bench.up()
    bench.run(1.0)
    assert diary.events == ["started"]
    assert (0x2000, 0) in device.written
    assert device.written[-4:] == [(0x1020, 1), (0x1020, 2), (0x1010, 1), (0x1017, 0)]
    del device.written[:]
    device.reboot()
    bench.run(1.0)
    assert diary.events == ["started", "ended: the device has booted", "started"]
    assert ((0x2000, 0) in device.written) is not stored


def test_configuration_of_the_same_date_with_another_pdo_is_written_again() -> None:
    bench = Bench()
    device = bench.device()
    bench.attach(configured=(15000, 3600), pdos=(ManagedPdo(1, True, 0x285, (POSITION,), written=True),))
    bench.up()
    bench.run(1.0)
    device.entries[0x1800, 1].value = b"\x85\x03\0\0"
    device.reboot()
    bench.run(1.0)
    assert device.entries[0x1800, 1].number == 0x285


def test_device_in_operation_is_kept_where_that_is_wanted() -> None:
    """L: neither reset nor configured nor started again."""
    bench = Bench()
    device = bench.device()
    device.nmt.command(NmtCommand.START, bench.now)
    node, diary = bench.attach(keep=True)
    bench.up()
    bench.run(1.0)
    assert diary.events == ["started"]
    assert bench.commands() == []
    assert node.boot.letter is BootError.OPERATIONAL
    assert (node.condition, node.problem) == (NodeCondition.OPERATIONAL, "")


def test_device_in_operation_is_reset_where_nothing_else_is_said() -> None:
    bench = Bench()
    device = bench.device()
    device.nmt.command(NmtCommand.START, bench.now)
    bench.attach()
    bench.up()
    bench.run(1.0)
    assert bench.commands() == [RESET, START]


@pytest.mark.parametrize("started, wrong", [(False, False), (True, True)])
def test_device_that_cannot_be_kept_is_reset(started: bool, wrong: bool) -> None:
    """It is not in operation, or its PDOs are not as planned."""
    bench = Bench()
    device = bench.device()
    if started:
        device.nmt.command(NmtCommand.START, bench.now)
    pdo = ManagedPdo(1, True, 0x285 if wrong else 0x185, (POSITION,), written=True)
    _, diary = bench.attach(keep=True, pdos=(pdo,))
    bench.up()
    bench.run(1.0)
    assert diary.events == ["started"]
    assert bench.commands() == [RESET, START]


def test_device_without_the_heartbeat_that_it_should_have() -> None:
    bench = Bench()
    device = bench.device()
    _, diary = bench.attach(producer=0)
    bench.up()
    bench.run(1.0)
    assert diary.events == ["K: no heartbeat within 0.3 s"]
    assert not device.heartbeat.enabled


def test_heartbeat_that_comes_before_its_time_is_confirmed_counts() -> None:
    bench = Bench()
    device = bench.device()
    node, _ = bench.attach(heartbeat=9.0, producer=3000)
    bench.up()
    bench.run(1.0, until=lambda: (0x1017, 0) in device.written)
    assert node.running


def test_device_that_does_not_come_back_from_its_reset() -> None:
    bench = Bench()
    device = bench.device()
    _, diary = bench.attach(boot_time=2.0)
    bench.up()
    device.dies_of_reset = True
    bench.run(2.1)
    assert diary.events == ["B: no boot-up message within 2 s of the reset of its communication"]


def test_device_that_boots_in_the_middle_of_its_boot_begins_again() -> None:
    bench = Bench()
    device = bench.device()
    node, diary = bench.attach(settings=tuple(Setting(0x2000, 0, bytes((n, 0))) for n in range(30)))
    bench.up()
    device.held = []
    while len(device.written) < 10:
        bench.run(0.1, until=lambda: device.held)
        bench.put(device.held.pop(0), device)
        bench.settle()
    device.held = None
    device.reboot()
    bench.run(1.0)
    assert diary.events == ["started"]
    assert device.entries[0x2000, 0].value == b"\x1d\0"
    assert (node.counters.boots, node.counters.boot_ups) == (1, 2)


def test_flood_of_boot_up_messages_is_answered_once() -> None:
    bench = Bench()
    device = bench.device()
    bench.attach()
    bench.up()
    bench.run(1.0)
    before = len(bench.sent)
    for _ in range(1000):
        device.say(0x705, b"\0")
    bench.settle()
    assert len(bench.sent) - before < 5


def test_contents_of_rpdos_are_what_the_device_holds() -> None:
    """Nothing that nobody has written is changed by the first RPDO."""
    bench = Bench()
    device = bench.device()
    two = PdoObject(0x2000, 0, 16)
    device.entries[0x2000, 0].value = b"\x11\x22"
    pdo = ManagedPdo(1, False, 0x205, (OUTPUT, two), written=True)
    node, _ = bench.attach(pdos=(TPDO, pdo))
    bench.up()
    bench.run(1.0)
    assert device.outputs == []
    node.write_pdo(1, 0, 9, bench.now)
    bench.run(0.01)
    assert device.outputs == [b"\x09\x11\x22"]
