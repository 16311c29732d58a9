from __future__ import annotations

from gatewayd.modbus.exceptions import ExceptionCode


def test_codes_have_the_names_of_the_specification() -> None:
    """Application Protocol V1.1b3, 7, with `server device` left out."""
    assert {int(code): code.text for code in ExceptionCode} == {
        0x01: "illegal function",
        0x02: "illegal address",
        0x03: "illegal value",
        0x04: "device failure",
        0x06: "busy",
        0x0A: "path unavailable",
        0x0B: "target failed",
    }
