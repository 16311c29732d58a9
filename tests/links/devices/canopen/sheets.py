"""Data sheets made for a test: objects, and the PDOs that carry them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

HEAD = "[FileInfo]\nFileName=test.eds\nEDSVersion=4.0\n[DeviceInfo]\nVendorNumber=0x1F0\n"


@dataclass(frozen=True)
class Described:
    """An object of a data sheet."""

    code: int
    """Of its data type."""
    access: str = "ro"
    name: str = "Value"


def eds(
    objects: Mapping[int, Described],
    tpdos: Sequence[Sequence[int]] = (),
    rpdos: Sequence[Sequence[int]] = (),
) -> bytes:
    """A data sheet; PDOs are lists of mapping entries (0x60040020)."""
    found = [HEAD]
    found += [_object(index, described) for index, described in objects.items()]
    for first, pdos in ((0x1800, tpdos), (0x1400, rpdos)):
        for number, entries in enumerate(pdos):
            cob_id = "$NODEID+" + hex((0x180 if first == 0x1800 else 0x200) + 0x100 * number)
            found.append(_record(first + number, [(5, "0x02"), (7, cob_id), (5, "255")]))
            mapped = [(5, str(len(entries))), *((7, hex(entry)) for entry in entries)]
            found.append(_record(first + 0x200 + number, mapped))
    return "".join(found).encode()


def _object(index: int, its: Described) -> str:
    return (
        f"[{index:04X}]\nParameterName={its.name}\nObjectType=0x7\nDataType={its.code:#06x}\n"
        f"AccessType={its.access}\nPDOMapping=1\n"
    )


def _record(index: int, parts: Sequence[tuple[int, str]]) -> str:
    head = f"[{index:04X}]\nParameterName=PDO\nObjectType=0x9\nSubNumber={len(parts)}\n"
    return head + "".join(
        f"[{index:04X}sub{number:X}]\nParameterName=part {number}\nObjectType=0x7\nDataType={code:#06x}\n"
        f"AccessType=rw\nDefaultValue={value}\nPDOMapping=0\n"
        for number, (code, value) in enumerate(parts)
    )
