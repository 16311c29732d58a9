from __future__ import annotations

from gatewayd.modbus.describe import answer_text
from gatewayd.modbus.exceptions import ExceptionCode


def test_codes_have_the_names_of_the_specification() -> None:
    """Application Protocol V1.1b3, 7: the answers in use here, and those that a trace may meet."""
    assert {int(code): code.text for code in ExceptionCode} == {
        0x01: "illegal function",
        0x02: "illegal data address",
        0x03: "illegal data value",
        0x04: "server device failure",
        0x06: "server device busy",
        0x0A: "gateway path unavailable",
        0x0B: "gateway target device failed to respond",
    }
    assert {
        code for code in range(256) if f"{code:02X}h exception:" not in answer_text(bytes((0x83, code)))
    } == {
        *map(int, ExceptionCode),
        0x05,
        0x08,
    }
