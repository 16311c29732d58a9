"""Cells for tests of PLC programs on CANopen: from a few lines of a mapping, and one with every type and scale."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from itertools import groupby, product

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.sync import SyncPlan
from gatewayd.core.definition import CellDefinition, Direction, Lock, ValueKind, Variable, Writer
from gatewayd.links.canopen_node.pdo_layout import FIRST_INDEX, OBJECT_BASES, PDO_BITS
from gatewayd.links.canopen_node.plan import CanopenPlan, ObjectPlan, PdoEntry, PdoPlan
from gatewayd.links.canopen_node.plc.build import model_of
from gatewayd.links.canopen_node.plc.model import PdoModel
from gatewayd.links.canopen_node.status_words import field_word, quality_word
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan
from gatewayd.plc.tags import PlcWishes

HEAD = """\
gatewayd: 1
cell: line-2
robot: {host: 127.0.0.9, series: e}
canopen: {channel: can0, bitrate: 500000, node: 16%s}
writers: {plc: {canopen: rpdo, node: 1, heartbeat: 1s}}
variables:
"""
SCALES = ((1.0, 0.0), (0.1, 0.0), (-0.25, 3.0), (7.0, -100.0))
"""Scale and offset."""
STATUS_FIELDS = ("heartbeat", "fingerprint")
NODE = 5
NUMBERS = [kind for kind in CanType if kind.bits and kind is not CanType.BOOLEAN]
DUMMY = PdoEntry(None, 0x0005, 0, 8)


def plan_of(*lines: str, settings: str = "") -> Plan:
    """The plan of a mapping with these variables."""
    text = HEAD % settings + "".join(f"  {line}\n" for line in lines)
    loaded = load(text.encode(), "folder/line-2.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def model(*lines: str, settings: str = "", wishes: PlcWishes | None = None) -> PdoModel:
    """What the PLC needs of it."""
    return model_of(plan_of(*lines, settings=settings), wishes or PlcWishes())


def complete_plan() -> Plan:
    """Every type with every scale, in both directions, as integers and reals of the robot, at any byte; and bits.

    Numbers are shuffled, so that they begin at odd bytes too; one RPDO has a gap; one TPDO has words of the status.
    """
    variables: list[Variable] = []
    objects: list[ObjectPlan] = []
    for direction in Direction:
        for can_type, (scale, offset), kind in product(NUMBERS, SCALES, (ValueKind.INT, ValueKind.FLOAT)):
            linear = None if (scale, offset) == (1, 0) else (scale, offset)
            _add(variables, objects, direction, kind, (can_type, linear))
        _add(variables, objects, direction, ValueKind.BOOL, (CanType.UNSIGNED8, None))
        for _bit in range(19):
            _add(variables, objects, direction, ValueKind.BOOL, (CanType.BOOLEAN, None))
    inputs = [variable for variable in variables if variable.direction is Direction.INPUT]
    locks = tuple(Lock(variable.name, (variable.number - 1,), (0,)) for variable in inputs)
    cell = CellDefinition("complete", 0x12345678, tuple(variables), locks, (Writer("line"),), 0.1)
    node = CanopenPlan(
        interface="virtual",
        channel="test",
        bitrate=500_000,
        node=NODE,
        autostart=True,
        heartbeat=0,
        sync=SyncPlan(),
        consumers=(),
        objects=tuple(objects),
        pdos=tuple(_pdos(objects, variables)),
        rpdo_writer=0,
        sdo_writer=None,
    )
    return Plan("complete.yaml", cell, {"canopen": node})


def _add(
    variables: list[Variable],
    objects: list[ObjectPlan],
    direction: Direction,
    kind: ValueKind,
    on_the_bus: tuple[CanType, tuple[float, float] | None],
) -> None:
    can_type, linear = on_the_bus
    number = len(variables) + 1
    low, high = (-(1 << 31), (1 << 31) - 1) if kind is ValueKind.INT else (None, None)
    lock = number - 1 if direction is Direction.INPUT else None
    field = "input_bit_register_64" if direction is Direction.INPUT else "output_bit_register_64"
    variables.append(Variable(number, f"v{number}", direction, kind, field, low=low, high=high, lock=lock))
    index = FIRST_INDEX[direction] + OBJECT_BASES[can_type]
    subindex = 1 + sum(item.index == index for item in objects)
    objects.append(ObjectPlan(number - 1, index, subindex, can_type, linear))


def _pdos(objects: Sequence[ObjectPlan], variables: Sequence[Variable]) -> Iterator[PdoPlan]:
    for direction, its in groupby(objects, key=lambda item: variables[item.variable].direction):
        mine = list(its)
        bits = [item for item in mine if item.type is CanType.BOOLEAN]
        groups = [[_entry(item)] for item in mine if item.type is not CanType.BOOLEAN]
        groups += [list(map(_entry, bits[:8])), list(map(_entry, bits[8:16]))]
        if direction is Direction.INPUT:
            groups.append([DUMMY])
        random.Random(3).shuffle(groups)
        contents = [*_filled(groups), list(map(_entry, bits[16:]))]
        if direction is Direction.OUTPUT:
            contents.append(_status(variables))
        for number, entries in enumerate(contents, 1):
            # The node is alone on its bus: COB-IDs are as good as any.
            cob_id = (0x180 if direction is Direction.OUTPUT else 0x280) + number
            yield PdoPlan(number, direction, cob_id, False, 255, 0, 0, tuple(entries))


def _entry(item: ObjectPlan) -> PdoEntry:
    return PdoEntry(item.variable, item.index, item.subindex, item.type.bits)


def _filled(groups: Sequence[list[PdoEntry]]) -> Iterator[list[PdoEntry]]:
    content: list[PdoEntry] = []
    for group in groups:
        if sum(entry.bits for entry in (*content, *group)) > PDO_BITS:
            yield content
            content = []
        content = [*content, *group]
    yield content


def _status(variables: Sequence[Variable]) -> list[PdoEntry]:
    last = len(variables) - 1
    words = [*map(field_word, STATUS_FIELDS), quality_word(last, variables[last].name)]
    return [PdoEntry(None, word.index, word.subindex, word.type.bits, word.quality_of) for word in words]
