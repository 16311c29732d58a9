from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.frame import Frame
from gatewayd.links.can_frames import packed, unpacked
from gatewayd.links.canopen_node.traffic import CanTraffic


@pytest.mark.parametrize("frame", [Frame(0x185, b"\1\2"), Frame(0, b""), Frame(0x705, remote=True, length=1)])
def test_frames_are_packed_as_socketcan_has_them(frame: Frame) -> None:
    assert len(packed(frame)) == 16
    assert unpacked(packed(frame)) == frame


def test_words() -> None:
    assert (
        CanTraffic().words(packed(Frame(0x705, b"\5")), "", outgoing=True)
        == "705h heartbeat of node 5: operational"
    )


@given(st.binary(max_size=40), st.booleans())
def test_any_bytes_have_words(data: bytes, outgoing: bool) -> None:
    assert CanTraffic().words(data, "", outgoing=outgoing)
