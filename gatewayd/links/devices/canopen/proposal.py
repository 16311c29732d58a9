"""A mapping proposed from the data sheet of a CANopen device: what its PDOs carry as it is delivered. Pure.

| object | register of the robot, the next free one |
|---|---|
| BOOLEAN | bit |
| integers of up to 32 bits that an int32 holds | integer |
| UNSIGNED32, 64 bits, reals | double |

What the device sends (TPDOs) becomes inputs of the robot, what it takes (RPDOs) outputs.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.describe import object_text
from gatewayd.canopen.manager.data_sheet import DataSheet, DataSheetError, SheetObject
from gatewayd.canopen.manager.plan import MAX_PDO_BITS, ManagedPdo, PdoObject
from gatewayd.canopen.manager.sheet_text import decoded
from gatewayd.links.devices.canopen.plan import WORDS
from gatewayd.links.proposals import RemarkKind, SheetProposal, SheetReader, SheetRemark, SheetSettings
from gatewayd.report.format import counted

MAX_REGISTERS: Final = {"bit": 64, "int": 24, "double": 24}
"""Registers of each kind that no URCap claims; bits are those of two words."""
_DUMMY: Final = 0x1000
"""Below are data types, which stand in PDOs for gaps."""
_HEARTBEAT: Final = 0x1017
_FIRST_DEVICE_INDEX: Final = 0x2000
_MAX_LISTED: Final = 200
"""Objects in the comment at the end."""
_MAX_NAME: Final = 56
_INT32_HIGH: Final = (1 << 31) - 1
_SECTION: Final = re.compile(r"\s*\[\s*([0-9A-Fa-f]{4})(?:sub([0-9A-Fa-f]{1,2}))?\s*\]", re.IGNORECASE)
_PLAIN: Final = re.compile(r"[A-Za-z0-9_./-]+")


@dataclass(frozen=True, slots=True)
class _Carried:
    """An object in a PDO of the device."""

    pdo: ManagedPdo
    entry: SheetObject
    kind: CanType


@dataclass(slots=True)
class _Making:
    """A proposal in the making."""

    settings: SheetSettings
    lines: Mapping[tuple[int, int | None], int]
    """Line of each section: index, and sub-index or None."""
    remarks: list[SheetRemark] = field(default_factory=list)
    names: set[str] = field(default_factory=set)
    free: dict[tuple[str, str], int] = field(default_factory=dict)

    def line_of(self, index: int, subindex: int | None = None) -> int:
        return self.lines.get((index, subindex), self.lines.get((index, None), 1))

    def remark(self, line: int, kind: RemarkKind, text: str, hint: str = "") -> None:
        self.remarks.append(SheetRemark(line, kind, text, hint))


class EdsReader(SheetReader):
    """Reads EDS and DCF files (CiA 306)."""

    def propose(self, data: bytes, settings: SheetSettings) -> SheetProposal:
        """See SheetReader."""
        making = _Making(settings, _lines(decoded(data)))
        try:
            sheet = DataSheet(data, settings.node)
            carried = list(_carried(sheet, making))
        except DataSheetError as error:
            making.remark(1, RemarkKind.ERROR, str(error))
            return SheetProposal("", tuple(making.remarks), 0)
        variables = [line for each in carried if (line := _variable(each, making))]
        if not variables:
            text = "no PDO of the data sheet has an object that can become a variable"
            making.remark(1, RemarkKind.ERROR, text, "map objects by hand: docs/howto/canopen-devices.md")
        text = (
            "\n".join([*_head(sheet, making, carried), "variables:", *variables, *_others(sheet, carried)])
            + "\n"
        )
        remarks = tuple(sorted(making.remarks, key=lambda remark: remark.line))
        return SheetProposal(text if variables else "", remarks, len(variables))


def _carried(sheet: DataSheet, making: _Making) -> Iterator[_Carried]:
    """What can become a variable of what PDOs have, each object once in each direction."""
    known: set[tuple[bool, int, int]] = set()
    for pdo in sheet.pdos():
        line = making.line_of((0x1A00 if pdo.transmit else 0x1600) + pdo.number - 1)
        bits = sum(item.bits for item in pdo.objects)
        if bits > MAX_PDO_BITS:
            making.remark(line, RemarkKind.ERROR, f"{pdo.label} has {bits} bits, which no CAN frame carries")
            continue
        for item in pdo.objects:
            key = pdo.transmit, item.index, item.subindex
            at = object_text(item.index, item.subindex)
            if item.index < _DUMMY:
                making.remark(line, RemarkKind.NOTE, f"{pdo.label} has a gap of {counted(item.bits, 'bit')}")
                continue
            if key in known:
                making.remark(line, RemarkKind.NOTE, f"{at} is in {pdo.label} too; the first PDO is used")
                continue
            known.add(key)
            found = _usable(sheet, pdo, item, line, making)
            if found is not None:
                yield found


def _usable(
    sheet: DataSheet, pdo: ManagedPdo, item: PdoObject, line: int, making: _Making
) -> _Carried | None:
    at, entry = object_text(item.index, item.subindex), sheet.find(item.index, item.subindex)
    if entry is None:
        making.remark(line, RemarkKind.ERROR, f"{pdo.label} has {at}, which the data sheet does not describe")
        return None
    kind, where = entry.type, making.line_of(item.index, item.subindex)
    if kind is None or not kind.char:
        making.remark(
            where,
            RemarkKind.ERROR,
            f"{entry.text} in {pdo.label} is of the type {entry.code:04X}h, which no variable can have",
        )
        return None
    if kind.bits != item.bits:
        text = f"{at} has {counted(kind.bits, 'bit')}, and {counted(item.bits, 'bit')} in {pdo.label}"
        making.remark(line, RemarkKind.ERROR, text)
        return None
    if not pdo.transmit and not entry.writable:
        making.remark(where, RemarkKind.ERROR, f"{entry.text} is in {pdo.label}, and cannot be written")
        return None
    return _Carried(pdo, entry, kind)


def _variable(carried: _Carried, making: _Making) -> str:
    """The line of a variable; empty where the robot has no register for it."""
    entry, kind, pdo = carried.entry, carried.kind, carried.pdo
    side = "input" if pdo.transmit else "output"
    register = _register(kind)
    number = making.free.get((side, register), 0)
    making.free[side, register] = number + 1
    line = making.line_of(entry.index, entry.subindex)
    if number >= MAX_REGISTERS[register]:
        text = (
            f"{entry.text}: the robot has no {side}_{register}_register after {MAX_REGISTERS[register] - 1}"
        )
        making.remark(line, RemarkKind.ERROR, text)
        return ""
    if kind in (CanType.INTEGER64, CanType.UNSIGNED64):
        text = f"{entry.text} has 64 bits; a double holds whole numbers up to 2^53 exactly"
        making.remark(line, RemarkKind.DOUBT, text)
    place = [f"at: {making.settings.device}", f"object: 0x{entry.index:04X}"]
    place += [f"sub: {entry.subindex}"] if entry.subindex else []
    parts = [f"robot: {side}_{register}_register_{number}", f"device: {{{', '.join(place)}}}"]
    if pdo.transmit:
        parts += [f"owner: {making.settings.device}", "on_release: clear"]
    elif not kind.is_real and kind is not CanType.BOOLEAN and kind.bits <= 32:
        parts.append(f"limits: [{kind.bounds[0]}, {kind.bounds[1]}]")
    comment = f"{entry.name.strip()} ({WORDS[kind]}, {pdo.label})".strip()
    parts.append(f"comment: {json.dumps(comment, ensure_ascii=False)}")
    return f"  {_name(entry, making)}: {{{', '.join(parts)}}}"


def _register(kind: CanType) -> str:
    if kind is CanType.BOOLEAN:
        return "bit"
    return "int" if not kind.is_real and kind.bounds[1] <= _INT32_HIGH else "double"


def _name(entry: SheetObject, making: _Making) -> str:
    """Of the object's name, or of its address where that is none or taken."""
    plain = re.sub(r"[^a-z0-9]+", "_", entry.name.lower()).strip("_")[:_MAX_NAME].rstrip("_")
    address = f"object_{entry.index:04x}_{entry.subindex:02x}"
    name = plain if plain[:1].isalpha() and plain not in making.names else address
    while name in making.names:
        name += "_out"
    making.names.add(name)
    return name


def _head(sheet: DataSheet, making: _Making, carried: Sequence[_Carried]) -> Iterator[str]:
    settings = making.settings
    yield f"# Proposed by `gatewayd import eds` from {json.dumps(settings.path)}: what the PDOs of the device carry."
    yield "# From the device: inputs of the robot. From the robot: outputs. Look at registers, limits and on_release."
    yield ""
    yield "gatewayd: 1"
    yield f"cell: {_quoted(settings.cell)}"
    yield f"robot: {{host: {_quoted(settings.host)}}}"
    yield ""
    yield "devices:"
    yield f"  {settings.device}:"
    yield f"    canopen: {_quoted(settings.bus)}"
    yield f"    node: {settings.node}"
    yield f"    eds: {_quoted(settings.path)}"
    if sheet.find(_HEARTBEAT, 0) is not None:
        yield "    heartbeat: 500ms"
    else:
        text = "the device has no heartbeat (1017h): it is asked now and then, and its loss is noticed late"
        making.remark(1, RemarkKind.DOUBT, text)
        yield "    heartbeat: none"
    if any(not each.pdo.transmit for each in carried):
        text = "whether the device takes its outputs back when the gateway is lost no data sheet says"
        hint = "set it up (1016h, 6206h, 6207h and the like), and write its time for `watchdog: none`"
        making.remark(1, RemarkKind.DOUBT, text, hint)
        yield "    watchdog: none"
    yield ""
    if any(each.pdo.transmit for each in carried):
        yield "writers:"
        yield f"  {settings.device}: {{device: {settings.device}}}"
        yield ""


def _others(sheet: DataSheet, carried: Sequence[_Carried]) -> Iterator[str]:
    """Objects that could be mapped as well, as a comment."""
    known = {(each.entry.index, each.entry.subindex) for each in carried}
    others = [
        entry
        for entry in sheet.objects()
        if entry.index >= _FIRST_DEVICE_INDEX
        and (entry.index, entry.subindex) not in known
        and (entry.transmitted or entry.received)
        and entry.type in WORDS
    ]
    if not others:
        return
    yield ""
    yield "# Other objects that PDOs can carry; `pdo: N` at a variable lays one out, without it they go by SDO:"
    for entry in others[:_MAX_LISTED]:
        way = " and ".join(
            word for word, goes in (("from the device", entry.transmitted), ("to it", entry.received)) if goes
        )
        kind = WORDS[entry.type] if entry.type is not None else ""
        yield "#   " + " ".join(
            f"{object_text(entry.index, entry.subindex)} {kind}, {way}: {entry.name}".split()
        )
    if len(others) > _MAX_LISTED:
        yield f"#   and {len(others) - _MAX_LISTED} more"


def _lines(text: str) -> dict[tuple[int, int | None], int]:
    """Where each object has its section."""
    found: dict[tuple[int, int | None], int] = {}
    for number, line in enumerate(text.splitlines(), 1):
        match = _SECTION.match(line)
        if match is not None:
            key = int(match[1], 16), None if match[2] is None else int(match[2], 16)
            found.setdefault(key, number)
    return found


def _quoted(text: str) -> str:
    """A text as YAML takes it for one."""
    return text if _PLAIN.fullmatch(text) and not text[0].isdigit() else json.dumps(text, ensure_ascii=False)


SHEETS: Final = EdsReader()
"""Reads data sheets of CANopen devices."""
