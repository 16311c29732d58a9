"""The SDO client against the server of this project, hostile servers, and silence."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import AbortCode, Access, Dictionary, Entry, variable
from gatewayd.canopen.sdo import protocol
from gatewayd.canopen.sdo.client import CLIENT_TIMEOUT, SdoClient, SdoClientState, SdoResult
from gatewayd.canopen.sdo.server import SdoServer

INDEX = 0x2005
OBJECT = b"\x05\x20\x00"
contents = st.integers(0, 900).flatmap(lambda size: st.binary(min_size=size, max_size=size))


def served(frames: list[bytes], client: SdoClient, server: SdoServer) -> SdoResult:
    """Carry frames between both until the transfer has ended."""
    while frames:
        answers = [answer for frame in frames for answer in server.receive(frame, 0.0)]
        frames = [request for answer in answers for request in client.receive(answer, 0.0)]
    result = client.take()
    assert result is not None
    assert client.idle
    return result


def _server(value: bytes = b"") -> tuple[SdoServer, Entry]:
    entry = Entry(0, "Data", CanType.DOMAIN, Access.RW, value)
    return SdoServer(Dictionary([variable(INDEX, entry)])), entry


@given(contents)
def test_uploads_arrive_whole(data: bytes) -> None:
    client, (server, _) = SdoClient(), _server(data)
    assert served(client.upload(INDEX, 0, 0.0), client, server) == SdoResult(INDEX, 0, data)


@given(contents)
def test_downloads_arrive_whole(data: bytes) -> None:
    client, (server, entry) = SdoClient(), _server(b"before")
    result = served(client.download(INDEX, 0, data, 0.0), client, server)
    assert result.good
    assert entry.value == data


def test_abort_of_the_server_is_the_result() -> None:
    client, (server, _) = SdoClient(), _server()
    result = served(client.upload(0x3000, 1, 0.0), client, server)
    assert (result.code, result.silent, result.good) == (AbortCode.NO_OBJECT, False, False)
    assert (result.index, result.subindex) == (0x3000, 1)


def test_silence_ends_a_transfer_and_the_server_is_told() -> None:
    client = SdoClient()
    client.upload(INDEX, 0, 5.0)
    assert client.next_deadline() == 5.0 + CLIENT_TIMEOUT
    assert client.tick(5.9) == []
    assert client.tick(6.0) == [protocol.abort(OBJECT, AbortCode.TIMED_OUT)]
    result = client.take()
    assert result is not None
    assert result.silent
    assert client.take() is None


def test_each_answer_has_its_own_time() -> None:
    client = SdoClient(timeout=0.5)
    client.upload(INDEX, 0, 0.0)
    client.receive(protocol.upload_initiated(OBJECT, bytes(20)), 0.4)
    assert client.next_deadline() == 0.9
    client.spare(2.0)
    assert client.tick(2.5) == []


@pytest.mark.parametrize(
    "late",
    [
        protocol.upload_initiated(b"\x00\x20\x01", b"\7"),
        protocol.download_initiated(b"\x00\x20\x01"),
        protocol.abort(b"\x00\x20\x01", AbortCode.GENERAL),
        b"\x4f\x05\x20\x00",
        b"",
    ],
)
def test_answers_of_earlier_transfers_and_short_frames_are_ignored(late: bytes) -> None:
    client = SdoClient()
    client.upload(INDEX, 0, 0.0)
    assert client.receive(late, 0.5) == []
    assert client.state is SdoClientState.UPLOAD
    assert client.next_deadline() == CLIENT_TIMEOUT
    client.receive(protocol.upload_initiated(OBJECT, b"\1"), 0.6)
    assert client.take() == SdoResult(INDEX, 0, b"\1")


def test_abort_that_names_no_object_is_meant_for_the_present_transfer() -> None:
    client = SdoClient()
    client.upload(INDEX, 0, 0.0)
    client.receive(protocol.abort(bytes(3), AbortCode.DEVICE_STATE), 0.1)
    result = client.take()
    assert result is not None
    assert result.code == AbortCode.DEVICE_STATE


@pytest.mark.parametrize(
    "frames, code",
    [
        pytest.param([protocol.download_initiated(OBJECT)], AbortCode.UNKNOWN_COMMAND, id="wrong direction"),
        pytest.param(
            [protocol.upload_segment(0, b"a", last=True)], AbortCode.UNKNOWN_COMMAND, id="segment first"
        ),
        pytest.param([b"\xff" + bytes(7)], AbortCode.UNKNOWN_COMMAND, id="no command"),
        pytest.param([b"\xc6" + OBJECT + bytes(4)], AbortCode.UNKNOWN_COMMAND, id="block"),
        pytest.param([b"\x41" + OBJECT + b"\xff" * 4], AbortCode.OUT_OF_MEMORY, id="4 GB announced"),
        pytest.param(
            [b"\x41" + OBJECT + b"\x09\0\0\0", protocol.upload_segment(0x10, b"a", last=True)],
            AbortCode.TOGGLE,
            id="toggle",
        ),
        pytest.param(
            [b"\x41" + OBJECT + b"\x02\0\0\0", protocol.upload_segment(0, b"abc", last=True)],
            AbortCode.TOO_LONG,
            id="more than announced",
        ),
        pytest.param(
            [b"\x41" + OBJECT + b"\x04\0\0\0", protocol.upload_segment(0, b"abc", last=True)],
            AbortCode.TOO_SHORT,
            id="less than announced",
        ),
        pytest.param(
            [b"\x40" + OBJECT + bytes(4), protocol.upload_segment(0, b"", last=False)],
            AbortCode.LENGTH,
            id="nothing for ever",
        ),
    ],
)
def test_wrong_answers_end_the_transfer(frames: list[bytes], code: AbortCode) -> None:
    client = SdoClient()
    client.upload(INDEX, 0, 0.0)
    said = [request for frame in frames for request in client.receive(frame, 0.1)]
    assert said[-1] == protocol.abort(OBJECT, code)
    result = client.take()
    assert result is not None
    assert (result.code, result.silent) == (code, False)


def test_value_without_a_size_has_four_bytes() -> None:
    client = SdoClient()
    client.upload(INDEX, 0, 0.0)
    client.receive(b"\x42" + OBJECT + b"abcd", 0.1)
    assert client.take() == SdoResult(INDEX, 0, b"abcd")


def test_wrong_toggle_of_a_confirmed_segment_ends_a_download() -> None:
    client = SdoClient()
    client.download(INDEX, 0, bytes(20), 0.0)
    assert len(client.receive(protocol.download_initiated(OBJECT), 0.1)) == 1
    assert client.receive(protocol.download_segment_taken(0x10), 0.2) == [
        protocol.abort(OBJECT, AbortCode.TOGGLE)
    ]


@given(st.booleans(), st.lists(st.binary(min_size=8, max_size=8), max_size=30))
def test_whatever_a_server_says_the_client_ends_or_waits(uploads: bool, frames: list[bytes]) -> None:
    client = SdoClient()
    if uploads:
        client.upload(INDEX, 0, 0.0)
    else:
        client.download(INDEX, 0, bytes(30), 0.0)
    for frame in frames:
        assert len(client.receive(frame[:1] + OBJECT + frame[4:], 0.1)) <= 1
    client.tick(99.0)
    assert client.take() is not None
    assert client.idle
