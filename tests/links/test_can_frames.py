"""CAN frames as bytes and back; in words they are in tests/links/canopen_node/test_traffic.py."""

from __future__ import annotations

import struct

import pytest

from gatewayd.canopen.frame import Frame
from gatewayd.links.can_frames import packed, unpacked


@pytest.mark.parametrize(
    "frame", [Frame(0x185, b"\1\2"), Frame(0), Frame(0x7FF, bytes(8)), Frame(0x705, remote=True, length=1)]
)
def test_there_and_back(frame: Frame) -> None:
    assert len(packed(frame)) == 16
    assert unpacked(packed(frame)) == frame


def test_other_bytes_are_no_frame() -> None:
    with pytest.raises(struct.error):
        unpacked(b"\0" * 15)
