"""The electronic data sheet of a node (CiA 306-1), and the configuration file of a commissioned one.

Deterministic: the same mapping gives the same bytes; the dates are fixed, and the fingerprint of the mapping says
what changed. Numbers that contain the node-ID are `$NODEID+...`. Integers are hexadecimal where they are unsigned and
decimal where they are signed, reals decimal. Limits of reals are left out: tools disagree about how to write them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil, floor
from typing import Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Access, Dictionary, Entry, Object, ObjectCode, Pdo
from gatewayd.canopen.frame import Frame, Priority
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.links.canopen_node.node import Node
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.canopen_node.storage import MemoryStore

__all__ = ["Commissioning", "Sheet", "dcf_text", "eds_text", "objects_of", "sheet_of"]

_DATE: Final = "01-01-2026"
_TIME: Final = "12:00AM"
_BIT_RATES: Final = (10, 20, 50, 125, 250, 500, 800, 1000)
_MANDATORY: Final = (0x1000, 0x1001, 0x1018)
_MANUFACTURER: Final = range(0x2000, 0x6000)
_RPDOS: Final = range(0x1400, 0x1600)
_TPDOS: Final = range(0x1800, 0x1A00)
_DUMMIES: Final = range(1, 8)
_UNSUPPORTED_DUMMIES: Final = (1,)
_IDENTITY: Final = 0x1018
_DOMAIN_OBJECT: Final = 2


@dataclass(frozen=True, slots=True)
class Sheet:
    """What the head of the file says."""

    file_name: str
    cell: str
    fingerprint: int
    node: int
    """The node-ID that the defaults of the objects were made with."""


@dataclass(frozen=True, slots=True)
class Commissioning:
    """What makes a configuration file of a data sheet."""

    node: int
    bit_rate: int
    """bit/s."""
    name: str
    """Node name."""


def objects_of(plan: CanopenPlan, definition: CellDefinition) -> Dictionary:
    """The object dictionary of the node of a cell, as it is after its first power-on."""
    return Node(plan, Cell(definition), _send_nowhere, MemoryStore(), _lives).dictionary


def _send_nowhere(_frame: Frame, _priority: Priority) -> bool:
    """Nobody is on the bus."""
    return False


def _lives(_now: float) -> bool:
    return True


def sheet_of(plan: CanopenPlan, definition: CellDefinition, suffix: str = "eds") -> Sheet:
    """The head for a cell; the file is named after it."""
    return Sheet(f"{definition.name}.{suffix}", definition.name, definition.fingerprint, plan.node)


def eds_text(objects: Iterable[Object], sheet: Sheet) -> str:
    """The data sheet of a node: every object with type, access, default, limits and whether a PDO may carry it."""
    return _text(_sections(tuple(objects), sheet, None))


def dcf_text(objects: Iterable[Object], sheet: Sheet, commissioning: Commissioning) -> str:
    """The data sheet with node-ID, bit-rate, and the values of all parameters that a node stores."""
    return _text(_sections(tuple(objects), sheet, commissioning))


_Section = tuple[str, list[tuple[str, str]]]


def _text(sections: Iterable[_Section]) -> str:
    blocks = (
        "\n".join([f"[{name}]", *(f"{key}={value}" for key, value in pairs)]) for name, pairs in sections
    )
    return "\n\n".join(blocks) + "\n"


def _sections(
    objects: tuple[Object, ...], sheet: Sheet, commissioning: Commissioning | None
) -> Iterator[_Section]:
    yield "FileInfo", _file_info(sheet, commissioning)
    yield "DeviceInfo", _device_info(objects)
    if commissioning is not None:
        yield "DeviceComissioning", _commissioning(commissioning)
    yield (
        "DummyUsage",
        [(f"Dummy{number:04d}", "0" if number in _UNSUPPORTED_DUMMIES else "1") for number in _DUMMIES],
    )
    yield "Comments", [("Lines", "1"), ("Line1", "made by gatewayd from the mapping of the cell")]
    indices = [one.index for one in objects]
    manufacturer = [index for index in indices if index in _MANUFACTURER]
    mandatory = [index for index in indices if index in _MANDATORY]
    optional = [index for index in indices if index not in {*manufacturer, *mandatory}]
    named = (("Mandatory", mandatory), ("Optional", optional), ("Manufacturer", manufacturer))
    by_index = {one.index: one for one in objects}
    for name, group in named:
        yield f"{name}Objects", _listed(group)
        for index in group:
            yield from _object(by_index[index], sheet.node, commissioning is not None)


def _file_info(sheet: Sheet, commissioning: Commissioning | None) -> list[tuple[str, str]]:
    pairs = [
        ("FileName", sheet.file_name),
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
    return pairs if commissioning is None else [*pairs, ("LastEDS", f"{sheet.cell}.eds")]


def _device_info(objects: tuple[Object, ...]) -> list[tuple[str, str]]:
    identity = {
        entry.subindex: entry.number for one in objects if one.index == _IDENTITY for entry in one.entries
    }
    return [
        ("VendorName", "gatewayd"),
        ("VendorNumber", f"0x{identity.get(1, 0):X}"),
        ("ProductName", "gatewayd"),
        ("ProductNumber", f"0x{identity.get(2, 0):X}"),
        ("RevisionNumber", f"0x{identity.get(3, 0):X}"),
        ("OrderCode", "gatewayd"),
        *((f"BaudRate_{rate}", "1") for rate in _BIT_RATES),
        ("SimpleBootUpMaster", "0"),
        ("SimpleBootUpSlave", "1"),
        ("Granularity", "1"),
        ("DynamicChannelsSupported", "0"),
        ("GroupMessaging", "0"),
        ("NrOfRXPDO", str(sum(one.index in _RPDOS for one in objects))),
        ("NrOfTXPDO", str(sum(one.index in _TPDOS for one in objects))),
        ("LSS_Supported", "1"),
        ("CompactPDO", "0"),
    ]


def _commissioning(commissioning: Commissioning) -> list[tuple[str, str]]:
    return [
        ("NodeID", f"0x{commissioning.node:X}"),
        ("NodeName", commissioning.name),
        ("Baudrate", str(commissioning.bit_rate // 1000)),
        ("NetNumber", "0"),
        ("NetworkName", ""),
        ("CANopenManager", "0"),
    ]


def _listed(indices: list[int]) -> list[tuple[str, str]]:
    return [
        ("SupportedObjects", str(len(indices))),
        *((str(number), f"0x{index:04X}") for number, index in enumerate(indices, 1)),
    ]


def _object(one: Object, node: int, valued: bool) -> Iterator[_Section]:
    section = f"{one.index:04X}"
    if one.code is ObjectCode.VAR:
        yield section, _entry(one.entries[0], one.name, node, valued=valued)
        return
    yield (
        section,
        [
            ("ParameterName", one.name),
            ("ObjectType", f"0x{one.code:X}"),
            ("SubNumber", f"0x{len(one.entries):X}"),
        ],
    )
    for entry in one.entries:
        yield f"{section}sub{entry.subindex:X}", _entry(entry, entry.name, node, valued=valued)


def _entry(entry: Entry, name: str, node: int, *, valued: bool) -> list[tuple[str, str]]:
    is_domain = entry.type is CanType.DOMAIN
    pairs = [
        ("ParameterName", name),
        ("ObjectType", f"0x{_DOMAIN_OBJECT if is_domain else ObjectCode.VAR:X}"),
        ("DataType", f"0x{entry.type.code:04X}"),
        ("AccessType", entry.access.value),
    ]
    if not is_domain:
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
    return str(value) if _is_signed(can_type) else f"0x{value:X}"


def _limits(entry: Entry) -> Iterator[tuple[str, str]]:
    if entry.type.is_real or entry.type.size is None or entry.type is CanType.BOOLEAN:
        return
    signed = _is_signed(entry.type)
    for key, limit in (
        ("LowLimit", None if entry.low is None else ceil(entry.low)),
        ("HighLimit", None if entry.high is None else floor(entry.high)),
    ):
        if limit is not None:
            yield key, str(limit) if signed else f"0x{limit:X}"


def _is_signed(can_type: CanType) -> bool:
    return can_type.name.startswith("INTEGER")
