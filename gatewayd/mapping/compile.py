"""From an expanded cell without errors to the one immutable plan that core and links work from.

Deterministic: the same mapping gives an equal plan, whatever its comments and formatting.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable
from enum import Enum
from ipaddress import IPv4Network, IPv6Network
from typing import Any, Final

from gatewayd.canopen.heartbeat import Consumer
from gatewayd.canopen.sync import SyncPlan
from gatewayd.core.definition import (
    CellDefinition,
    Direction,
    Fallback,
    FallbackKind,
    Limits,
    Lock,
    Value,
    ValueKind,
    Variable,
    Writer,
)
from gatewayd.links.canopen_node.expand import CanopenCell, ConcretePdo
from gatewayd.links.canopen_node.plan import CanopenPlan, PdoEntry, PdoPlan
from gatewayd.links.modbus_server.plan import ModbusPlan, Network, Placement
from gatewayd.links.modbus_server.sections import Modbus
from gatewayd.links.robot.plan import RobotPlan, WatchdogPlan
from gatewayd.links.robot.sections import ADOPT_FOR, Robot
from gatewayd.mapping.expand import ConcreteVariable, ExpandedCell
from gatewayd.mapping.model import WriterSpec
from gatewayd.mapping.plan import LinkPlan, Plan
from gatewayd.mapping.shown import Shown, shown_of
from gatewayd.modbus.codec import Codec
from gatewayd.rtde.catalogue import Series

__all__ = ["PROGRAM_STATE", "compile_plan", "fingerprint", "package_period"]

_STALE_PERIODS: Final = 5
_LEAST_STALE_AFTER: Final = 0.1
_CASTS: Final[dict[ValueKind, Callable[[Value], Value]]] = {
    ValueKind.BOOL: bool,
    ValueKind.INT: round,
    ValueKind.FLOAT: float,
}
_TIMESTAMP: Final = "timestamp"
PROGRAM_STATE: Final = "runtime_state"
"""The field that says whether the robot program runs."""


def compile_plan(cell: ExpandedCell) -> Plan:
    """Compile a cell that passed all rules; ValueError for one with parts that could not be read or expanded."""
    document = cell.document
    if document.robot is None or not document.cell or not cell.is_complete:
        raise ValueError(f"{document.source.name} has errors and cannot be compiled")
    robot = document.robot.spec
    writers = {name: index for index, name in enumerate(document.writers)}
    definition = CellDefinition(
        name=document.cell,
        fingerprint=0,
        variables=tuple(map(_variable, cell.variables, shown_of(cell))),
        locks=tuple(
            Lock(
                lock.name,
                lock.members,
                tuple(writers[name] for name in lock.owners),
                lock.takeover,
                lock.lease,
                lock.whole,
            )
            for lock in cell.locks
        ),
        writers=tuple(_writer(name, part.spec) for name, part in document.writers.items()),
        stale_after=robot.stale_after or max(_STALE_PERIODS * package_period(robot), _LEAST_STALE_AFTER),
        clear_on_connect=robot.on_connect == "fallback",
        adopt_for=robot.adopt_for,
    )
    modbus = _modbus(cell, document.modbus.spec) if document.modbus is not None else None
    canopen = _canopen(cell, cell.canopen) if cell.canopen is not None else None
    links: dict[str, LinkPlan | None] = {
        "robot": _robot(cell, robot, writers),
        "modbus": modbus,
        "canopen": canopen,
    }
    present = {name: link for name, link in links.items() if link is not None}
    plan = Plan(document.source.name, definition, present)
    return dataclasses.replace(plan, cell=dataclasses.replace(definition, fingerprint=fingerprint(plan)))


def package_period(robot: Robot) -> float:
    """Seconds between output packages: the controller divides its base rate by a whole number.

    Where the series is not known the slowest that may answer counts: CB3 with 125 Hz for its own rate.
    """
    if robot.frequency == 0:
        return 1 / (Series.from_word(robot.series) if robot.series is not None else Series.CB3).base_rate
    if robot.series is None:
        return 1 / robot.frequency
    base = Series.from_word(robot.series).base_rate
    return max(int(base / robot.frequency), 1) / base


def _variable(variable: ConcreteVariable, shown: Shown) -> Variable:
    spec, kind = variable.spec, variable.kind
    is_input = variable.direction is Direction.INPUT
    return Variable(
        number=variable.index + 1,
        name=variable.name,
        direction=variable.direction,
        kind=kind,
        field=variable.field.name,
        bit=variable.bit,
        element=variable.element,
        low=variable.low,
        high=variable.high,
        limits=Limits(*spec.limits, spec.clamp) if spec.limits is not None else None,
        on_stale=Fallback() if is_input else _fallback(spec.on_stale, kind),
        on_release=_fallback(spec.on_release, kind) if is_input else Fallback(),
        lock=variable.lock,
        deadband=spec.deadband,
        unit=spec.unit,
        comment=spec.comment,
        shown=shown.bounds,
        shows_nan=shown.nan,
        valid_running=variable.valid_running,
    )


def _writer(name: str, spec: WriterSpec) -> Writer:
    return Writer(
        name,
        timeout=spec.timeout,
        grace=spec.grace or 0.0,
        counts_writes=spec.timeout_counts == "writes",
        heartbeat=spec.heartbeat if spec.node is not None else None,
    )


def _fallback(fallback: Fallback, kind: ValueKind) -> Fallback:
    if fallback.value is None:
        return fallback
    value: Value = _CASTS[kind](fallback.value)
    return Fallback(FallbackKind.VALUE, value)


def _robot(cell: ExpandedCell, robot: Robot, writers: dict[str, int]) -> RobotPlan:
    watchdog = robot.watchdog
    return RobotPlan(
        host=robot.host,
        port=robot.port,
        frequency=robot.frequency,
        outputs=tuple(name for name in _subscribed(cell) if name != _TIMESTAMP),
        inputs=_fields(cell, Direction.INPUT),
        verify=robot.verify,
        watchdog=None
        if watchdog is None
        else WatchdogPlan(
            watchdog.field,
            watchdog.frequency,
            tuple(writers[name] for name in dict.fromkeys(watchdog.requires or ())),
        ),
    )


def _subscribed(cell: ExpandedCell) -> tuple[str, ...]:
    """Fields of outputs, and what says whether the program runs where the quality of one hangs on it."""
    fields = _fields(cell, Direction.OUTPUT)
    if not any(variable.valid_running for variable in cell.variables):
        return fields
    return tuple(dict.fromkeys((*fields, PROGRAM_STATE)))


def _fields(cell: ExpandedCell, direction: Direction) -> tuple[str, ...]:
    names = (variable.field.name for variable in cell.variables if variable.direction is direction)
    return tuple(dict.fromkeys(names))


def _modbus(cell: ExpandedCell, modbus: Modbus) -> ModbusPlan:
    peers = [
        (network, index)
        for index, writer in enumerate(cell.document.writers.values())
        for network in writer.spec.modbus
    ]
    return ModbusPlan(
        host=modbus.listen.host,
        port=modbus.listen.port,
        unit=modbus.unit,
        allow=modbus.allow,
        connections=modbus.connections,
        idle_timeout=modbus.idle_timeout,
        fill_gaps=modbus.gaps == "zero",
        placements=tuple(
            Placement(placed.variable.index, placed.area, placed.address, placed.bit, placed.codec)
            for placed in cell.placements
        ),
        writers=tuple(sorted(peers, key=lambda peer: (_host_bits(peer[0]), peer[0].version, str(peer[0])))),
    )


def _host_bits(network: Network) -> int:
    return network.max_prefixlen - network.prefixlen


def _canopen(cell: ExpandedCell, node: CanopenCell) -> CanopenPlan:
    spec = node.part.spec
    writers = [part.spec for part in cell.document.writers.values()]
    return CanopenPlan(
        interface=spec.interface,
        channel=spec.channel,
        bitrate=spec.bitrate,
        node=spec.node,
        autostart=spec.autostart,
        heartbeat=_ticks(spec.heartbeat, 1000),
        sync=SyncPlan(
            spec.sync.cob_id, spec.sync.producer, _ticks(spec.sync.period, 1_000_000), spec.sync.counter
        ),
        consumers=tuple(
            Consumer(writer.node, _ticks(writer.heartbeat, 1000), index)
            for index, writer in enumerate(writers)
            if writer.node is not None and writer.heartbeat is not None
        ),
        objects=tuple(one.plan for one in node.objects),
        pdos=tuple(_pdo(pdo) for pdo in node.pdos),
        rpdo_writer=next((index for index, writer in enumerate(writers) if writer.by_rpdo), None),
        sdo_writer=next((index for index, writer in enumerate(writers) if writer.by_sdo), None),
    )


def _pdo(pdo: ConcretePdo) -> PdoPlan:
    assert pdo.slot.cob_id is not None
    return PdoPlan(
        number=pdo.slot.number,
        direction=pdo.direction,
        cob_id=pdo.slot.cob_id,
        predefined=pdo.slot.predefined,
        transmission=pdo.transmission,
        inhibit=_ticks(pdo.inhibit, 10_000),
        event=_ticks(pdo.event, 1000),
        entries=(
            *(
                PdoEntry(None, word.index, word.subindex, word.type.bits, word.quality_of)
                for word in pdo.status
            ),
            *(
                PdoEntry(one.variable, one.plan.index, one.plan.subindex, one.plan.type.bits)
                for one in pdo.entries
            ),
        ),
        sync_start=pdo.sync_start,
        name=pdo.name,
    )


def _ticks(seconds: float | None, per_second: int) -> int:
    """A time as CANopen counts it; 0 for none."""
    return 0 if seconds is None else round(seconds * per_second)


_FOR_PEOPLE: Final = frozenset({"comment", "source", "fingerprint"})
_DERIVED: Final = {
    Variable: frozenset({"shown", "shows_nan"}),
    Writer: frozenset({"heartbeat"}),
}
"""Fields that follow from others, which count: places, and the consumers of CANopen."""
_DEFAULTS: Final = {(CellDefinition, "adopt_for"): ADOPT_FOR}
"""What a field is where the file says nothing, as far as the core's default is another."""
_CODEC_MEANING: Final = ("type", "order", "scale", "offset")


def fingerprint(plan: Plan) -> int:
    """32 bits of what the plan means: everything but the comments and the path of the file.

    Keys that stand at their default do not count, so that later versions of gatewayd can add some without
    changing the fingerprint of the mappings that do not use them.
    """
    text = json.dumps(_meaning(plan), sort_keys=True, separators=(",", ":"))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")


def _meaning(thing: Any) -> Any:
    match thing:
        case Plan():
            # A cell without Modbus has always counted as one whose `modbus` is null.
            return {"cell": _meaning(thing.cell), "modbus": None} | {
                name: _meaning(link) for name, link in thing.links.items()
            }
        case Codec():
            return [getattr(thing, name) for name in _CODEC_MEANING]
        case Enum():
            return thing.name
        case IPv4Network() | IPv6Network():
            return str(thing)
        case tuple():
            return [_meaning(item) for item in thing]
    if not dataclasses.is_dataclass(thing):
        return thing
    return {
        name: _meaning(value)
        for name, default in _fields_of(type(thing))
        if (value := getattr(thing, name)) is not default and value != default
    }


_known_fields: dict[type, tuple[tuple[str, Any], ...]] = {}


def _fields_of(kind: type[Any]) -> tuple[tuple[str, Any], ...]:
    """Names and defaults of the fields that carry meaning."""
    if kind not in _known_fields:
        without = _FOR_PEOPLE | _DERIVED.get(kind, frozenset())
        _known_fields[kind] = tuple(
            (field.name, _DEFAULTS.get((kind, field.name), field.default))
            for field in dataclasses.fields(kind)
            if field.name not in without
        )
    return _known_fields[kind]
