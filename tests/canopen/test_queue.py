"""The order in which frames leave, and what is dropped."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.frame import Frame, Priority
from gatewayd.canopen.queue import (
    EVENT_CAPACITY,
    ORDERED_CAPACITY,
    PATIENCE,
    STUCK,
    TransmitQueue,
    Transmitter,
)

BOOT_UP, EMERGENCY = Frame(0x701, b"\0"), Frame(0x81, bytes(8))


def emptied(queue: TransmitQueue) -> list[Frame]:
    sent: list[Frame] = []

    def take(frame: Frame) -> bool:
        sent.append(frame)
        return True

    assert queue.drain(take)
    return sent


@pytest.mark.parametrize("can_id", [0x181, 0x701])
def test_newest_cyclic_frame_takes_the_place_of_the_one_that_waits(can_id: int) -> None:
    queue = TransmitQueue()
    for frame in (Frame(can_id, b"\1"), Frame(0x281, b"\2"), Frame(can_id, b"\3")):
        assert queue.put(frame, Priority.NEWEST)
    assert emptied(queue) == [Frame(can_id, b"\3"), Frame(0x281, b"\2")]
    assert queue.replaced == 1
    assert queue.overflow == 0


def test_events_overtake_nothing_of_their_kind() -> None:
    """A boot-up message stays before the first EMCY, although it has the higher COB-ID."""
    queue = TransmitQueue()
    queue.put(BOOT_UP, Priority.EVENT)
    queue.put(EMERGENCY, Priority.EVENT)
    assert emptied(queue) == [BOOT_UP, EMERGENCY]


def test_a_heartbeat_from_before_a_boot_up_never_follows_it() -> None:
    queue = TransmitQueue()
    queue.put(Frame(0x701, b"\5"), Priority.NEWEST)
    queue.put(BOOT_UP, Priority.EVENT)
    queue.put(Frame(0x701, b"\x7f"), Priority.NEWEST)
    assert emptied(queue) == [BOOT_UP, Frame(0x701, b"\x7f")]


def test_lower_cob_id_goes_first_between_the_kinds() -> None:
    queue = TransmitQueue()
    pdo, sdo = Frame(0x181, b"\1"), Frame(0x581, bytes(8))
    queue.put(sdo, Priority.ORDERED)
    queue.put(pdo, Priority.NEWEST)
    queue.put(EMERGENCY, Priority.EVENT)
    assert emptied(queue) == [EMERGENCY, pdo, sdo]


def test_pdos_cannot_starve_an_sdo_answer() -> None:
    queue = TransmitQueue()
    answer = Frame(0x581, bytes(8))
    queue.put(answer, Priority.ORDERED)
    for can_id in range(0x181, 0x181 + 3 * PATIENCE):
        queue.put(Frame(can_id), Priority.NEWEST)
    assert emptied(queue).index(answer) == PATIENCE


@pytest.mark.parametrize(
    "waiting", [(Frame(0x581), Priority.ORDERED), (Frame(0x701, b"\5"), Priority.NEWEST)]
)
def test_nothing_starves_on_a_bus_that_takes_less_than_there_are_pdos(
    waiting: tuple[Frame, Priority],
) -> None:
    """A bus that takes one frame at a time, with new PDOs each time, still gets answers and the heartbeat."""
    queue = TransmitQueue()
    queue.put(Frame(0x181), Priority.NEWEST)
    queue.put(*waiting)
    taken: list[Frame] = []
    for _ in range(2 * PATIENCE):
        queue.put(Frame(0x181), Priority.NEWEST)
        queue.put(Frame(0x182), Priority.NEWEST)
        allowed = [True, False]

        def take(frame: Frame, allowed: list[bool] = allowed) -> bool:
            if allowed.pop(0):
                taken.append(frame)
                return True
            return False

        queue.drain(take)
    assert taken.index(waiting[0]) <= PATIENCE


def test_a_heartbeat_that_waits_holds_up_no_pdo_behind_it() -> None:
    queue = TransmitQueue()
    queue.put(Frame(0x701, b"\5"), Priority.NEWEST)
    queue.put(Frame(0x181), Priority.NEWEST)
    for number in range(PATIENCE):
        queue.put(Frame(0x581, bytes([number])), Priority.ORDERED)
    assert emptied(queue).index(Frame(0x181)) <= 1


def test_full_queue_drops_the_new_frame_and_counts_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gatewayd.canopen.queue.ORDERED_CAPACITY", 2)
    monkeypatch.setattr("gatewayd.canopen.queue.NEWEST_CAPACITY", 1)
    queue = TransmitQueue()
    assert [queue.put(Frame(0x581, bytes([n])), Priority.ORDERED) for n in range(3)] == [True, True, False]
    assert [queue.put(Frame(0x181 + n), Priority.NEWEST) for n in range(2)] == [True, False]
    assert queue.overflow == 2
    assert len(queue) == 3


def test_emergencies_have_room_whatever_else_waits_and_the_last_ones_stay() -> None:
    queue = TransmitQueue()
    for _ in range(ORDERED_CAPACITY + 1):
        queue.put(Frame(0x581), Priority.ORDERED)
    for number in range(EVENT_CAPACITY + 1):
        assert queue.put(Frame(0x81, bytes([number])), Priority.EVENT)
    assert queue.overflow == 2
    numbers = [frame.data[0] for frame in emptied(queue) if frame.can_id == 0x81]
    assert numbers == list(range(1, EVENT_CAPACITY + 1))


def test_a_frame_that_is_not_taken_stays() -> None:
    queue = TransmitQueue()
    for frame, priority in (
        (Frame(0x581), Priority.ORDERED),
        (EMERGENCY, Priority.EVENT),
        (Frame(0x181), Priority.NEWEST),
    ):
        queue.put(frame, priority)
        assert not queue.drain(lambda _frame: False)
        assert emptied(queue) == [frame]


@given(
    st.lists(
        st.tuples(
            st.integers(0, 12),
            st.sampled_from([Priority.NEWEST, Priority.EVENT, Priority.ORDERED]),
            st.binary(max_size=2),
        )
    )
)
def test_nothing_is_lost_but_replaced_frames(puts: list[tuple[int, Priority, bytes]]) -> None:
    bases = {Priority.EVENT: 0x81, Priority.NEWEST: 0x180, Priority.ORDERED: 0x580}
    queue = TransmitQueue()
    newest: dict[int, Frame] = {}
    lines: dict[Priority, list[Frame]] = {Priority.EVENT: [], Priority.ORDERED: []}
    for low, priority, data in puts:
        frame = Frame(low + bases[priority], data)
        queue.put(frame, priority)
        if priority is Priority.NEWEST:
            newest[frame.can_id] = frame
        else:
            lines[priority].append(frame)
    room = lines[Priority.EVENT][-EVENT_CAPACITY:]
    sent = emptied(queue)
    assert [frame for frame in sent if frame.can_id >= 0x580] == lines[Priority.ORDERED]
    assert [frame for frame in sent if frame.can_id < 0x100] == room
    assert {frame.can_id: frame for frame in sent if 0x100 < frame.can_id < 0x580} == newest
    assert len(sent) + queue.replaced + queue.overflow == len(puts)


class Wire:
    """A bus that takes as many frames as it has room for, at a time that can be set."""

    def __init__(self) -> None:
        self.now = 0.0
        self.room = 0
        self.frames: list[Frame] = []
        self.present: dict[int, Frame] = {}
        """What would be sent now."""
        self.overdue = False
        self.transmitter = Transmitter(
            self.offer, self.present.get, now=lambda: self.now, overdue=lambda: self.overdue
        )
        self.transmitter.open()

    def offer(self, frame: Frame) -> bool:
        if not self.room:
            return False
        self.room -= 1
        self.frames.append(frame)
        return True

    def send(self, frame: Frame, priority: Priority) -> bool:
        return self.transmitter.send(frame, priority)

    def recover(self, room: int = 999) -> list[Frame]:
        self.room = room
        self.transmitter.flush()
        return self.frames


@pytest.fixture
def wire() -> Wire:
    return Wire()


def test_transmitter_sends_at_once_where_the_bus_has_room(wire: Wire) -> None:
    wire.room = 1
    assert wire.send(Frame(0x181), Priority.NEWEST)
    assert wire.frames == [Frame(0x181)]
    assert not wire.transmitter.queue


def test_transmitter_keeps_the_order_while_something_waits(wire: Wire) -> None:
    wire.send(Frame(0x581, b"\0"), Priority.ORDERED)
    wire.room = 9
    wire.send(Frame(0x581, b"\5"), Priority.ORDERED)
    assert wire.frames == []
    assert wire.recover() == [Frame(0x581, b"\0"), Frame(0x581, b"\5")]


def test_transmitter_sends_nothing_old_after_the_bus_was_away(wire: Wire) -> None:
    assert wire.send(Frame(0x581, b"answer"), Priority.ORDERED)
    wire.transmitter.close()
    assert not wire.send(Frame(0x181, b"old"), Priority.NEWEST)
    wire.transmitter.open()
    assert wire.recover() == []
    assert wire.transmitter.discarded == 2


def test_a_sync_goes_out_at_once_or_never(wire: Wire) -> None:
    sync = Frame(0x80)
    assert not wire.send(sync, Priority.AT_ONCE)
    assert wire.recover() == []
    wire.room = 1
    wire.send(Frame(0x181), Priority.NEWEST)
    assert not wire.send(sync, Priority.AT_ONCE)
    wire.send(Frame(0x181), Priority.NEWEST)
    wire.room = 1
    assert wire.send(sync, Priority.AT_ONCE), "it passes what waits, as it would on the bus"
    assert wire.frames == [Frame(0x181), sync]


def test_a_stuck_bus_that_recovers_gets_what_is_true_then(wire: Wire) -> None:
    """Five seconds of a master's life: 500 SYNCs, 50 heartbeats, PDOs, and an EMCY that reports it."""
    for cycle in range(500):
        wire.now += 0.01
        wire.send(Frame(0x80), Priority.AT_ONCE)
        wire.send(Frame(0x181, bytes([cycle % 256])), Priority.NEWEST)
        if cycle % 10 == 0:
            wire.send(Frame(0x701, b"\5"), Priority.NEWEST)
    wire.send(EMERGENCY, Priority.EVENT)
    wire.send(Frame(0x281, b"synchronous"), Priority.NEWEST)
    wire.present |= {0x181: Frame(0x181, b"now"), 0x701: Frame(0x701, b"\x7f")}
    assert wire.recover() == [EMERGENCY, Frame(0x181, b"now"), Frame(0x701, b"\x7f")]


def test_what_waits_for_a_busy_bus_is_not_old(wire: Wire) -> None:
    """A slow bus that takes a frame now and then: a synchronous PDO waits for its turn."""
    for can_id in range(0x181, 0x191):
        wire.send(Frame(can_id, b"of this cycle"), Priority.NEWEST)
    for _ in range(0x10):
        wire.now += STUCK * 0.9
        wire.recover(room=1)
    assert wire.frames == [Frame(can_id, b"of this cycle") for can_id in range(0x181, 0x191)]
    wire.send(Frame(0x181, b"next"), Priority.NEWEST)
    wire.now += STUCK * 1.1
    assert Frame(0x181, b"next") not in wire.recover()


def test_a_bus_that_gets_stuck_again_gets_nothing_old_either(wire: Wire) -> None:
    for can_id in (0x181, 0x182):
        wire.send(Frame(can_id, b"old"), Priority.NEWEST)
    wire.present |= {can_id: Frame(can_id, b"first") for can_id in (0x181, 0x182)}
    wire.now = 1.0
    wire.recover(room=1)
    wire.present |= {can_id: Frame(can_id, b"second") for can_id in (0x181, 0x182)}
    wire.now = 2.0
    assert wire.recover() == [Frame(0x181, b"first"), Frame(0x182, b"second")]


def test_what_waits_is_made_anew_when_the_process_stood_still(wire: Wire) -> None:
    wire.send(Frame(0x181, b"old"), Priority.NEWEST)
    wire.send(Frame(0x581, b"answer"), Priority.ORDERED)
    wire.transmitter.renew()
    assert wire.recover() == [Frame(0x581, b"answer")]


def test_what_was_made_before_the_process_stood_still_is_made_anew_too(wire: Wire) -> None:
    """It stood still between the value of a PDO and the PDO."""
    wire.room, wire.overdue = 999, True
    assert wire.send(Frame(0x181, b"old"), Priority.NEWEST)
    assert not wire.send(Frame(0x80), Priority.AT_ONCE)
    assert wire.send(EMERGENCY, Priority.EVENT)
    wire.overdue = False
    wire.present[0x181] = Frame(0x181, b"now")
    wire.transmitter.renew()
    assert wire.recover() == [EMERGENCY, Frame(0x181, b"now")]


def test_a_frame_that_the_bus_failed_at_does_not_stop_those_after_it() -> None:
    """An adapter that is unplugged while it is given a frame: plugged in again, the node must be heard at once."""
    sent: list[Frame] = []
    fails = True

    def offer(frame: Frame) -> bool:
        if fails:
            transmitter.close()
            return False
        sent.append(frame)
        return True

    transmitter = Transmitter(offer, lambda _can_id: None, now=lambda: 0.0)
    transmitter.open()
    transmitter.send(Frame(0x281, b"old"), Priority.NEWEST)
    assert (len(transmitter.queue), transmitter.discarded) == (0, 1)
    fails = False
    transmitter.open()
    transmitter.send(BOOT_UP, Priority.EVENT)
    assert sent == [BOOT_UP]
