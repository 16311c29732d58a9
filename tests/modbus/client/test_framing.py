from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client import pdus
from gatewayd.modbus.client.framing import MAX_NOISE, AnswerFrame, RtuFraming, TcpFraming
from gatewayd.modbus.client.requests import ModbusRequest, read, read_identification, write_register
from gatewayd.modbus.frames import FramingError, encode

READ = read(Area.HOLDING, 0, 2)
ANSWER = bytes.fromhex("030412345678")


def rtu(unit: int, pdu: bytes) -> bytes:
    frame = bytes((unit,)) + pdu
    return frame + pdus.crc(frame)


pieces = st.lists(st.integers(1, 40), max_size=60)


def cut(data: bytes, sizes: list[int]) -> list[bytes]:
    """The data in pieces of these sizes, and the rest."""
    found = []
    for size in sizes:
        found.append(data[:size])
        data = data[size:]
    return [*found, data]


@given(
    st.lists(st.tuples(st.integers(0, 65535), st.integers(0, 255), st.binary(min_size=1, max_size=253))),
    pieces,
)
def test_frames_come_out_however_they_come_in(frames: list[tuple[int, int, bytes]], sizes: list[int]) -> None:
    stream = b"".join(encode(*frame) for frame in frames)
    framing = TcpFraming()
    found = [answer for piece in cut(stream, sizes) for answer in framing.feed(piece)]
    assert found == [AnswerFrame(*frame) for frame in frames]
    assert not framing.is_within_frame


@given(st.lists(st.binary(max_size=400), max_size=20))
def test_hostile_tcp_is_bounded(chunks: list[bytes]) -> None:
    framing = TcpFraming()
    try:
        for chunk in chunks:
            for frame in framing.feed(chunk):
                assert 1 <= len(frame.pdu) <= 253
            assert len(framing._buffer) < 260
    except FramingError:
        pass


@pytest.mark.parametrize("header", ["000000010003", "000000000001", "00000000ffff"])
def test_what_is_no_modbus_tcp_is_noticed_at_once(header: str) -> None:
    with pytest.raises(FramingError):
        list(TcpFraming().feed(bytes.fromhex(header)))


def test_transactions_count_and_wrap() -> None:
    framing = TcpFraming(0xFFFE)
    assert [framing.request(1, b"\x03")[0] for _ in range(3)] == [0xFFFF, 0, 1]
    assert framing.request(7, b"\x03\x00")[1].hex() == "00020000000307" + "0300"


def test_rtu_request_of_the_specification() -> None:
    assert RtuFraming().request(2, ModbusRequest(b"\x07", 2, b"\x07")).hex() == "02074112"


@given(st.binary(max_size=200), pieces, st.sampled_from([ANSWER, b"\x83\x02"]))
def test_rtu_answer_comes_out_behind_noise(noise: bytes, sizes: list[int], answer: bytes) -> None:
    framing = RtuFraming()
    framing.request(9, READ)
    noise = noise.replace(b"\x09", b"\x0a")  # noise that is no beginning; the next test has the other kind
    found = [frame for piece in cut(noise + rtu(9, answer), sizes) if (frame := framing.feed(piece))]
    assert found == [AnswerFrame(0, 9, answer)]
    assert framing.noise == len(noise)


def test_rtu_answer_comes_out_behind_half_an_answer() -> None:
    framing = RtuFraming()
    framing.request(9, READ)
    assert framing.feed(rtu(9, ANSWER)[:5]) is None
    assert framing.feed(rtu(9, ANSWER)) == AnswerFrame(0, 9, ANSWER)


def test_rtu_answer_with_a_wrong_check_is_none() -> None:
    framing = RtuFraming()
    framing.request(9, READ)
    wrong = bytearray(rtu(9, ANSWER))
    wrong[4] ^= 1
    assert framing.feed(bytes(wrong)) is None
    assert framing.is_within_frame


def test_rtu_answer_of_another_unit_or_function_is_noise() -> None:
    framing = RtuFraming()
    framing.request(9, READ)
    assert framing.feed(rtu(8, ANSWER)) is None
    assert framing.feed(rtu(9, b"\x04" + ANSWER[1:])) is None
    assert framing.feed(rtu(9, ANSWER)) == AnswerFrame(0, 9, ANSWER)


def test_rtu_bytes_without_a_request_are_noise() -> None:
    framing = RtuFraming()
    assert framing.feed(rtu(9, ANSWER)) is None
    assert framing.noise == len(rtu(9, ANSWER))
    framing.request(9, write_register(1, b"\0\x05"))
    assert framing.feed(rtu(9, b"\x06\0\x01\0\x05")) == AnswerFrame(0, 9, b"\x06\0\x01\0\x05")


@given(st.binary(min_size=1, max_size=64), st.sampled_from([READ, read_identification()]))
def test_rtu_frame_that_never_ends_is_bounded(piece: bytes, request: ModbusRequest) -> None:
    framing = RtuFraming()
    framing.request(9, request)
    taken = 0
    try:
        while taken < 2 * MAX_NOISE:
            assert framing.feed(piece) is None
            assert len(framing._buffer) <= MAX_NOISE + 1
            taken += len(piece)
    except FramingError:
        assert taken > MAX_NOISE - 64
    else:
        raise AssertionError("it goes on for ever")


@pytest.mark.parametrize("size", [1, 3, 100])
def test_rtu_identification_says_its_own_length(size: int) -> None:
    pdu = bytes.fromhex("2b0e01010000" + "02" + "00026764" + "01036d6263")
    frame = rtu(9, pdu)
    framing = RtuFraming()
    framing.request(9, read_identification())
    found = [framing.feed(frame[start : start + size]) for start in range(0, len(frame), size)]
    assert [answer for answer in found if answer] == [AnswerFrame(0, 9, pdu)]
