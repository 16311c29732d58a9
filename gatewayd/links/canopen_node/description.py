"""The plan of a CANopen node in words."""

from __future__ import annotations

from gatewayd.canopen.heartbeat import Consumer
from gatewayd.canopen.sync import SyncPlan
from gatewayd.core.definition import CellDefinition
from gatewayd.links.canopen_node.plan import CanopenPlan, ObjectPlan, PdoEntry, PdoPlan
from gatewayd.links.contract import Description, Place

__all__ = ["description"]


def description(plan: CanopenPlan, cell: CellDefinition) -> Description:
    """Settings, and the object of each variable with the PDO that carries it."""
    cob_ids = {entry.variable: pdo.cob_id for pdo in plan.pdos for entry in pdo.entries}
    places: dict[int, list[Place]] = {}
    for placed in plan.objects:
        places.setdefault(placed.variable, []).append(_place(placed, cob_ids.get(placed.variable)))
    channel = f"{plan.interface}:{plan.channel}"
    return Description(
        settings={
            "interface": plan.interface,
            "channel": plan.channel,
            "bitrate": str(plan.bitrate),
            "node": str(plan.node),
            "autostart": _flag(plan.autostart),
            "heartbeat": str(plan.heartbeat),
            "sync": _sync(plan.sync),
            "consumers": "; ".join(_consumer(consumer, cell) for consumer in plan.consumers),
            "pdos": "; ".join(_pdo(pdo, cell) for pdo in plan.pdos),
            "rpdo_writer": _writer(plan.rpdo_writer, cell),
            "sdo_writer": _writer(plan.sdo_writer, cell),
        },
        places=places,
        address=channel,
        fields={"channel": channel, "node": plan.node},
    )


def _place(placed: ObjectPlan, cob_id: int | None) -> Place:
    name = f"{placed.index:04X}h:{placed.subindex:02X}"
    return Place(
        text=f"{placed.index:04X}h sub {placed.subindex} {placed.type.name.lower()}",
        fields={"object": name, "type": placed.type.name, "cob_id": cob_id},
        area="object",
        address=name,
        notation="by SDO" if cob_id is None else f"COB-ID 0x{cob_id:03X}",
        type=placed.type.name,
    )


def _sync(sync: SyncPlan) -> str:
    return _parts(
        ("cob_id", str(sync.cob_id)),
        ("producer", _flag(sync.producer)),
        ("period", str(sync.period)),
        ("counter", str(sync.counter)),
    )


def _consumer(consumer: Consumer, cell: CellDefinition) -> str:
    return _parts(
        ("node", str(consumer.node)),
        ("timeout", str(consumer.timeout)),
        ("writer", _writer(consumer.writer, cell)),
    )


def _pdo(pdo: PdoPlan, cell: CellDefinition) -> str:
    return _parts(
        ("number", str(pdo.number)),
        ("direction", pdo.direction.value),
        ("cob_id", str(pdo.cob_id)),
        ("predefined", _flag(pdo.predefined)),
        ("transmission", str(pdo.transmission)),
        ("inhibit", str(pdo.inhibit)),
        ("event", str(pdo.event)),
        ("entries", "; ".join(_entry(entry, cell) for entry in pdo.entries)),
        ("sync_start", str(pdo.sync_start)),
        ("name", pdo.name),
    )


def _entry(entry: PdoEntry, cell: CellDefinition) -> str:
    return _parts(
        ("variable", "none" if entry.variable is None else cell.variables[entry.variable].name),
        ("index", str(entry.index)),
        ("subindex", str(entry.subindex)),
        ("bits", str(entry.bits)),
        ("quality_of", "" if entry.quality_of is None else cell.variables[entry.quality_of].name),
    )


def _parts(*parts: tuple[str, str]) -> str:
    """`number=1 direction=input`, without what is empty."""
    return " ".join(f"{name}={text}" for name, text in parts if text)


def _writer(writer: int | None, cell: CellDefinition) -> str:
    return "none" if writer is None else cell.writers[writer].name


def _flag(flag: bool) -> str:
    return str(flag).lower()
