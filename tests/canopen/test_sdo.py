"""The SDO server against a client written by others: canopen's, with every kind of transfer and lost frames."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import canopen
import pytest
from canopen.sdo.client import SdoClient
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Access, Dictionary, Entry, variable
from gatewayd.canopen.sdo.server import SdoServer

INDEX = 0x2005


class Wire:
    """Takes the place of canopen's network: the server answers at once, at a time that stands still.

    `lost` says which frames of the client (True) or of the server (False) are lost on the way.
    """

    def __init__(self, value: bytes = b"") -> None:
        self.entry = Entry(0, "Data", CanType.DOMAIN, Access.RW, value)
        self.server = SdoServer(Dictionary([variable(INDEX, self.entry)]))
        self.now = 0.0
        self.lost: Callable[[bool, bytes], bool] = lambda _by_client, _frame: False
        self.client: Any = cast("Any", SdoClient)(0x601, 0x581, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
        self.client.RESPONSE_TIMEOUT = 0.1
        self.client.network = self

    def send_message(self, _can_id: int, data: bytes, _remote: bool = False) -> None:
        frame = bytes(data)
        if not self.lost(True, frame):
            self.deliver(self.server.receive(frame, self.now))

    def deliver(self, frames: list[bytes]) -> None:
        for frame in frames:
            if not self.lost(False, frame):
                self.client.on_response(0x581, frame, self.now)

    def silence(self) -> None:
        """Time passes until the server notices."""
        self.now = self.server.next_deadline(self.now)
        self.deliver(self.server.tick(self.now))

    def upload(self, *, block: bool = False, crc: bool = True) -> bytes:
        if not block:
            data = self.client.upload(INDEX, 0)
            assert isinstance(data, bytes)
            return data
        with self.client.open(INDEX, 0, "rb", block_transfer=True, request_crc_support=crc) as stream:
            data = stream.read()
        assert isinstance(data, bytes)
        return data

    def download(self, data: bytes, *, block: bool = False, crc: bool = True, size: bool = True) -> None:
        with self.client.open(
            INDEX,
            0,
            "wb",
            buffering=7,
            size=len(data) if size else None,
            block_transfer=block,
            request_crc_support=crc,
            force_segment=True,
        ) as stream:
            stream.write(data)


contents = st.integers(0, 2000).flatmap(lambda size: st.binary(min_size=size, max_size=size))


@given(contents)
def test_uploads_arrive_whole(data: bytes) -> None:
    assert Wire(data).upload() == data


@given(contents, st.booleans())
def test_block_uploads_arrive_whole(data: bytes, crc: bool) -> None:
    wire = Wire(data)
    assert wire.upload(block=True, crc=crc) == data
    assert wire.server.next_deadline(0) == float("inf")


@given(contents, st.booleans())
def test_segmented_downloads_arrive_whole(data: bytes, size: bool) -> None:
    wire = Wire(b"before")
    wire.download(data, size=size)
    assert wire.entry.value == data


@given(contents.filter(bool), st.booleans())
def test_block_downloads_arrive_whole(data: bytes, crc: bool) -> None:
    """None of no bytes: canopen's client sends no segment then, which is no block transfer."""
    wire = Wire(b"before")
    wire.download(data, block=True, crc=crc)
    assert wire.entry.value == data


@given(st.binary(min_size=1, max_size=4))
def test_expedited_downloads_arrive_whole(data: bytes) -> None:
    wire = Wire()
    wire.client.download(INDEX, 0, data)
    assert wire.entry.value == data


@pytest.mark.parametrize("which", [1, 2, 63, 125, 126])
def test_block_upload_survives_a_lost_segment(which: int) -> None:
    """Any but the last of a sub-block, after which canopen's client loses count of what is sent again."""
    data = bytes(range(256)) * 4
    wire = Wire(data)
    missing = [which]

    def lost(by_client: bool, frame: bytes) -> bool:
        return not by_client and bool(missing) and frame[0] == missing[0] and bool(missing.pop())

    wire.lost = lost
    assert wire.upload(block=True) == data
    assert not missing


@settings(max_examples=30)
@given(st.integers(2, 126), st.integers(128 * 7, 2000))
def test_block_download_survives_a_lost_segment(which: int, size: int) -> None:
    """In a sub-block that is not the last one, which canopen's client cannot send again (its issue 599)."""
    data = bytes(index & 0xFF for index in range(size))
    wire = Wire()
    missing = [which]

    def lost(by_client: bool, frame: bytes) -> bool:
        return by_client and bool(missing) and frame[0] == missing[0] and bool(missing.pop())

    wire.lost = lost
    wire.download(data, block=True)
    assert wire.entry.value == data
