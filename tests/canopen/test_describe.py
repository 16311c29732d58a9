from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.describe import ABORTS, abort_text, frame_text
from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.frame import Frame


@pytest.mark.parametrize(
    "can_id, data, text",
    [
        (0x000, "01 00", "NMT start, all nodes"),
        (0x000, "81 05", "NMT reset node, node 5"),
        (0x000, "07 05", "NMT unknown command 7, node 5"),
        (0x000, "01", "NMT frame of length 1 instead of 2"),
        (0x080, "", "SYNC"),
        (0x080, "04", "SYNC 4"),
        (0x085, "50 82 11 00 00 00 00 00", "EMCY of node 5: 8250h, error register 11h 00 00 00 00 00"),
        (0x100, "00 00 00 00 00 00", "TIME"),
        (0x185, "01 02", "TPDO 1 of node 5 01 02"),
        (0x305, "01", "RPDO 2 of node 5 01"),
        (0x485, "", "TPDO 4 of node 5"),
        (0x605, "40 10 20 01 00 00 00 00", "SDO read 2010h:01 of node 5"),
        (0x605, "2b 17 10 00 e8 03 00 00", "SDO write 1017h:00 of node 5 = E8 03"),
        (0x605, "21 17 10 00 0a 00 00 00", "SDO write 1017h:00 of node 5"),
        (0x605, "60 00 00 00 00 00 00 00", "SDO read next segment, node 5"),
        (
            0x605,
            "80 10 20 01 00 00 04 05",
            "SDO 2010h:01 of node 5 aborted by the client: 05040000h timed out",
        ),
        (0x605, "40", "SDO request to node 5, length 1 instead of 8"),
        (0x585, "43 10 20 01 2a 00 00 00", "SDO 2010h:01 of node 5 = 2A 00 00 00"),
        (0x585, "41 08 10 00 09 00 00 00", "SDO 1008h:00 of node 5 comes in segments, length 9"),
        (0x585, "60 17 10 00 00 00 00 00", "SDO 1017h:00 of node 5 written"),
        (0x585, "80 ff 2f 00 00 00 02 06", "SDO 2FFFh:00 of node 5 refused: 06020000h no such object"),
        (0x585, "00 00 00 00 00 00 00 00", "SDO segment read, node 5"),
        (0x705, "00", "boot-up of node 5"),
        (0x705, "05", "heartbeat of node 5: operational"),
        (0x705, "ff", "heartbeat of node 5: pre-operational, toggled"),
        (0x705, "09", "heartbeat of node 5: state 9"),
        (0x7E5, "04 01 00 00 00 00 00 00", "LSS master: switch state global"),
        (0x7E4, "4f 00 00 00 00 00 00 00", "LSS slave: identified"),
        (0x680, "01", "frame 680h 01"),
    ],
)
def test_frames(can_id: int, data: str, text: str) -> None:
    assert frame_text(Frame(can_id, bytes.fromhex(data))) == text


def test_remote_frames() -> None:
    assert frame_text(Frame(0x705, remote=True)) == "guarding of node 5"
    assert frame_text(Frame(0x185, remote=True)) == "request of 185h"


def test_every_abort_code_has_words() -> None:
    assert set(ABORTS) == set(AbortCode)
    assert abort_text(0x0601_0002) == "06010002h read only"
    assert abort_text(0x1234) == "00001234h"


@given(st.integers(0, 0x7FF), st.binary(max_size=8), st.booleans())
def test_any_frame_has_a_description(can_id: int, data: bytes, remote: bool) -> None:
    text = frame_text(Frame(can_id, data, remote))
    assert text.isprintable()
    assert len(text) < 120
