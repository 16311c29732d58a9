from __future__ import annotations

import pytest

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client import pdus
from gatewayd.modbus.client.conversation import (
    MAX_LATE,
    MAX_UNASKED,
    Broken,
    RtuConversation,
    TcpConversation,
)
from gatewayd.modbus.client.polling import NEVER
from gatewayd.modbus.client.requests import BadAnswer, Failure, TimedOut, read, write_register
from gatewayd.modbus.client.station import Job, Station
from gatewayd.modbus.client.timing import RtuTiming
from gatewayd.modbus.client.unit import StationSettings
from gatewayd.modbus.frames import encode
from tests.modbus.client.world import Heard

READ = read(Area.HOLDING, 0, 1)
ANSWER = b"\x03\x02\x12\x34"
DATA = b"\x12\x34"


def nobody(job: Job, outcome: bytes | Failure, now: float) -> None:
    pass


def job(unit: int = 1, timeout: float = 0.3, station: Station | None = None) -> Job:
    return Job(unit, READ, timeout, 0.0, nobody, station)


def rtu(unit: int, pdu: bytes) -> bytes:
    frame = bytes((unit,)) + pdu
    return frame + pdus.crc(frame)


def test_answers_find_their_requests_in_any_order() -> None:
    tcp = TcpConversation(2)
    first, second = job(1), job(2)
    tcp.begin(first, 0)
    assert tcp.ready_at() == float("-inf")
    tcp.begin(second, 0)
    assert tcp.ready_at() == NEVER
    data = encode(2, 2, ANSWER) + encode(1, 1, b"\x83\x02")
    finished = tcp.received(data, 1)
    assert [(one.job, one.outcome == DATA) for one in finished] == [(second, True), (first, False)]
    assert tcp.jobs == []


def test_late_answer_is_dropped_and_counted() -> None:
    tcp = TcpConversation()
    station = Station(StationSettings(1), Heard())
    late, punctual = job(station=station), job()
    tcp.begin(late, 10)
    assert tcp.deadline() == 10.3
    assert tcp.expired(10.29) == []
    assert [(one.job, one.outcome) for one in tcp.expired(10.3)] == [(late, TimedOut(0.3))]
    tcp.begin(punctual, 10.3)
    assert tcp.received(encode(1, 1, b"\x03\x02\xde\xad"), 10.4) == []
    assert station.counters.late_answers == 1
    assert [one.outcome for one in tcp.received(encode(2, 1, ANSWER), 10.5)] == [DATA]
    assert tcp.received(encode(1, 1, ANSWER), 10.6) == []
    assert station.counters.late_answers == 1


def test_memory_of_late_answers_is_bounded() -> None:
    tcp = TcpConversation()
    for number in range(MAX_LATE + 50):
        tcp.begin(job(), number)
        tcp.expired(number + 1)
    assert len(tcp._late) == MAX_LATE


def test_answer_of_another_unit_is_bad() -> None:
    tcp = TcpConversation()
    tcp.begin(job(1), 0)
    (finished,) = tcp.received(encode(1, 2, ANSWER), 0)
    assert finished.outcome == BadAnswer("an answer of unit 2 instead of 1")


def test_bytes_that_are_no_modbus_break_the_connection_after_what_was_whole() -> None:
    tcp = TcpConversation(2)
    tcp.begin(job(1), 0)
    tcp.begin(job(2), 0)
    with pytest.raises(Broken, match="protocol id 65535") as broken:
        tcp.received(encode(1, 1, ANSWER) + b"\xff" * 8, 0)
    assert [one.outcome for one in broken.value.finished] == [DATA]
    assert len(tcp.jobs) == 1


def test_half_an_answer_at_the_time_out_breaks_the_connection() -> None:
    tcp = TcpConversation()
    tcp.begin(job(), 0)
    tcp.received(encode(1, 1, ANSWER)[:-1], 0.1)
    with pytest.raises(Broken, match="does not end") as broken:
        tcp.expired(0.3)
    assert broken.value.finished == []
    assert broken.value.culprit is tcp.jobs[0]


def test_answer_that_does_not_end_is_blamed_on_its_own_request() -> None:
    tcp = TcpConversation(3)
    for unit in (1, 2, 3):
        tcp.begin(job(unit), 0)
    tcp.received(encode(2, 2, ANSWER)[:-1], 0.1)
    with pytest.raises(Broken) as broken:
        tcp.expired(0.3)
    assert broken.value.culprit is tcp.jobs[1]
    assert len(tcp.jobs) == 3


def test_bytes_that_are_no_modbus_are_blamed_on_the_unit_they_name() -> None:
    tcp = TcpConversation(3)
    for unit in (1, 2, 3):
        tcp.begin(job(unit), 0)
    garbled = bytearray(encode(77, 3, ANSWER))
    garbled[2] = 1
    with pytest.raises(Broken) as broken:
        tcp.received(bytes(garbled), 0.1)
    assert broken.value.culprit is tcp.jobs[2]


def test_bad_answer_with_bytes_behind_it_breaks_the_connection() -> None:
    """An answer that was cut off, and the beginning of the next taken for its end."""
    tcp = TcpConversation(2)
    tcp.begin(job(1), 0)
    tcp.begin(job(2), 0)
    stream = encode(1, 1, ANSWER)[:-4] + encode(2, 2, ANSWER)
    with pytest.raises(Broken) as broken:
        tcp.received(stream, 0.1)
    (finished,) = broken.value.finished
    assert isinstance(finished.outcome, BadAnswer)
    assert broken.value.culprit is None


def test_answer_with_the_transaction_of_another_is_not_blamed_on_that() -> None:
    tcp = TcpConversation(2)
    first, second = job(1), job(2)
    tcp.begin(first, 0)
    tcp.begin(second, 0)
    assert tcp.received(encode(1, 2, ANSWER), 0.1) == []
    (finished,) = tcp.received(encode(1, 1, ANSWER), 0.1)
    assert (finished.job, finished.outcome) == (first, DATA)
    assert tcp.jobs == [second]


def test_rtu_answer_and_the_gap_after_it() -> None:
    line = RtuConversation(RtuTiming.of(19200))
    assert line.begin(job(), 5) == rtu(1, READ.pdu)
    assert line.ready_at() == NEVER
    (finished,) = line.received(rtu(1, ANSWER), 5.02)
    assert finished.outcome == DATA
    assert line.ready_at() == pytest.approx(5.02 + 3.5 * 11 / 19200)


def test_rtu_time_out_begins_when_the_request_is_out() -> None:
    line = RtuConversation(RtuTiming.of(1200, 11))
    line.begin(job(timeout=0.1), 0)
    assert line.deadline() == pytest.approx(0.1 + (8 + 7) * 11 / 1200)
    assert line.expired(0.15) == []
    (finished,) = line.expired(0.3)
    assert finished.outcome == TimedOut(0.1)


def test_rtu_noise_delays_the_next_request() -> None:
    line = RtuConversation(RtuTiming.of(19200))
    line.begin(job(), 0)
    line.expired(1)
    late = line.ready_at()
    assert line.received(b"\x01\x03", 1.5) == []
    assert line.ready_at() > late
    assert line.noise == 2


def test_rtu_with_half_an_answer_is_a_bad_answer() -> None:
    line = RtuConversation(RtuTiming.of(19200))
    line.begin(job(), 0)
    line.received(rtu(1, ANSWER)[:-2], 0.1)
    (finished,) = line.expired(1)
    assert finished.outcome == BadAnswer("no whole answer within 0.3 s")


def test_rtu_flood_ends_the_request() -> None:
    line = RtuConversation(RtuTiming.of(19200))
    line.begin(job(), 0)
    finished = [one for _ in range(10) for one in line.received(bytes(100), 0.1)]
    assert [type(one.outcome) for one in finished] == [BadAnswer]


def test_rtu_broadcast_has_its_turnaround_and_no_answer() -> None:
    line = RtuConversation(RtuTiming.of(19200, turnaround=0.2))
    broadcast = Job(0, write_register(1, DATA), 0.0, 0.0, nobody)
    line.begin(broadcast, 10)
    assert line.expired(10.19) == []
    (finished,) = line.expired(10.3)
    assert finished.outcome == b""
    assert line.ready_at() < 10.3


def test_connection_flooded_with_answers_that_nobody_asked_for_is_given_up() -> None:
    tcp = TcpConversation()
    tcp.begin(job(), 0)
    few = encode(9, 1, ANSWER) * MAX_UNASKED
    assert tcp.received(few, 0.1) == []
    (finished,) = tcp.received(encode(1, 1, ANSWER), 0.1)
    assert finished.outcome == DATA
    assert tcp.received(few, 0.2) == []
    with pytest.raises(Broken, match="nobody has asked for"):
        tcp.received(encode(9, 1, ANSWER), 0.2)
