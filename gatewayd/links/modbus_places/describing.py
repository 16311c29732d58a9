"""How a number is written in registers, in words."""

from __future__ import annotations

from gatewayd.modbus.codec import Codec, turns
from gatewayd.report.format import exact


def type_text(codec: Codec | None) -> str:
    """Type and order: `int32 CDAB`; `bit` without a codec."""
    return "bit" if codec is None else f"{codec.type} {order_text(codec)}".strip()


def order_text(codec: Codec) -> str:
    """The order, where it says anything of the type; else empty."""
    return codec.order if turns(codec.order, codec.type) else ""


def encoding_text(codec: Codec | None) -> str:
    """How the number is written, with what is not usual, behind its place: ` int16 * 0.1`."""
    if codec is None:
        return ""
    order = "" if order_text(codec) in ("", "ABCD") else f" {codec.order}"
    scale = "" if codec.scale == 1 else f" * {exact(codec.scale)}"
    offset = f" + {exact(codec.offset)}" if codec.offset else ""
    return f" {codec.type}{order}{scale}{offset}"
