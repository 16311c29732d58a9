"""A device in operation: PDOs, polls, losses, EMCY, and what hostile frames do to it."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.manager.boot_steps import BootStep
from gatewayd.canopen.manager.node import ManagedNode, NodeCondition
from gatewayd.canopen.manager.plan import ManagedPdo, ObjectReading
from gatewayd.canopen.nmt import NmtCommand
from gatewayd.canopen.sdo import protocol
from tests.canopen.manager.bench import OUTPUT, TPDO, Bench, Device, Diary


def operating(bench: Bench, **changes: object) -> tuple[Device, ManagedNode, Diary]:
    """A device that has been started, with an empty diary."""
    device = bench.device()
    node, diary = bench.attach(**changes)
    bench.up()
    bench.run(1.0, until=lambda: node.running)
    bench.run(0.05)
    assert diary.events == ["started"]
    diary.events.clear()
    return device, node, diary


def test_tpdo_is_values_and_counted() -> None:
    bench = Bench()
    device, node, diary = operating(bench)
    device.say(0x185, b"\xfe\xff\xff\xff")
    device.say(0x185, b"\1\0\0\0\xff\xff")
    device.say(0x185, b"\1\0\0")
    bench.settle()
    assert diary.values == [-2, 1]
    before = diary.seen
    bench.run(1.0)
    assert 9 <= diary.seen - before <= 11
    assert (node.counters.pdos_received, node.counters.pdos_short) == (2, 1)


def test_tpdo_before_the_start_counts_for_nothing() -> None:
    bench = Bench()
    device = bench.device()
    node, diary = bench.attach()
    bench.up()
    device.say(0x185, b"\1\0\0\0")
    bench.settle()
    assert (diary.values, node.counters.pdos_received) == ([], 0)


def test_rpdo_goes_out_on_change_not_faster_than_allowed_and_again_after_a_while() -> None:
    bench = Bench()
    pdo = ManagedPdo(1, False, 0x205, (OUTPUT,), spacing=0.02, repeat=0.1)
    device, node, _ = operating(bench, pdos=(pdo,))
    start = bench.now
    device.outputs.clear()
    for value in range(40):
        node.write_pdo(0, 0, value, bench.now)
        bench.run(0.001)
    assert [data[0] for data in device.outputs] == [0, 20]
    bench.run(0.15)
    assert [data[0] for data in device.outputs] == [0, 20, 39, 39]
    assert node.counters.pdos_sent >= 4
    assert start < bench.now


def test_nothing_is_sent_to_a_device_that_is_not_in_operation() -> None:
    bench = Bench()
    device, node, _ = operating(bench)
    device.silent = True
    bench.run(1.0)
    sent = len(bench.sent)
    node.write_pdo(1, 0, 9, bench.now)
    node.write_object(0x2000, 0, b"\1\0", bench.now)
    node.flush(bench.now)
    assert len(bench.sent) == sent


def test_reading_once_and_in_intervals() -> None:
    bench = Bench()
    readings = (
        ObjectReading(0x6004, 0, CanType.INTEGER32),
        ObjectReading(0x2000, 0, CanType.UNSIGNED16, 0.1),
        ObjectReading(0x3000, 0, CanType.UNSIGNED16, 0.5),
        ObjectReading(0x100A, 0, CanType.UNSIGNED32, 10.0),
    )
    bench.device()
    _, diary = bench.attach(readings=readings)
    bench.up()
    bench.run(1.0, until=lambda: "started" in diary.events)
    bench.run(0.95)
    assert diary.read == [7, *[0] * 10]
    assert diary.events == [
        "started",
        "unread 3000:0: 06020000h no such object",
        "unread 100A:0: length 10, where UNSIGNED32 has 4",
        "unread 3000:0: 06020000h no such object",
    ]


def test_reading_that_a_pdo_has_overtaken_is_dropped() -> None:
    bench = Bench()
    device, _, diary = operating(bench, readings=(ObjectReading(0x6004, 0, CanType.INTEGER32, 0.1),))
    device.held = []
    bench.run(0.2, until=lambda: device.held)
    diary.read.clear()
    device.say(0x185, b"\x09\0\0\0")
    device.answer()
    bench.settle()
    assert (diary.values, diary.read) == ([9], [])
    bench.run(0.15)
    assert diary.read == [7]


def test_writing_an_object_by_sdo_newest_wins() -> None:
    bench = Bench()
    device, node, diary = operating(bench)
    del device.written[:]
    for number in range(50):
        node.write_object(0x2000, 0, bytes((number, 0)), bench.now)
    bench.run(0.05)
    assert device.entries[0x2000, 0].value == b"\x31\0"
    assert device.written == [(0x2000, 0)] * 2
    node.write_object(0x1000, 0, bytes(4), bench.now)
    bench.run(0.05)
    assert diary.events == ["unwritten 1000:0: 06010002h read only"]
    assert node.channel.last_abort == "06010002h read only, write 1000h:00"


def test_lost_heartbeat_and_return() -> None:
    bench = Bench()
    device, node, diary = operating(bench)
    device.silent = True
    bench.run(0.35)
    assert diary.events == ["ended: heartbeat lost", "E: silent for 0.3 s"]
    assert (node.condition, node.counters.heartbeat_misses) == (NodeCondition.ABSENT, 1)
    assert node.problem == "E heartbeat lost (silent for 0.3 s)"
    assert node.nmt is None
    device.silent = False
    bench.run(3.0)
    assert diary.events[-1] == "started"
    assert node.counters.boots == 2


def test_heartbeat_is_not_missed_over_a_gap_of_our_own() -> None:
    bench = Bench()
    _, _, diary = operating(bench)
    bench.manager.gap(bench.now, bench.now + 5.0)
    bench.now += 5.0
    bench.run(1.0)
    assert diary.events == []


def test_device_without_heartbeat_is_asked_and_lost_when_it_does_not_answer() -> None:
    bench = Bench()
    device, _, diary = operating(bench, heartbeat=0.0, producer=0, alive=0.5)
    bench.run(2.0)
    assert diary.events == []
    assert diary.seen == 4
    device.silent = True
    bench.run(1.6)
    assert diary.events == ["ended: no answer", "B: read 1000h:00: no answer"]


def test_device_that_reboots_is_booted_again() -> None:
    bench = Bench()
    device, node, diary = operating(bench)
    device.reboot()
    bench.run(0.5)
    assert diary.events == ["ended: the device has booted", "started"]
    assert (node.counters.boots, node.counters.boot_ups) == (2, 2)


def test_device_that_leaves_operation_by_itself_is_booted_again() -> None:
    bench = Bench()
    device, _, diary = operating(bench)
    device.nmt.command(NmtCommand.ENTER_PRE_OPERATIONAL, bench.now)
    bench.run(2.0)
    assert diary.events == ["ended: has left operation by itself", "started"]


def test_emergencies_in_words_and_counted() -> None:
    bench = Bench()
    device, node, diary = operating(bench)
    device.say(0x85, bytes.fromhex("1042090102030405"))
    device.say(0x85, b"\0" * 7)
    device.say(0x85, bytes(8))
    bench.settle()
    assert [str(message) for message in diary.emergencies] == [
        "4210h device temperature too high, error register 09h (temperature), manufacturer 01 02 03 04 05",
        "0000h no error",
    ]
    assert node.counters.emergencies == 2


def test_full_queue_is_reported() -> None:
    bench = Bench()
    device, node, diary = operating(bench)
    device.silent = True
    for number in range(400):
        node.write_object(0x2000 + number, 0, b"\1\0", bench.now)
    assert node.channel.counters.overflow == 143
    assert len(diary.events) == 143
    assert diary.events[0].endswith("too much waits for the device already")


def test_what_waits_is_forgotten_when_the_device_is_lost() -> None:
    bench = Bench()
    device, node, _ = operating(bench)
    device.silent = True
    node.write_object(0x2000, 0, b"\7\0", bench.now)
    node.write_object(0x2000, 0, b"\7\0", bench.now)
    bench.run(0.4)
    assert len(node.channel) == 0
    assert node.boot.step is BootStep.FAILED


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.sampled_from([0x705, 0x85, 0x585, 0x185]), st.binary(max_size=8)), max_size=40))
def test_hostile_frames_leave_a_device_that_comes_up_again(frames: list[tuple[int, bytes]]) -> None:
    bench = Bench()
    device, node, _ = operating(bench)
    for can_id, data in frames:
        device.say(can_id, data)
        bench.run(0.002)
    bench.run(8.0, until=lambda: node.running)
    bench.run(1.0)
    assert node.running


@pytest.mark.parametrize("remote", [0x705, 0x85, 0x585, 0x185])
def test_remote_frames_mean_nothing(remote: int) -> None:
    bench = Bench()
    _, node, diary = operating(bench)
    bench.manager.receive(Frame(remote, b"", remote=True, length=8), bench.now)
    assert node.running
    assert (diary.values, diary.emergencies) == ([], [])


def test_late_answers_of_a_former_life_are_ignored() -> None:
    bench = Bench()
    device, node, _ = operating(bench)
    device.say(0x585, protocol.abort(b"\x00\x10\x00", AbortCode.GENERAL))
    bench.settle()
    assert node.channel.counters.aborts == 0


def test_pdo_of_too_many_bits_is_refused() -> None:
    bench = Bench()
    with pytest.raises(ValueError, match="72 bits do not fit"):
        bench.attach(pdos=(ManagedPdo(1, True, 0x185, (OUTPUT,) * 9),))
    assert TPDO.label == "TPDO 1"
