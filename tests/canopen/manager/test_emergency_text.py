"""EMCY messages of devices in words."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.manager.emergency_text import code_text, read_emergency, register_text


@pytest.mark.parametrize(
    "code, text",
    [
        (0x8130, "life guarding or heartbeat error"),
        (0x4210, "device temperature too high"),
        (0x4280, "device temperature"),
        (0x4780, "temperature"),
        (0x0010, "error reset or no error"),
        (0xFF12, "of the manufacturer"),
        (0xC000, "unknown error"),
    ],
)
def test_codes(code: int, text: str) -> None:
    assert code_text(code) == text


def test_register() -> None:
    assert register_text(0b1001_0101) == "voltage, communication, manufacturer"
    assert register_text(0b0000_0001) == ""


def test_message_in_words() -> None:
    message = read_emergency(bytes.fromhex("3081110500000000"))
    assert str(message) == (
        "8130h life guarding or heartbeat error, error register 11h (communication), manufacturer 05 00 00 00 00"
    )


@given(st.binary(max_size=12))
def test_only_eight_bytes_are_a_message(data: bytes) -> None:
    message = read_emergency(data)
    assert (message is None) == (len(data) != 8)
    assert message is None or (str(message) and message.is_reset == (data[1] == 0))
