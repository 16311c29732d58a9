"""Data on its way, without a server."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.dictionary import Abort, AbortCode
from gatewayd.canopen.sdo.transfers import BlockDownload, BlockUpload, Download, Upload


def code_of(error: pytest.ExceptionInfo[Abort]) -> AbortCode:
    return error.value.code


def test_download_collects_what_was_announced() -> None:
    download = Download(5, longest=10)
    download.add(b"abc")
    with pytest.raises(Abort) as short:
        download.whole()
    download.add(b"de")
    assert download.whole() == b"abcde"
    with pytest.raises(Abort) as long:
        download.add(b"f")
    assert (code_of(short), code_of(long)) == (AbortCode.TOO_SHORT, AbortCode.TOO_LONG)


def test_download_is_bounded() -> None:
    with pytest.raises(Abort) as announced:
        Download(11, longest=10)
    download = Download(None, longest=10)
    download.add(bytes(10))
    with pytest.raises(Abort) as added:
        download.add(b"x")
    assert code_of(announced) is code_of(added) is AbortCode.OUT_OF_MEMORY
    assert download.whole() == bytes(10)


@given(st.binary(max_size=40))
def test_upload_is_done_with_its_last_segment(data: bytes) -> None:
    upload = Upload(data)
    collected = b""
    while not upload.done:
        frame = upload.segment()
        collected += frame[1 : 8 - (frame[0] >> 1 & 7)]
        assert frame[0] & 1 == upload.done
    assert collected == data


@given(st.binary(max_size=3000), st.lists(st.tuples(st.integers(0, 127), st.integers(1, 127)), max_size=30))
def test_what_block_upload_sends_block_download_takes(data: bytes, course: list[tuple[int, int]]) -> None:
    """However the sub-blocks are cut and wherever segments get lost, in both directions at once."""
    size = course[0][1] if course else 127
    upload = BlockUpload(data, size, checked=True)
    download = BlockDownload(Download(len(data), longest=len(data)), checked=True)
    losses = [loss for loss, _size in course]
    while not upload.done:
        frames = upload.sub_block()
        assert len(frames) <= size
        loss = losses.pop() if losses else None
        for number, frame in enumerate(frames):
            if number != loss:
                download.receive(frame)
        taken = download.acknowledge()[1]
        assert taken == (len(frames) if loss is None else min(loss, len(frames)))
        upload.acknowledge(taken, size)
    end = upload.end()
    assert download.complete
    assert download.whole(end[0] >> 2 & 7, int.from_bytes(end[1:3], "little")) == data


def test_nothing_is_taken_after_the_last_segment() -> None:
    download = BlockDownload(Download(None, longest=100), checked=False)
    assert download.receive(b"\x81abcdefg")
    assert not download.receive(b"\x02hijklmn")
    assert download.acknowledge()[1] == 1
    assert download.whole(0, 0) == b"abcdefg"
