"""The bytes of SDO frames."""

from __future__ import annotations

from collections import Counter

import pytest

from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.sdo import protocol
from gatewayd.canopen.sdo.protocol import BLOCK_SEGMENTS, REQUESTS, Request

OBJECT = b"\x00\x20\x01"


@pytest.mark.parametrize(
    "command, request_",
    [
        (0x00, Request.DOWNLOAD_SEGMENT),
        (0x1F, Request.DOWNLOAD_SEGMENT),
        (0x23, Request.DOWNLOAD),
        (0x40, Request.UPLOAD),
        (0x70, Request.UPLOAD_SEGMENT),
        (0x80, Request.ABORT),
        (0xA4, Request.BLOCK_UPLOAD),
        (0xA1, Request.BLOCK_UPLOAD_END),
        (0xA2, Request.BLOCK_UPLOAD_ACKNOWLEDGE),
        (0xA3, Request.BLOCK_UPLOAD_START),
        (0xC6, Request.BLOCK_DOWNLOAD),
        (0xDD, Request.BLOCK_DOWNLOAD_END),
        (0xE0, Request.UNKNOWN),
        (0xFF, Request.UNKNOWN),
    ],
)
def test_command_bytes(command: int, request_: Request) -> None:
    assert REQUESTS[command] is request_


def test_in_a_sub_block_all_but_the_abort_are_segments() -> None:
    assert BLOCK_SEGMENTS[0x80] is Request.ABORT
    assert Counter(BLOCK_SEGMENTS) == {Request.BLOCK_SEGMENT: 255, Request.ABORT: 1}


@pytest.mark.parametrize(
    "frame, expected",
    [
        (protocol.abort(OBJECT, AbortCode.TOGGLE), "8000200100000305"),
        (protocol.download_initiated(OBJECT), "6000200100000000"),
        (protocol.download_segment_taken(0x10), "3000000000000000"),
        (protocol.upload_initiated(OBJECT, b"a"), "4f00200161000000"),
        (protocol.upload_initiated(OBJECT, b"abcd"), "4300200161626364"),
        (protocol.upload_initiated(OBJECT, b"abcde"), "4100200105000000"),
        (protocol.upload_initiated(OBJECT, b""), "4100200100000000"),
        (protocol.upload_segment(0, b"abcdefg", last=False), "0061626364656667"),
        (protocol.upload_segment(0x10, b"ab", last=True), "1b61620000000000"),
        (protocol.block_download_initiated(OBJECT, 127, checked=True), "a40020017f000000"),
        (protocol.block_download_initiated(OBJECT, 127, checked=False), "a00020017f000000"),
        (protocol.block_download_acknowledged(3, 127), "a2037f0000000000"),
        (protocol.BLOCK_DOWNLOAD_ENDED, "a100000000000000"),
        (protocol.block_upload_initiated(OBJECT, 300, checked=True), "c60020012c010000"),
        (protocol.block_upload_initiated(OBJECT, 300, checked=False), "c20020012c010000"),
        (protocol.block_upload_ended(2, 0x1234), "c934120000000000"),
    ],
)
def test_answers(frame: bytes, expected: str) -> None:
    assert frame.hex() == expected
