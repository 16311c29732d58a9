"""The SDO server frame by frame: the SDO and OD cases of the CANopen Conformance Test, and what else may come."""

from __future__ import annotations

import math
import struct
from binascii import crc_hqx

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, AbortCode, Access, Dictionary, Entry, Pending, variable
from gatewayd.canopen.sdo.server import (
    LONGEST_DOWNLOAD,
    SLOWEST_FRAME,
    SUB_BLOCK_TIMEOUT,
    TIMEOUT,
    WRITE_TIMEOUT,
    SdoServer,
    SdoState,
    server_parameter,
)

ABORT = b"\x80\x05\x20\x00" + struct.pack("<I", AbortCode.GENERAL)
"""The client's abort of a transfer of 2005h."""


def ask(server: SdoServer, text: str, now: float = 0.0) -> str:
    """One frame in, all frames out; hexadecimal, padded with zeros."""
    return " ".join(frame.hex() for frame in server.receive(bytes.fromhex(text).ljust(8, b"\0"), now))


def abort(multiplexer: str, code: AbortCode) -> str:
    return (b"\x80" + bytes.fromhex(multiplexer) + struct.pack("<I", code)).hex()


def segments(data: bytes, first: int = 0, count: int = 127) -> list[bytes]:
    """A sub-block that begins with segment `first` of `data`."""
    total = max(1, -(-len(data) // 7))
    return [
        bytes((number | (0x80 if first + number == total else 0),))
        + data[7 * (first + number - 1) :][:7].ljust(7, b"\0")
        for number in range(1, min(count, total - first) + 1)
    ]


def block_end(data: bytes) -> bytes:
    unused = max(1, -(-len(data) // 7)) * 7 - len(data)
    return struct.pack("<BH5x", 0xC1 | unused << 2, crc_hqx(data, 0))


# -- expedited --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "request_, answer",
    [
        ("40 00 20 03", "4b00200300000000"),
        ("40 01 20 02", "4f01200202000000"),
        ("40 06 20 00", "4306200001020304"),
        ("40 00 20 00", "4f00200003000000"),
    ],
)
def test_expedited_upload(server: SdoServer, request_: str, answer: str) -> None:
    assert ask(server, request_) == answer


def test_expedited_download(server: SdoServer, dictionary: Dictionary) -> None:
    assert ask(server, "2b 00 20 01 64 00") == "6000200100000000"
    assert dictionary.read(0x2000, 1) == b"\x64\x00"


def test_expedited_download_without_a_size_takes_that_of_the_object(
    server: SdoServer, dictionary: Dictionary
) -> None:
    assert ask(server, "22 00 20 01 64 00 ff ff") == "6000200100000000"
    assert dictionary.read(0x2000, 1) == b"\x64\x00"
    assert ask(server, "22 02 20 00 64 00 ff ff") == abort("022000", AbortCode.TOO_SHORT)
    assert ask(server, "22 04 20 00 64 00 ff ff") == "6004200000000000"
    assert dictionary.read(0x2004, 0) == b"\x64\x00\xff\xff"


@pytest.mark.parametrize(
    "request_, multiplexer, code",
    [
        pytest.param("23 00 10 00 91 01", "001000", AbortCode.READ_ONLY, id="SDO 03: write to 1000h"),
        pytest.param("40 00 20 02", "002002", AbortCode.WRITE_ONLY, id="SDO 04: read of wo"),
        pytest.param("40 00 20 04", "002004", AbortCode.NO_SUBINDEX, id="SDO 05: no sub-index, read"),
        pytest.param("2f 01 20 09 01", "012009", AbortCode.NO_SUBINDEX, id="SDO 05: no sub-index, write"),
        pytest.param("40 ff 5f 00", "ff5f00", AbortCode.NO_OBJECT, id="SDO 06: no object, read"),
        pytest.param("23 ff 5f 00", "ff5f00", AbortCode.NO_OBJECT, id="SDO 06: no object, write"),
        pytest.param("e0 00 10 00", "001000", AbortCode.UNKNOWN_COMMAND, id="SDO 07: no such command"),
        pytest.param("00 01 02 03", "000000", AbortCode.UNKNOWN_COMMAND, id="SDO 07: segment of nothing"),
        pytest.param("60 00 00 00", "000000", AbortCode.UNKNOWN_COMMAND, id="SDO 07: request of a segment"),
        pytest.param("c1 00 00 00", "000000", AbortCode.UNKNOWN_COMMAND, id="SDO 07: end of no download"),
        pytest.param("a1 00 00 00", "000000", AbortCode.UNKNOWN_COMMAND, id="SDO 07: end of no upload"),
        pytest.param("a3 00 00 00", "000000", AbortCode.UNKNOWN_COMMAND, id="SDO 07: start of no upload"),
        pytest.param("a2 01 7f 00", "000000", AbortCode.UNKNOWN_COMMAND, id="SDO 07: acknowledgement"),
        pytest.param("23 00 20 01 64", "002001", AbortCode.TOO_LONG, id="SDO 08: u32 into u16"),
        pytest.param("2f 00 20 02 64", "002002", AbortCode.TOO_SHORT, id="SDO 09: u8 into u32"),
        pytest.param("2b 00 20 01 e9 03", "002001", AbortCode.VALUE_TOO_HIGH, id="SDO 10: above the limit"),
        pytest.param("2b 00 20 01 09 00", "002001", AbortCode.VALUE_TOO_LOW, id="SDO 11: below the limit"),
        pytest.param("2b 00 20 03 fa ff", "002003", AbortCode.VALUE_TOO_LOW, id="SDO 11: negative limit"),
        pytest.param("2f 03 20 00 55", "032000", AbortCode.VALUE_TOO_HIGH, id="SDO 10: BOOLEAN of 55h"),
        pytest.param("21 00 10 00 04", "001000", AbortCode.READ_ONLY, id="SDO 03: segmented"),
        pytest.param("c2 00 10 00 04", "001000", AbortCode.READ_ONLY, id="SDO 03: block"),
        pytest.param("21 ff 5f 00 04", "ff5f00", AbortCode.NO_OBJECT, id="SDO 06: segmented"),
        pytest.param("a0 00 20 02 7f", "002002", AbortCode.WRITE_ONLY, id="SDO 04: block"),
    ],
)
def test_refused_request(server: SdoServer, request_: str, multiplexer: str, code: AbortCode) -> None:
    before = {(item.index, e.subindex): e.value for item in server._dictionary for e in item.entries}
    assert ask(server, request_) == abort(multiplexer, code)
    assert {(item.index, e.subindex): e.value for item in server._dictionary for e in item.entries} == before
    assert server.state is SdoState.IDLE


@pytest.mark.parametrize("length", [0, 1, 4, 7])
def test_frames_of_another_length_are_ignored(server: SdoServer, length: int) -> None:
    """Testing other, and SDO 12: only frames of 8 bytes are SDO."""
    assert server.receive(bytes.fromhex("4000100000000000")[:length], 0.0) == []
    ask(server, "21 05 20 00 0a")
    assert server.receive(b"\0abcdef"[:length], 5.0) == []
    assert server.next_deadline(0.0) == TIMEOUT


# -- segmented --------------------------------------------------------------------------------------------------------


def test_sdo_13_segmented_download(server: SdoServer, dictionary: Dictionary) -> None:
    assert ask(server, "21 05 20 00 0a") == "6005200000000000"
    assert ask(server, "00" + b"abcdefg".hex()) == "2000000000000000"
    assert dictionary.read(0x2005, 0) == b""
    assert ask(server, "19" + b"hij".hex()) == "3000000000000000"
    assert dictionary.read(0x2005, 0) == b"abcdefghij"
    assert server.state is SdoState.IDLE


def test_sdo_14_segmented_upload(server: SdoServer) -> None:
    assert ask(server, "40 08 10 00") == "4108100008000000"
    assert ask(server, "60") == "00" + b"gateway".hex()
    assert ask(server, "70") == "1d" + b"d".hex() + "000000000000"
    assert server.state is SdoState.IDLE


@pytest.mark.parametrize("toggles", ["10", "00 00", "00 10 10"])
def test_sdo_15_download_toggle_error(server: SdoServer, dictionary: Dictionary, toggles: str) -> None:
    ask(server, "20 05 20 00")
    answers = [ask(server, toggle + " 61") for toggle in toggles.split()]
    assert answers[-1] == abort("052000", AbortCode.TOGGLE)
    assert ask(server, "11 61") == abort("000000", AbortCode.UNKNOWN_COMMAND)
    assert dictionary.read(0x2005, 0) == b""


@pytest.mark.parametrize("toggles", ["70", "60 60"])
def test_sdo_16_upload_toggle_error(server: SdoServer, toggles: str) -> None:
    ask(server, "40 08 10 00")
    answers = [ask(server, toggle) for toggle in toggles.split()]
    assert answers[-1] == abort("081000", AbortCode.TOGGLE)
    assert ask(server, "70") == abort("000000", AbortCode.UNKNOWN_COMMAND)


def test_sdo_17_segmented_download_of_a_wrong_length(server: SdoServer, dictionary: Dictionary) -> None:
    ask(server, "21 05 20 00 08")
    ask(server, "00" + b"abcdefg".hex())
    assert ask(server, "19" + b"hij".hex()) == abort("052000", AbortCode.TOO_LONG)
    ask(server, "21 05 20 00 08")
    assert ask(server, "01" + b"abcdefg".hex()) == abort("052000", AbortCode.TOO_SHORT)
    ask(server, "20 02 20 00")
    assert ask(server, "01" + b"abcdefg".hex()) == abort("022000", AbortCode.TOO_SHORT)
    assert dictionary.read(0x2005, 0) == b""


def test_sdo_18_value_out_of_range_segmented(server: SdoServer, dictionary: Dictionary) -> None:
    """The value is checked before the last segment is confirmed."""
    ask(server, "21 00 20 01 02")
    assert ask(server, "0b ff ff") == abort("002001", AbortCode.VALUE_TOO_HIGH)
    assert dictionary.read(0x2000, 1) == b"\0\0"


def test_upload_takes_the_value_when_it_begins() -> None:
    entry = Entry(0, "Text", CanType.VISIBLE_STRING, Access.RW, b"first value")
    server = SdoServer(Dictionary([variable(0x2004, entry)]))
    ask(server, "40 04 20 00")
    entry.value = b"other"
    assert ask(server, "60") + ask(server, "70") == "00" + b"first v".hex() + "17" + b"alue".hex() + "000000"


def test_upload_of_nothing(server: SdoServer) -> None:
    assert ask(server, "40 05 20 00") == "4105200000000000"
    assert ask(server, "60") == "0f00000000000000"
    assert server.state is SdoState.IDLE


# -- block download ---------------------------------------------------------------------------------------------------


def test_sdo_19_block_download(server: SdoServer, dictionary: Dictionary) -> None:
    data = bytes(range(100)) * 10
    assert ask(server, "c6 05 20 00 e8 03") == "a40520007f000000"
    frames = segments(data)
    assert [answer for frame in frames for answer in server.receive(frame, 0.0)] == [
        bytes((0xA2, 127, 127)) + bytes(5)
    ]
    frames = segments(data, 127)
    assert [answer for frame in frames for answer in server.receive(frame, 0.0)] == [
        bytes((0xA2, 16, 127)) + bytes(5)
    ]
    assert dictionary.read(0x2005, 0) == b""
    assert server.receive(block_end(data), 0.0) == [b"\xa1" + bytes(7)]
    assert dictionary.read(0x2005, 0) == data


def test_sdo_20_block_download_of_a_wrong_crc(server: SdoServer, dictionary: Dictionary) -> None:
    ask(server, "c4 05 20 00")
    ask(server, "81" + b"abcdefg".hex())
    assert ask(server, "c1 12 34") == abort("052000", AbortCode.CRC)
    assert dictionary.read(0x2005, 0) == b""


def test_block_download_without_a_crc(server: SdoServer, dictionary: Dictionary) -> None:
    """The server claims no CRC either: there are clients that go by its word alone."""
    assert ask(server, "c0 05 20 00") == "a00520007f000000"
    ask(server, "81" + b"abcdefg".hex())
    assert ask(server, "c9 12 34") == "a100000000000000"
    assert dictionary.read(0x2005, 0) == b"abcde"


@pytest.mark.parametrize("size, code", [("08", AbortCode.TOO_SHORT), ("06", AbortCode.TOO_LONG)])
def test_sdo_21_block_download_of_a_wrong_length(server: SdoServer, size: str, code: AbortCode) -> None:
    ask(server, f"c2 05 20 00 {size}")
    ask(server, "81" + b"abcdefg".hex())
    assert ask(server, "c1") == abort("052000", code)


def test_sdo_22_segments_out_of_sequence_are_sent_again(server: SdoServer, dictionary: Dictionary) -> None:
    data = bytes(range(70))
    ask(server, "c6 05 20 00 46")
    frames = segments(data)
    sent = frames[:3] + frames[4:]
    assert [answer for frame in sent for answer in server.receive(frame, 0.0)] == [
        bytes((0xA2, 3, 127)) + bytes(5)
    ]
    again = segments(data, 3)
    assert [answer for frame in again for answer in server.receive(frame, 0.0)] == [
        bytes((0xA2, 7, 127)) + bytes(5)
    ]
    assert server.receive(block_end(data), 0.0) == [b"\xa1" + bytes(7)]
    assert dictionary.read(0x2005, 0) == data


def test_a_lost_last_segment_is_asked_for_after_silence(server: SdoServer, dictionary: Dictionary) -> None:
    data = bytes(range(70))
    ask(server, "c6 05 20 00 46")
    for frame in segments(data)[:-1]:
        assert server.receive(frame, 0.0) == []
    assert server.next_deadline(0.0) == SUB_BLOCK_TIMEOUT
    assert server.tick(SUB_BLOCK_TIMEOUT) == [bytes((0xA2, 9, 127)) + bytes(5)]
    assert server.next_deadline(SUB_BLOCK_TIMEOUT) == TIMEOUT
    assert server.receive(segments(data, 9)[0], 0.5) == [bytes((0xA2, 1, 127)) + bytes(5)]
    assert server.receive(block_end(data), 0.5) == [b"\xa1" + bytes(7)]
    assert dictionary.read(0x2005, 0) == data


def test_the_rest_of_an_acknowledged_sub_block_is_no_new_one(server: SdoServer) -> None:
    """A client that paused goes on where it was, then reads that it has to go back."""
    data = bytes(range(70))
    ask(server, "c6 05 20 00 46")
    for frame in segments(data)[:4]:
        server.receive(frame, 0.0)
    assert server.tick(0.3) == [bytes((0xA2, 4, 127)) + bytes(5)]
    for frame in segments(data)[4:]:
        assert server.receive(frame, 0.4) == []
    assert [answer for frame in segments(data, 4) for answer in server.receive(frame, 0.5)] == [
        bytes((0xA2, 6, 127)) + bytes(5)
    ]
    assert server.receive(block_end(data), 0.5) == [b"\xa1" + bytes(7)]


def test_sdo_23_sequence_number_0(server: SdoServer) -> None:
    ask(server, "c0 05 20 00")
    assert ask(server, "00 61") == abort("052000", AbortCode.SEQUENCE_NUMBER)


def test_block_download_of_nothing(server: SdoServer, dictionary: Dictionary) -> None:
    dictionary.write(0x2005, 0, b"before")
    ask(server, "c6 05 20 00 00")
    assert ask(server, "81") == "a2017f0000000000"
    assert server.receive(block_end(b""), 0.0) == [b"\xa1" + bytes(7)]
    assert dictionary.read(0x2005, 0) == b""


def test_block_download_ends_with_its_end_alone(server: SdoServer) -> None:
    ask(server, "c0 05 20 00")
    ask(server, "81" + b"abcdefg".hex())
    assert ask(server, "00" + b"abcdefg".hex()) == abort("052000", AbortCode.UNKNOWN_COMMAND)


# -- block upload -----------------------------------------------------------------------------------------------------


def test_sdo_24_block_upload(server: SdoServer, dictionary: Dictionary) -> None:
    data = bytes(range(250)) * 4
    dictionary.write(0x2005, 0, data)
    assert ask(server, "a4 05 20 00 7f") == "c6052000e8030000"
    assert server.receive(b"\xa3".ljust(8, b"\0"), 0.0) == segments(data)
    assert server.receive(b"\xa2\x7f\x7f".ljust(8, b"\0"), 0.0) == segments(data, 127)
    assert server.receive(b"\xa2\x10\x7f".ljust(8, b"\0"), 0.0) == [block_end(data)]
    assert ask(server, "a1") == ""
    assert server.state is SdoState.IDLE


def test_sdo_25_block_size_changes_between_sub_blocks(server: SdoServer, dictionary: Dictionary) -> None:
    data = bytes(range(100))
    dictionary.write(0x2005, 0, data)
    ask(server, "a4 05 20 00 02")
    assert server.receive(b"\xa3".ljust(8, b"\0"), 0.0) == segments(data, 0, 2)
    assert server.receive(b"\xa2\x02\x05".ljust(8, b"\0"), 0.0) == segments(data, 2, 5)
    assert server.receive(b"\xa2\x05\x7f".ljust(8, b"\0"), 0.0) == segments(data, 7)
    assert server.receive(b"\xa2\x08\x00".ljust(8, b"\0"), 0.0) == [block_end(data)]


@pytest.mark.parametrize("taken", [0, 1, 14])
def test_sdo_26_block_upload_goes_back_to_what_was_lost(
    server: SdoServer, dictionary: Dictionary, taken: int
) -> None:
    data = bytes(range(100))
    dictionary.write(0x2005, 0, data)
    ask(server, "a4 05 20 00 7f")
    ask(server, "a3")
    assert server.receive(bytes((0xA2, taken, 127)).ljust(8, b"\0"), 0.0) == segments(data, taken)


@pytest.mark.parametrize(
    "request_, code",
    [
        ("a2 10 7f", AbortCode.SEQUENCE_NUMBER),
        ("a2 03 00", AbortCode.BLOCK_SIZE),
        ("a2 03 80", AbortCode.BLOCK_SIZE),
        ("a1", AbortCode.UNKNOWN_COMMAND),
        ("60", AbortCode.UNKNOWN_COMMAND),
    ],
)
def test_sdo_27_wrong_acknowledgement(
    server: SdoServer, dictionary: Dictionary, request_: str, code: AbortCode
) -> None:
    dictionary.write(0x2005, 0, bytes(100))
    ask(server, "a4 05 20 00 7f")
    ask(server, "a3")
    assert ask(server, request_) == abort("052000", code)


@pytest.mark.parametrize("size", ["00", "80", "ff"])
def test_block_upload_of_a_wrong_block_size(server: SdoServer, size: str) -> None:
    assert ask(server, f"a4 08 10 00 {size}") == abort("081000", AbortCode.BLOCK_SIZE)


def test_block_upload_without_a_crc(server: SdoServer) -> None:
    assert ask(server, "a0 08 10 00 7f") == "c208100008000000"
    ask(server, "a3")
    assert ask(server, "a2 02 7f") == "d900000000000000"


def test_block_upload_of_nothing(server: SdoServer) -> None:
    ask(server, "a4 05 20 00 7f")
    assert ask(server, "a3") == "8100000000000000"
    assert ask(server, "a2 01 7f") == "dd00000000000000"


@pytest.mark.parametrize("threshold, answer", [("08", "4108100008000000"), ("07", "c608100008000000")])
def test_block_upload_of_little_may_become_an_ordinary_one(
    server: SdoServer, threshold: str, answer: str
) -> None:
    assert ask(server, f"a4 08 10 00 7f {threshold}") == answer


# -- ends -------------------------------------------------------------------------------------------------------------

TRANSFERS = {
    SdoState.DOWNLOAD: ["20 05 20 00"],
    SdoState.UPLOAD: ["40 08 10 00"],
    SdoState.BLOCK_DOWNLOAD: ["c0 05 20 00"],
    SdoState.BLOCK_DOWNLOAD_END: ["c0 05 20 00", "81 61"],
    SdoState.BLOCK_UPLOAD_START: ["a0 08 10 00 7f"],
    SdoState.BLOCK_UPLOAD: ["a0 08 10 00 7f", "a3"],
    SdoState.BLOCK_UPLOAD_END: ["a0 08 10 00 7f", "a3", "a2 02 7f"],
}
"""How to reach every state but IDLE."""

every_state = pytest.mark.parametrize("state", TRANSFERS)


def reach(server: SdoServer, state: SdoState) -> None:
    for text in TRANSFERS[state]:
        ask(server, text)
    assert server.state is state


@every_state
def test_silence_aborts(server: SdoServer, state: SdoState) -> None:
    """After a second, and the time that the frames of a sub-block may need to reach the client."""
    reach(server, state)
    multiplexer = server._multiplexer.hex()
    uploading = state in (SdoState.BLOCK_UPLOAD, SdoState.BLOCK_UPLOAD_END)
    deadline = TIMEOUT + (2 * SLOWEST_FRAME if uploading else 0.0)
    assert server.next_deadline(0.0) == deadline
    assert server.tick(deadline - 0.001) == []
    assert [frame.hex() for frame in server.tick(deadline)] == [abort(multiplexer, AbortCode.TIMED_OUT)]
    assert server.state is SdoState.IDLE
    assert server.next_deadline(deadline) == math.inf
    assert server.tick(10.0) == []


@every_state
def test_the_clients_abort_ends_without_an_answer(
    server: SdoServer, dictionary: Dictionary, state: SdoState
) -> None:
    reach(server, state)
    assert server.receive(ABORT, 0.0) == []
    assert server.state is SdoState.IDLE
    assert dictionary.read(0x2005, 0) == b""


@pytest.mark.parametrize("state", [state for state in TRANSFERS if state is not SdoState.BLOCK_DOWNLOAD])
def test_a_new_transfer_ends_the_old_one(server: SdoServer, state: SdoState) -> None:
    """Within a sub-block no frame differs from a segment."""
    reach(server, state)
    assert ask(server, "40 06 20 00") == "4306200001020304"
    assert server.state is SdoState.IDLE


@every_state
def test_reset_forgets_without_a_word(server: SdoServer, state: SdoState) -> None:
    reach(server, state)
    server.reset()
    assert server.state is SdoState.IDLE
    assert server.tick(100.0) == []


@pytest.mark.parametrize("command", ["21", "c2"])
def test_announced_download_that_is_too_long(server: SdoServer, command: str) -> None:
    size = struct.pack("<I", LONGEST_DOWNLOAD + 1).hex()
    assert ask(server, f"{command} 05 20 00 {size}") == abort("052000", AbortCode.OUT_OF_MEMORY)


def test_segmented_download_that_never_ends_is_bounded(server: SdoServer) -> None:
    ask(server, "20 05 20 00")
    for number in range(LONGEST_DOWNLOAD // 7):
        assert ask(server, f"{number % 2}0" + b"abcdefg".hex())[1:] == "000000000000000"
    assert ask(server, "10" + b"abcdefg".hex()) == abort("052000", AbortCode.OUT_OF_MEMORY)


def test_block_download_that_never_ends_is_bounded(server: SdoServer) -> None:
    ask(server, "c0 05 20 00")
    answers: list[str] = []
    while AbortCode.OUT_OF_MEMORY.to_bytes(4, "little").hex() not in "".join(answers):
        answers = [ask(server, bytes((number,)).hex() + b"abcdefg".hex()) for number in range(1, 128)]
        assert len(server._block_download._download._data) <= LONGEST_DOWNLOAD
    assert server.state is SdoState.IDLE
    assert not server._block_download._download._data


# -- every entry (OD 01 to 09) -------------------------------------------------------------------------------------


def upload(server: SdoServer, index: int, subindex: int) -> bytes | int:
    """What an SDO client reads; the code of an abort as a number."""
    answer = server.receive(struct.pack("<BHB4x", 0x40, index, subindex), 0.0)[0]
    if answer[0] == 0x80:
        return int.from_bytes(answer[4:], "little")
    if answer[0] & 0x02:
        return answer[4 : 8 - (answer[0] >> 2 & 3)]
    data, toggle = b"", 0
    while True:
        segment = server.receive(bytes((0x60 | toggle,)) + bytes(7), 0.0)[0]
        data += segment[1 : 8 - (segment[0] >> 1 & 7)]
        toggle ^= 0x10
        if segment[0] & 1:
            return data


def download(server: SdoServer, index: int, subindex: int, data: bytes) -> int:
    """0, or the code of an abort; segmented, so that any length goes."""
    answer = server.receive(struct.pack("<BHBI", 0x21, index, subindex, len(data)), 0.0)[0]
    for start in range(0, max(1, len(data)), 7):
        if answer[0] == 0x80:
            break
        part = data[start : start + 7]
        command = (start // 7 % 2) << 4 | (7 - len(part)) << 1 | (start + 7 >= len(data))
        answer = server.receive(bytes((command,)) + part.ljust(7, b"\0"), 0.0)[0]
    return int.from_bytes(answer[4:], "little") if answer[0] == 0x80 else 0


def test_od_01_to_04_every_entry_is_read_with_its_default_and_its_length(
    server: SdoServer, dictionary: Dictionary
) -> None:
    for item in dictionary:
        for entry in item.entries:
            expected = entry.default if entry.access.readable else AbortCode.WRITE_ONLY
            assert upload(server, item.index, entry.subindex) == expected
            assert entry.type.size in (None, len(entry.default))


def test_od_05_to_07_every_entry_takes_or_refuses_what_it_holds(
    server: SdoServer, dictionary: Dictionary
) -> None:
    for item in dictionary:
        for entry in item.entries:
            data = entry.type.pack(entry.low or 0) if entry.low is not None else entry.default
            code = download(server, item.index, entry.subindex, data)
            assert code == (0 if entry.access.writable else AbortCode.READ_ONLY)
            if entry.access.writable and entry.type.size is not None:
                assert download(server, item.index, entry.subindex, data + b"\0") == AbortCode.TOO_LONG
                assert download(server, item.index, entry.subindex, data[1:]) == AbortCode.TOO_SHORT


def test_od_08_and_09_limits_are_the_last_values_that_are_taken(
    server: SdoServer, dictionary: Dictionary
) -> None:
    checked = 0
    for item in dictionary:
        for entry in item.entries:
            for limit, step, code in (
                (entry.low, -1, AbortCode.VALUE_TOO_LOW),
                (entry.high, 1, AbortCode.VALUE_TOO_HIGH),
            ):
                if limit is not None:
                    within, beyond = entry.type.pack(limit), entry.type.pack(limit + step)
                    assert download(server, item.index, entry.subindex, within) == 0
                    assert download(server, item.index, entry.subindex, beyond) == code
                    assert upload(server, item.index, entry.subindex) == within
                    checked += 1
    assert checked == 3


# -- any frame --------------------------------------------------------------------------------------------------------

frame = st.one_of(
    st.binary(max_size=9),
    st.builds(
        lambda command, index, rest: bytes((command,)) + index + rest,
        st.sampled_from([0x20, 0x21, 0x23, 0x2F, 0x40, 0xA0, 0xA4, 0xC0, 0xC2, 0xC4, 0xC6]),
        st.sampled_from(
            [b"\x05\x20\x00", b"\x04\x20\x00", b"\x00\x20\x01", b"\x08\x10\x00", b"\x02\x20\x00"]
        ),
        st.binary(min_size=4, max_size=4),
    ),
    st.builds(
        lambda command, rest: bytes((command,)) + rest,
        st.sampled_from([0, 1, 0x10, 0x11, 0x60, 0x70, 1, 2, 3, 0x81, 0x82, 0xA1, 0xA2, 0xA3, 0xC1]),
        st.binary(min_size=7, max_size=7),
    ),
)


@given(st.lists(st.tuples(frame, st.sampled_from([0.0, 0.01, 0.3, 1.0])), max_size=60))
def test_no_frame_raises_and_nothing_incomplete_is_written(frames: list[tuple[bytes, float]]) -> None:
    """Every write happens with a confirmation; answers and memory are bounded."""
    written: list[bytes] = []
    sink = Entry(0, "Sink", CanType.DOMAIN, Access.RW, sink=written.append)
    text = Entry(0, "Text", CanType.VISIBLE_STRING, Access.RW, b"a text of some length")
    server = SdoServer(Dictionary([variable(0x2005, sink), variable(0x2004, text)]), longest=100)
    now = 0.0
    for data, pause in frames:
        now += pause
        assert len(server.tick(now)) <= 1
        before = len(written)
        answers = server.receive(data, now)
        assert all(len(answer) == 8 for answer in answers)
        assert len(answers) <= 127
        if len(written) > before:
            assert len(answers) == 1
            assert answers[0][0] in (0x60, 0x20, 0x30, 0xA1)
        assert all(len(data) <= 100 for data in written)
        assert server.state is not SdoState.IDLE or server.next_deadline(now) == math.inf


def test_cob_ids_follow_the_node_id_and_cannot_be_changed() -> None:
    """CiA 301, 7.5.2.33: the default server is read-only."""
    objects = Dictionary([server_parameter(16)])
    assert [objects.read(0x1200, sub) for sub in range(3)] == [
        b"\x02",
        (0x610).to_bytes(4, "little"),
        (0x590).to_bytes(4, "little"),
    ]
    assert all(entry.plus_node for item in objects for entry in item.entries[1:])
    with pytest.raises(Abort) as caught:
        objects.write(0x1200, 1, (0x620).to_bytes(4, "little"))
    assert caught.value.code is AbortCode.READ_ONLY


# -- what takes its time ----------------------------------------------------------------------------------------------


class Slow:
    """2007h, whose writes end when the test says so, and its server."""

    def __init__(self) -> None:
        self.pending = Pending()
        entry = Entry(0, "Slow", CanType.UNSIGNED32, Access.WO, sink=lambda _data: self.pending)
        word = Entry(0, "Word", CanType.UNSIGNED32, Access.RW, b"\1\2\3\4")
        self.server = SdoServer(Dictionary([variable(0x2006, word), variable(0x2007, entry)]))

    def answers(self, now: float) -> str:
        return " ".join(frame.hex() for frame in self.server.tick(now))


@pytest.mark.parametrize(
    "code, answer",
    [(None, "6007200000000000"), (AbortCode.HARDWARE, abort("072000", AbortCode.HARDWARE))],
)
def test_a_write_that_takes_its_time_is_answered_when_it_is_done(code: AbortCode | None, answer: str) -> None:
    slow = Slow()
    assert ask(slow.server, "23 07 20 00 01 02 03 04", 1.0) == ""
    assert slow.server.next_deadline(1.0) == 1.0 + WRITE_TIMEOUT
    assert slow.answers(2.0) == ""
    slow.pending.finish(code)
    assert slow.server.next_deadline(2.0) == -math.inf
    assert slow.answers(2.0) == answer
    assert slow.server.state is SdoState.IDLE


def test_one_that_is_done_at_once_is_answered_at_once() -> None:
    slow = Slow()
    slow.pending.finish(AbortCode.HARDWARE)
    assert ask(slow.server, "23 07 20 00 01 02 03 04") == abort("072000", AbortCode.HARDWARE)


def test_one_that_takes_too_long_is_aborted() -> None:
    slow = Slow()
    ask(slow.server, "23 07 20 00 01 02 03 04")
    assert slow.answers(WRITE_TIMEOUT) == abort("072000", AbortCode.TIMED_OUT)
    slow.pending.finish()
    assert slow.answers(WRITE_TIMEOUT) == ""


def test_a_client_that_goes_on_has_given_up_the_answer() -> None:
    slow = Slow()
    ask(slow.server, "23 07 20 00 01 02 03 04")
    assert ask(slow.server, "40 06 20 00") == "4306200001020304"
    slow.pending.finish()
    assert slow.answers(0.0) == ""


def test_segments_and_blocks_are_confirmed_late_as_well() -> None:
    slow = Slow()
    ask(slow.server, "21 07 20 00 04")
    assert ask(slow.server, "07 01 02 03 04") == ""
    slow.pending.finish()
    assert slow.answers(0.0) == "2000000000000000"
    slow.pending = Pending()
    ask(slow.server, "c2 07 20 00 04")
    ask(slow.server, "81 01 02 03 04")
    assert ask(slow.server, block_end(b"\1\2\3\4").hex()) == ""
    slow.pending.finish()
    assert slow.answers(0.0) == "a100000000000000"


@pytest.mark.parametrize("begun, multiplexer", [("21 05 20 00 10", "052000"), ("40 04 20 00", "042000")])
def test_a_transfer_that_the_device_cannot_go_on_with_is_aborted_at_once(
    server: SdoServer, dictionary: Dictionary, begun: str, multiplexer: str
) -> None:
    dictionary.write(0x2004, 0, b"a text of two segments")
    assert server.abandon() == []
    ask(server, begun)
    assert [frame.hex() for frame in server.abandon()] == [abort(multiplexer, AbortCode.DEVICE_STATE)]
    assert (server.state, server.abandon()) == (SdoState.IDLE, [])
