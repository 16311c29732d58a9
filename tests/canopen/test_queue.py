"""The order in which frames leave, and what is dropped."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.frame import Frame, Priority
from gatewayd.canopen.queue import PATIENCE, TransmitQueue, Transmitter


def emptied(queue: TransmitQueue) -> list[Frame]:
    sent: list[Frame] = []

    def take(frame: Frame) -> bool:
        sent.append(frame)
        return True

    assert queue.drain(take)
    return sent


def test_newest_pdo_takes_the_place_of_the_one_that_waits() -> None:
    queue = TransmitQueue()
    for frame in (Frame(0x181, b"\1"), Frame(0x281, b"\2"), Frame(0x181, b"\3")):
        assert queue.put(frame, Priority.PDO)
    assert emptied(queue) == [Frame(0x181, b"\3"), Frame(0x281, b"\2")]
    assert queue.replaced == 1
    assert queue.overflow == 0


def test_ordered_frames_overtake_nothing_of_their_kind() -> None:
    """A boot-up message stays before the first EMCY, although it has the higher COB-ID."""
    queue = TransmitQueue()
    boot_up, emergency = Frame(0x701, b"\0"), Frame(0x81, bytes(8))
    queue.put(boot_up, Priority.ORDERED)
    queue.put(emergency, Priority.ORDERED)
    assert emptied(queue) == [boot_up, emergency]


def test_lower_cob_id_goes_first_between_the_kinds() -> None:
    queue = TransmitQueue()
    pdo, sdo, sync = Frame(0x181, b"\1"), Frame(0x581, bytes(8)), Frame(0x80)
    queue.put(sync, Priority.ORDERED)
    queue.put(sdo, Priority.ORDERED)
    queue.put(pdo, Priority.PDO)
    assert emptied(queue) == [sync, pdo, sdo]


def test_pdos_cannot_starve_a_heartbeat() -> None:
    queue = TransmitQueue()
    heartbeat = Frame(0x701, b"\5")
    queue.put(heartbeat, Priority.ORDERED)
    for can_id in range(0x181, 0x181 + 3 * PATIENCE):
        queue.put(Frame(can_id), Priority.PDO)
    assert emptied(queue).index(heartbeat) == PATIENCE


def test_patience_is_kept_over_several_drains() -> None:
    """A bus that takes one frame at a time, with a new PDO each time, still gets the heartbeat."""
    queue = TransmitQueue()
    heartbeat = Frame(0x701, b"\5")
    queue.put(heartbeat, Priority.ORDERED)
    taken: list[Frame] = []
    for _ in range(PATIENCE + 1):
        queue.put(Frame(0x181), Priority.PDO)
        queue.put(Frame(0x182), Priority.PDO)
        allowed = [True, False]

        def take(frame: Frame, allowed: list[bool] = allowed) -> bool:
            if allowed.pop(0):
                taken.append(frame)
                return True
            return False

        queue.drain(take)
    assert taken.index(heartbeat) == PATIENCE


def test_full_queue_drops_the_new_frame_and_counts_it() -> None:
    queue = TransmitQueue(ordered_capacity=2, pdo_capacity=1)
    assert [queue.put(Frame(0x581, bytes([n])), Priority.ORDERED) for n in range(3)] == [True, True, False]
    assert [queue.put(Frame(0x181 + n), Priority.PDO) for n in range(2)] == [True, False]
    assert queue.overflow == 2
    assert len(queue) == 3


def test_a_frame_that_is_not_taken_stays() -> None:
    queue = TransmitQueue()
    queue.put(Frame(0x581), Priority.ORDERED)
    assert not queue.drain(lambda _frame: False)
    assert emptied(queue) == [Frame(0x581)]


@given(st.lists(st.tuples(st.integers(0, 12), st.sampled_from(Priority), st.binary(max_size=2))))
def test_nothing_is_lost_but_replaced_pdos(puts: list[tuple[int, Priority, bytes]]) -> None:
    queue = TransmitQueue()
    newest: dict[int, Frame] = {}
    ordered: list[Frame] = []
    for low, priority, data in puts:
        frame = Frame(low + (0x180 if priority is Priority.PDO else 0x580), data)
        queue.put(frame, priority)
        if priority is Priority.PDO:
            newest[frame.can_id] = frame
        else:
            ordered.append(frame)
    sent = emptied(queue)
    assert [frame for frame in sent if frame.can_id >= 0x580] == ordered
    assert {frame.can_id: frame for frame in sent if frame.can_id < 0x580} == newest
    assert len(sent) + queue.replaced == len(puts)


class Wire:
    """A bus that takes as many frames as it has room for."""

    def __init__(self) -> None:
        self.room = 0
        self.frames: list[Frame] = []

    def offer(self, frame: Frame) -> bool:
        if not self.room:
            return False
        self.room -= 1
        self.frames.append(frame)
        return True


def test_transmitter_sends_at_once_where_the_bus_has_room() -> None:
    wire = Wire()
    transmitter = Transmitter(wire.offer)
    transmitter.open()
    wire.room = 1
    transmitter.send(Frame(0x181), Priority.PDO)
    assert wire.frames == [Frame(0x181)]
    assert not transmitter.queue


def test_transmitter_keeps_the_order_while_something_waits() -> None:
    wire = Wire()
    transmitter = Transmitter(wire.offer)
    transmitter.open()
    transmitter.send(Frame(0x701, b"\0"), Priority.ORDERED)
    wire.room = 9
    transmitter.send(Frame(0x701, b"\5"), Priority.ORDERED)
    assert wire.frames == []
    transmitter.flush()
    assert wire.frames == [Frame(0x701, b"\0"), Frame(0x701, b"\5")]


def test_transmitter_sends_nothing_old_after_the_bus_was_away() -> None:
    wire = Wire()
    transmitter = Transmitter(wire.offer)
    transmitter.open()
    transmitter.send(Frame(0x581, b"answer"), Priority.ORDERED)
    transmitter.close()
    transmitter.send(Frame(0x181, b"old"), Priority.PDO)
    wire.room = 9
    transmitter.open()
    transmitter.flush()
    assert wire.frames == []
    assert transmitter.discarded == 2


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

    transmitter = Transmitter(offer)
    transmitter.open()
    transmitter.send(Frame(0x281, b"old"), Priority.PDO)
    assert (len(transmitter.queue), transmitter.discarded) == (0, 1)
    fails = False
    transmitter.open()
    transmitter.send(Frame(0x701, b"\0"), Priority.ORDERED)
    assert sent == [Frame(0x701, b"\0")]
