"""The electronic data sheet of a node (CiA 306-1), and the configuration file of a commissioned one.

Deterministic: the same mapping gives the same bytes; the dates are fixed, and the fingerprint of the mapping says
what changed. Numbers that contain the node-ID are `$NODEID+...`. Integers are hexadecimal where they are unsigned and
decimal where they are signed, reals decimal. Limits of reals are left out: tools disagree about how to write them.
What shows the present state of the cell has no default: no number would be true, and 0 may be none of its values.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil, floor
from typing import Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Access, Dictionary, Entry, Object, ObjectCode, Pdo
from gatewayd.core.definition import CellDefinition
from gatewayd.links.canopen_node.bus_load import BIT_RATES
from gatewayd.links.canopen_node.identity import idle_node
from gatewayd.links.canopen_node.plan import CanopenPlan

_DATE: Final = "01-01-2026"
_TIME: Final = "12:00AM"
_MANDATORY: Final = (0x1000, 0x1001, 0x1018)
_MANUFACTURER: Final = range(0x2000, 0x6000)
_RPDOS: Final = range(0x1400, 0x1600)
_TPDOS: Final = range(0x1800, 0x1A00)
_DUMMIES: Final = range(1, 8)
_UNSUPPORTED_DUMMIES: Final = (1,)
_IDENTITY: Final = 0x1018
_DOMAIN_OBJECT: Final = 2
_BYTE: Final = 8


@dataclass(frozen=True, slots=True)
class Sheet:
    """What the head of the file says."""

    cell: str
    """Its name; the file is named after it."""
    fingerprint: int
    node: int
    """The node-ID that the defaults of the objects were made with."""
    bit_rate: int
    """bit/s."""


def objects_of(plan: CanopenPlan, definition: CellDefinition) -> Dictionary:
    """The object dictionary of the node of a cell, as it is after its first power-on."""
    return idle_node(plan, definition).dictionary


def sheet_of(plan: CanopenPlan, definition: CellDefinition) -> Sheet:
    """The head for a cell."""
    return Sheet(definition.name, definition.fingerprint, plan.node, plan.bitrate)


def eds_text(objects: Iterable[Object], sheet: Sheet) -> str:
    """The data sheet of a node: every object with type, access, default, limits and whether a PDO may carry it."""
    return _text(_sections(tuple(objects), sheet, valued=False))


def dcf_text(objects: Iterable[Object], sheet: Sheet) -> str:
    """The data sheet with node-ID, bit-rate, and the values of all parameters that a node stores."""
    return _text(_sections(tuple(objects), sheet, valued=True))


_Section = tuple[str, list[tuple[str, str]]]


def _text(sections: Iterable[_Section]) -> str:
    blocks = (
        "\n".join([f"[{name}]", *(f"{key}={value}" for key, value in pairs)]) for name, pairs in sections
    )
    return "\n\n".join(blocks) + "\n"


def _sections(objects: tuple[Object, ...], sheet: Sheet, *, valued: bool) -> Iterator[_Section]:
    yield "FileInfo", _file_info(sheet, valued=valued)
    yield "DeviceInfo", _device_info(objects, sheet.cell)
    if valued:
        yield "DeviceComissioning", _commissioning(sheet)
    dummies = [(f"Dummy{number:04d}", "0" if number in _UNSUPPORTED_DUMMIES else "1") for number in _DUMMIES]
    yield "DummyUsage", dummies
    yield "Comments", [("Lines", "1"), ("Line1", "made by gatewayd from the mapping of the cell")]
    groups: dict[str, list[Object]] = {"Mandatory": [], "Optional": [], "Manufacturer": []}
    for item in objects:
        optional = "Manufacturer" if item.index in _MANUFACTURER else "Optional"
        groups["Mandatory" if item.index in _MANDATORY else optional].append(item)
    for name, group in groups.items():
        yield f"{name}Objects", _listed([item.index for item in group])
        for item in group:
            yield from _object(item, sheet.node, valued=valued)


def _file_info(sheet: Sheet, *, valued: bool) -> list[tuple[str, str]]:
    pairs = [
        ("FileName", f"{sheet.cell}.{'dcf' if valued else 'eds'}"),
        ("FileVersion", "1"),
        ("FileRevision", "0"),
        ("EDSVersion", "4.0"),
        ("Description", f"cell {sheet.cell}, mapping {sheet.fingerprint:08X}"),
        ("CreationTime", _TIME),
        ("CreationDate", _DATE),
        ("CreatedBy", "gatewayd"),
        ("ModificationTime", _TIME),
        ("ModificationDate", _DATE),
        ("ModifiedBy", "gatewayd"),
    ]
    return [*pairs, ("LastEDS", f"{sheet.cell}.eds")] if valued else pairs


def _device_info(objects: tuple[Object, ...], cell: str) -> list[tuple[str, str]]:
    identity = {
        entry.subindex: entry.number for item in objects if item.index == _IDENTITY for entry in item.entries
    }
    return [
        ("VendorName", "gatewayd"),
        ("VendorNumber", f"0x{identity.get(1, 0):X}"),
        ("ProductName", f"gatewayd {cell}"),
        ("ProductNumber", f"0x{identity.get(2, 0):X}"),
        ("RevisionNumber", f"0x{identity.get(3, 0):X}"),
        ("OrderCode", cell),
        *((f"BaudRate_{rate // 1000}", "1") for rate in BIT_RATES),
        ("SimpleBootUpMaster", "0"),
        ("SimpleBootUpSlave", "1"),
        ("Granularity", str(_granularity(objects))),
        ("DynamicChannelsSupported", "0"),
        ("GroupMessaging", "0"),
        ("NrOfRXPDO", str(sum(item.index in _RPDOS for item in objects))),
        ("NrOfTXPDO", str(sum(item.index in _TPDOS for item in objects))),
        ("LSS_Supported", "1"),
        ("CompactPDO", "0"),
    ]


def _granularity(objects: Iterable[Object]) -> int:
    """Bits of the smallest thing that can be mapped: numbers, dummies too, lie on byte boundaries (CiA 306-1, 4.4)."""
    mapped = (entry.type.bits for item in objects for entry in item.entries if entry.pdo is not Pdo.NONE)
    return min(mapped, default=_BYTE)


def _commissioning(sheet: Sheet) -> list[tuple[str, str]]:
    return [
        ("NodeID", f"0x{sheet.node:X}"),
        ("NodeName", sheet.cell),
        ("Baudrate", str(sheet.bit_rate // 1000)),
        ("NetNumber", "0"),
        ("NetworkName", ""),
        ("CANopenManager", "0"),
    ]


def _listed(indices: list[int]) -> list[tuple[str, str]]:
    return [
        ("SupportedObjects", str(len(indices))),
        *((str(number), f"0x{index:04X}") for number, index in enumerate(indices, 1)),
    ]


def _object(item: Object, node: int, *, valued: bool) -> Iterator[_Section]:
    section = f"{item.index:04X}"
    if item.code is ObjectCode.VAR:
        yield section, _entry(item.entries[0], item.name, node, valued=valued)
        return
    yield (
        section,
        [
            ("ParameterName", item.name),
            ("ObjectType", f"0x{item.code:X}"),
            ("SubNumber", f"0x{len(item.entries):X}"),
        ],
    )
    for entry in item.entries:
        yield f"{section}sub{entry.subindex:X}", _entry(entry, entry.name, node, valued=valued)


def _entry(entry: Entry, name: str, node: int, *, valued: bool) -> list[tuple[str, str]]:
    is_domain = entry.type is CanType.DOMAIN
    pairs = [
        ("ParameterName", name),
        ("ObjectType", f"0x{_DOMAIN_OBJECT if is_domain else ObjectCode.VAR:X}"),
        ("DataType", f"0x{entry.type.code:04X}"),
        ("AccessType", entry.access.value),
    ]
    if not is_domain and not entry.is_volatile:
        pairs.append(("DefaultValue", _default(entry, node)))
    pairs.append(("PDOMapping", "0" if entry.pdo is Pdo.NONE else "1"))
    pairs.extend(_limits(entry))
    if valued and entry.stored and entry.access is not Access.CONST:
        pairs.append(("ParameterValue", _number(entry.type, entry.value)))
    return pairs


def _default(entry: Entry, node: int) -> str:
    if entry.plus_node:
        base = int.from_bytes(entry.default, "little") - node
        return f"$NODEID+0x{base:X}"
    return _number(entry.type, entry.default)


def _number(can_type: CanType, data: bytes) -> str:
    if can_type is CanType.VISIBLE_STRING:
        return data.decode("ascii")
    value = can_type.unpack(data)
    if can_type is CanType.BOOLEAN:
        return str(int(value))
    if can_type.is_real:
        return f"{value:.17g}"
    return _integer(can_type, int(value))


def _limits(entry: Entry) -> Iterator[tuple[str, str]]:
    if entry.type.is_real or entry.type.size is None or entry.type is CanType.BOOLEAN:
        return
    if entry.low is not None:
        yield "LowLimit", _integer(entry.type, ceil(entry.low))
    if entry.high is not None:
        yield "HighLimit", _integer(entry.type, floor(entry.high))


def _integer(can_type: CanType, value: int) -> str:
    return str(value) if can_type.name.startswith("INTEGER") else f"0x{value:X}"
