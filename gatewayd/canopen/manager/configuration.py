"""What is written into a device before it is started, in the order that devices demand, and concise DCF (CiA 302-3)."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from gatewayd.canopen.cob_ids import BASIC_FRAME, INVALID
from gatewayd.canopen.manager.plan import ManagedPdo, Setting

NO_REMOTE = 0x4000_0000
"""Bit 30 of a TPDO's COB-ID: no remote frame."""
MAX_SETTINGS = 4096
"""Objects that a concise DCF may have."""

_COUNT = struct.Struct("<I")
_HEAD = struct.Struct("<HBI")


class ConfigurationError(Exception):
    """A configuration that is none; the text says where."""


@dataclass(frozen=True, slots=True)
class ExpectedObject:
    """What an object of the device must say, as far as `mask` goes; numbers, little-endian on the bus."""

    index: int
    subindex: int
    number: int
    mask: int = 0xFFFF_FFFF


def pdo_settings(pdo: ManagedPdo) -> Iterator[Setting]:
    """Lay a PDO out: switch it off, empty it, fill it, count its objects, switch it on (CiA 301, 7.5.2.36 and .38)."""
    parameter, mapping = pdo.communication, pdo.mapping
    cob_id = pdo.cob_id | (NO_REMOTE if pdo.no_remote and pdo.transmit else 0)
    yield Setting(parameter, 1, _u32(cob_id | INVALID))
    if pdo.transmission is not None:
        yield Setting(parameter, 2, bytes((pdo.transmission,)))
    if pdo.inhibit is not None:
        yield Setting(parameter, 3, pdo.inhibit.to_bytes(2, "little"))
    if pdo.event is not None:
        yield Setting(parameter, 5, pdo.event.to_bytes(2, "little"))
    yield Setting(mapping, 0, b"\0")
    for number, item in enumerate(pdo.objects, 1):
        yield Setting(mapping, number, _u32(item.entry))
    yield Setting(mapping, 0, bytes((len(pdo.objects),)))
    yield Setting(parameter, 1, _u32(cob_id))


def pdo_expectations(pdo: ManagedPdo) -> Iterator[ExpectedObject]:
    """What a device must say of a PDO that is taken as it is. Whether it may be asked for is all the same."""
    yield ExpectedObject(pdo.communication, 1, pdo.cob_id, INVALID | BASIC_FRAME)
    yield ExpectedObject(pdo.mapping, 0, len(pdo.objects))
    for number, item in enumerate(pdo.objects, 1):
        yield ExpectedObject(pdo.mapping, number, item.entry)


def concise_dcf(settings: Iterable[Setting]) -> bytes:
    """The value of 1F22h: how many, then index, sub-index, length and data of each."""
    items = tuple(settings)
    body = b"".join(_HEAD.pack(item.index, item.subindex, len(item.data)) + item.data for item in items)
    return _COUNT.pack(len(items)) + body


def read_concise_dcf(data: bytes) -> tuple[Setting, ...]:
    """The settings in a value of 1F22h. ConfigurationError if it is none."""
    if len(data) < _COUNT.size:
        raise ConfigurationError("a concise DCF begins with four bytes, the number of its objects")
    (count,) = _COUNT.unpack_from(data)
    if count > MAX_SETTINGS:
        raise ConfigurationError(
            f"{count} objects are more than the {MAX_SETTINGS} that a concise DCF may have"
        )
    place, settings = _COUNT.size, []
    for number in range(1, count + 1):
        if place + _HEAD.size > len(data):
            raise ConfigurationError(f"the concise DCF ends before object {number} of {count}")
        index, subindex, size = _HEAD.unpack_from(data, place)
        place += _HEAD.size
        if size > len(data) - place:
            raise ConfigurationError(f"the concise DCF ends within {index:04X}h:{subindex:02X}")
        settings.append(Setting(index, subindex, data[place : place + size]))
        place += size
    if place < len(data):
        raise ConfigurationError("there is more after the last object of the concise DCF")
    return tuple(settings)


def _u32(number: int) -> bytes:
    return number.to_bytes(4, "little")
