"""The small language of devices in a mapping: addresses of devices, serial ports, bits of a register.

As `gatewayd.mapping.scalars`: what cannot be read raises `ValueRefused` with the rule that it breaks.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Final, Literal

from gatewayd.links.modbus_places.scalars import BAD_ADDRESS
from gatewayd.mapping import syntax
from gatewayd.mapping.scalars import Host, refuse, scalar
from gatewayd.mapping.tables import read
from gatewayd.mapping.typed import BeforeValidator, Field, InstanceOf, Invalid
from gatewayd.report.format import address as address_text

_MODBUS_PORT: Final = 502
_TARGET = re.compile(r"(?:\[(?P<six>[0-9A-Fa-f:.%a-z]+)\]|(?P<host>[^:\[\]\s/]+))(?::(?P<port>[0-9]{1,5}))?")
_PORT_PATH = re.compile(r"/[A-Za-z0-9_./+:@-]+")
_BITS = re.compile(r"(0|[1-9][0-9]?)\.\.(0|[1-9][0-9]?)")
_REGISTERS = re.compile(r"(0|[1-9][0-9]{0,4})(?:\.\.(0|[1-9][0-9]{0,4}))?")
_MAX_REGISTER: Final = 0xFFFF
_MAX_REGISTERS: Final = 125
_MAX_PORT: Final = 65535
_MAX_BIT: Final = 15


@dataclass(frozen=True, slots=True)
class DeviceAddress:
    """Where a device or the converter before it listens."""

    host: str
    """A host name or a literal IP address."""
    port: int

    def __str__(self) -> str:
        """`host:port`, with brackets around IPv6."""
        return address_text(self.host, self.port)


def _target(value: object) -> DeviceAddress:
    if isinstance(value, DeviceAddress):
        return value
    hint = "write host:port, for example 192.0.2.30:502 or island.local; without a port it is 502"
    text = scalar(value, "the address of a device", hint)
    match = _TARGET.fullmatch(text)
    if match is None:
        refuse(syntax.BAD_NETWORK, f"`{text}` is not the address of a device", hint)
    host = match["six"] or match["host"]
    try:
        host = str(read(Host, host))
    except Invalid as invalid:
        context = invalid.mistakes[0].context
        refuse(
            syntax.BAD_NETWORK, context.get("message", f"`{host}` is not a host"), context.get("hint", hint)
        )
    port = int(match["port"]) if match["port"] is not None else _MODBUS_PORT
    if not 0 < port <= _MAX_PORT:
        refuse(syntax.OUT_OF_RANGE, f"port {port} is not between 1 and 65535", hint)
    return DeviceAddress(host, port)


Target = Annotated[
    InstanceOf[DeviceAddress],
    BeforeValidator(
        _target, json_schema_input_type=Annotated[str, Field(examples=["192.0.2.30:502", "island.local"])]
    ),
]
"""Host and port of a device."""


def _port_path(value: object) -> str:
    hint = "write the path of the port, for example /dev/ttyUSB0, better /dev/serial/by-id/..., which stays the same"
    text = scalar(value, "a serial port", hint)
    if not _PORT_PATH.fullmatch(text):
        refuse(syntax.BAD_NETWORK, f"`{text}` is not the path of a serial port", hint)
    return text


PortPath = Annotated[
    str, BeforeValidator(_port_path, json_schema_input_type=Annotated[str, Field(examples=["/dev/ttyUSB0"])])
]
"""Path of a serial port."""


def _bits(value: object) -> range:
    if isinstance(value, range):
        return value
    hint = "write the lowest and the highest bit, for example 0..7; bit 0 is the least significant, bit 15 the most"
    text = scalar(value, "bits of a register", hint)
    match = _BITS.fullmatch(text)
    if match is None:
        refuse(BAD_ADDRESS, f"`{text}` are not bits of a register", hint)
    low, high = int(match[1]), int(match[2])
    if low >= high or high > _MAX_BIT:
        refuse(syntax.OUT_OF_RANGE, f"a register has no bits {text}", hint)
    return range(low, high + 1)


Bits = Annotated[
    InstanceOf[range],
    BeforeValidator(
        _bits,
        json_schema_input_type=Annotated[
            str, Field(pattern=r"^[0-9]{1,2}\.\.[0-9]{1,2}$", examples=["0..7"])
        ],
    ),
]
"""Bits of a register, both ends included."""


def _registers(value: object) -> range:
    if isinstance(value, range):
        return value
    hint = "write the first and the last register, for example 100..103"
    text = scalar(value, "registers", hint)
    match = _REGISTERS.fullmatch(text)
    if match is None:
        refuse(BAD_ADDRESS, f"`{text}` are not registers", hint)
    first, last = int(match[1]), int(match[2] or match[1])
    if not first <= last <= _MAX_REGISTER or last - first >= _MAX_REGISTERS:
        refuse(syntax.OUT_OF_RANGE, f"`{text}` are not 1 to {_MAX_REGISTERS} registers", hint)
    return range(first, last + 1)


Registers = Annotated[
    InstanceOf[range],
    BeforeValidator(
        _registers,
        json_schema_input_type=Annotated[str, Field(pattern=r"^[0-9]+(\.\.[0-9]+)?$", examples=["100..103"])],
    ),
]
"""Some registers, both ends included."""

RestPolicy = Literal["keep", "zero"]
"""What a write gives the bits of a register that nothing is mapped to."""


def _rest(value: object) -> object:
    text = scalar(value, "what becomes of the other bits", "write keep or 0")
    return "zero" if text == "0" else "" if text == "zero" else text


Rest = Annotated[RestPolicy, BeforeValidator(_rest, json_schema_input_type=Literal["keep", 0])]
"""`keep`, or 0."""
