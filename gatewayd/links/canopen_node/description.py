"""The plan of a CANopen node in words."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, Final

from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.links.canopen_node.plan import CanopenPlan, IdentityPlan, ObjectPlan, PdoEntry, PdoPlan
from gatewayd.links.contract import Description, Place
from gatewayd.report.format import exact


def description(plan: CanopenPlan, cell: CellDefinition) -> Description:
    """Settings, and the object of each variable with the PDO that carries it."""
    cob_ids = {entry.variable: pdo.cob_id for pdo in plan.pdos for entry in pdo.entries}
    places: dict[int, list[Place]] = {}
    for placed in plan.objects:
        places.setdefault(placed.variable, []).append(_place(placed, cob_ids.get(placed.variable)))
    channel = f"{plan.interface}:{plan.channel}"
    settings = by_name(plan, cell)
    del settings["objects"]  # `places` has them
    del settings["pdos"]
    settings |= {_pdo_name(pdo): _pdo_text(pdo, cell) for pdo in plan.pdos}
    return Description(settings, places, address=channel, fields={"channel": channel, "node": plan.node})


_IDENTITY: Final = frozenset(field.name for field in fields(IdentityPlan))


def by_name(part: Any, cell: CellDefinition) -> dict[str, str]:
    """Each field of a plan, or of a part of one, as text, with names in place of the numbers of variables and writers.

    Two nodes whose texts are equal are the same one for the bus, whatever else their mappings say.
    """
    return {field.name: _text(field.name, getattr(part, field.name), cell) for field in fields(part)}


def _pdo_name(pdo: PdoPlan) -> str:
    return f"{'RPDO' if pdo.direction is Direction.INPUT else 'TPDO'} {pdo.number}"


def _pdo_text(pdo: PdoPlan, cell: CellDefinition) -> str:
    """`COB-ID 0x185 by the node-ID, transmission 254, inhibit 5 ms: speed 2410h:01/32, force 2410h:02/32`."""
    event = "event" if pdo.direction is Direction.OUTPUT else "deadline"
    words = (
        pdo.name,
        f"COB-ID 0x{pdo.cob_id:03X}" + (" by the node-ID" if pdo.predefined else ""),
        f"transmission {pdo.transmission}",
        f"inhibit {exact(pdo.inhibit / 10)} ms" if pdo.inhibit else "",
        f"{event} {pdo.event} ms" if pdo.event else "",
        f"SYNC start {pdo.sync_start}" if pdo.sync_start else "",
        f"writer {cell.writers[pdo.writer].name}" if pdo.writer is not None else "",
    )
    content = ", ".join(_entry_text(entry, cell) for entry in pdo.entries)
    return f"{', '.join(filter(None, words))}: {content or 'nothing'}"


def _entry_text(entry: PdoEntry, cell: CellDefinition) -> str:
    """Object and size, with the variable that it is or whose quality it tells."""
    words = (
        cell.variables[entry.variable].name if entry.variable is not None else "",
        f"quality of {cell.variables[entry.quality_of].name}" if entry.quality_of is not None else "",
        f"{entry.index:04X}h:{entry.subindex:02X}/{entry.bits}",
    )
    return " ".join(filter(None, words))


def _place(placed: ObjectPlan, cob_id: int | None) -> Place:
    name = f"{placed.index:04X}h:{placed.subindex:02X}"
    scale, offset = placed.linear or (1.0, 0.0)
    return Place(
        text=f"{placed.index:04X}h sub {placed.subindex} {placed.type_text.lower()}",
        fields={"object": name, "type": placed.type.name, "scale": scale, "offset": offset, "cob_id": cob_id},
        area="object",
        address=name,
        notation="by SDO" if cob_id is None else f"COB-ID 0x{cob_id:03X}",
        type=placed.type_text,
    )


def _text(key: str, value: Any, cell: CellDefinition) -> str:
    if value is None:
        return "" if key == "quality_of" or key in _IDENTITY else "none"
    if key in ("variable", "quality_of"):
        return str(cell.variables[value].name)
    if key in ("writer", "rpdo_writer", "sdo_writer"):
        return str(cell.writers[value].name)
    if key in _IDENTITY and isinstance(value, int):
        return f"0x{value:08X}"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Direction):
        return value.value
    if isinstance(value, tuple):
        return "; ".join(_parts(item, cell) if is_dataclass(item) else str(item) for item in value)
    return _parts(value, cell) if is_dataclass(value) else str(value)


def _parts(part: Any, cell: CellDefinition) -> str:
    """`number=1 direction=input`, without what is empty."""
    return " ".join(f"{name}={text}" for name, text in by_name(part, cell).items() if text)
