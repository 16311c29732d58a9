"""The channel to one device: order, newest write, bounds, silence."""

from __future__ import annotations

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Access, Dictionary, Entry, variable
from gatewayd.canopen.frame import Frame, Priority
from gatewayd.canopen.manager.channel import CAPACITY, MAX_CODES, SdoChannel, SdoJob, reason_of
from gatewayd.canopen.sdo.client import SdoResult
from gatewayd.canopen.sdo.server import SdoServer


class Line:
    """A channel, and the server at its other end, which answers when it is told to."""

    def __init__(self) -> None:
        self.sent: list[Frame] = []
        self.results: list[SdoResult] = []
        self.entry = Entry(0, "Data", CanType.UNSIGNED16, Access.RW, b"\1\0")
        self.server = SdoServer(Dictionary([variable(0x2000, self.entry)]))
        self.channel = SdoChannel(5, self._send, 1.0)

    def _send(self, frame: Frame, priority: Priority) -> bool:
        assert priority is Priority.ORDERED
        self.sent.append(frame)
        return True

    def put(self, data: bytes | None = None, index: int = 0x2000) -> bool:
        return self.channel.put(SdoJob(index, 0, data, lambda result, _now: self.results.append(result)), 0.0)

    def answer(self) -> None:
        while self.sent:
            request = self.sent.pop(0)
            assert request.can_id == 0x605
            for data in self.server.receive(request.data, 0.0):
                self.channel.receive(Frame(0x585, data), 0.0)


def test_one_transfer_at_a_time_in_their_order() -> None:
    line = Line()
    for _ in range(3):
        line.put()
    assert len(line.sent) == 1
    assert len(line.channel) == 3
    line.answer()
    assert [result.data for result in line.results] == [b"\1\0"] * 3
    assert (len(line.channel), line.channel.counters.transfers) == (0, 3)


def test_round_trip_is_that_of_the_last_answer() -> None:
    line = Line()
    assert line.channel.round_trip is None
    line.put()
    for data in line.server.receive(line.sent.pop().data, 0.0):
        line.channel.receive(Frame(0x585, data), 0.25)
    assert line.channel.round_trip == 0.25


def test_newest_write_takes_the_turn_of_the_older_one() -> None:
    line = Line()
    line.put(b"\2\0")
    line.put(b"\3\0")
    line.put()
    line.put(b"\4\0")
    line.answer()
    assert [result.data for result in line.results] == [b"", b"", b"\4\0"]
    assert line.entry.value == b"\4\0"


def test_what_finds_no_room_is_refused_and_counted() -> None:
    line = Line()
    assert all(line.put() for _ in range(CAPACITY + 1))
    assert not line.put()
    assert line.channel.counters.overflow == 1


def test_silence_costs_one_transfer_and_the_next_is_tried() -> None:
    line = Line()
    line.put(index=0x2000)
    line.put(index=0x2000)
    line.sent.clear()
    line.channel.tick(line.channel.next_deadline())
    assert [reason_of(result) for result in line.results] == ["no answer"]
    assert line.channel.counters.timeouts == 1
    assert [frame.data[0] for frame in line.sent] == [0x80, 0x40]
    line.answer()
    assert reason_of(line.results[-1]) == ""


def test_abort_is_counted_and_kept_in_words() -> None:
    line = Line()
    line.put(index=0x3000)
    line.put(bytes(4))
    line.answer()
    assert line.channel.counters.aborts == 2
    assert line.channel.last_abort == "06070012h too long, write 2000h:00"
    assert reason_of(line.results[0]) == "06020000h no such object"


def test_codes_are_counted_apart_as_far_as_there_is_room() -> None:
    line = Line()
    for number in range(MAX_CODES + 10):
        line.put(index=0x2000)
        line.sent.clear()
        line.channel.receive(Frame(0x585, b"\x80\x00\x20\x00" + bytes((number, 0, 0, 6))), 0.0)
    codes = line.channel.counters.codes
    assert len(codes) == MAX_CODES + 1
    assert codes[0x0800_0000] == 10
    assert codes[0x0600_0000] == 1


def test_forgetting_calls_nobody() -> None:
    line = Line()
    line.put()
    line.put()
    line.channel.forget()
    assert line.sent[-1].data[0] == 0x80
    line.answer()
    assert (line.results, len(line.channel)) == ([], 0)
    line.put()
    line.answer()
    assert len(line.results) == 1


def test_gap_of_our_own_is_no_silence() -> None:
    line = Line()
    line.put()
    line.channel.spare(5.0)
    line.channel.tick(5.5)
    assert line.results == []
