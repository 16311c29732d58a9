"""A cell with one of everything and what lies around its PDOs, without a node and without time of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import (
    Abort,
    AbortCode,
    Access,
    Dictionary,
    Entry,
    Object,
    Pdo,
    array,
)
from gatewayd.canopen.frame import Frame, Priority
from gatewayd.canopen.sync import SyncPlan
from gatewayd.core.cell import Cell
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
from gatewayd.links.canopen_node.pdo.codec import Layout, Mapped
from gatewayd.links.canopen_node.pdo.parameters import Configuration, PdoTable
from gatewayd.links.canopen_node.plan import CanopenPlan, ObjectPlan, PdoEntry, PdoPlan

NOW = 1000.0
NODE = 5
LINE = 0
"""The writer that RPDOs are."""
PLC = 1

KINDS = {
    "bit": (ValueKind.BOOL, CanType.BOOLEAN, 0),
    "int": (ValueKind.INT, CanType.INTEGER32, 1),
    "real": (ValueKind.FLOAT, CanType.REAL64, 2),
    "short": (ValueKind.INT, CanType.INTEGER16, 3),
    "single": (ValueKind.FLOAT, CanType.REAL32, 4),
}
"""Name of the variables -> their kind, their type on the bus, and the offset of their object."""
COUNTS = {"bit": 64, "int": 24, "real": 24, "short": 4, "single": 8}
INPUTS, OUTPUTS = 0x2000, 0x2400


def draw() -> tuple[list[Variable], list[ObjectPlan]]:
    """Inputs, then outputs: in_bit_0 .. in_single_7, out_bit_0 .. out_single_7."""
    variables: list[Variable] = []
    objects: list[ObjectPlan] = []
    for direction, prefix, base in ((Direction.INPUT, "in", INPUTS), (Direction.OUTPUT, "out", OUTPUTS)):
        for name, (kind, can_type, offset) in KINDS.items():
            for position in range(COUNTS[name]):
                index = len(variables)
                variables.append(
                    Variable(
                        number=index + 1,
                        name=f"{prefix}_{name}_{position}",
                        direction=direction,
                        kind=kind,
                        field=f"{prefix}_{name}_{position}",
                        low=-(2**31) if kind is ValueKind.INT else None,
                        high=2**31 - 1 if kind is ValueKind.INT else None,
                        lock=index if direction is Direction.INPUT else None,
                    )
                )
                objects.append(ObjectPlan(index, base + offset, position + 1, can_type))
    return variables, objects


@dataclass
class Bench:
    """The cell, the dictionary, the PDO table, and what was sent and reported."""

    variables: list[Variable]
    objects: list[ObjectPlan]
    cell: Cell
    configurations: dict[tuple[Direction, int], Configuration | None] = field(default_factory=dict)
    changes: int = 0
    sent: list[Frame] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.by_name = {variable.name: index for index, variable in enumerate(self.variables)}

    def send(self, frame: Frame, priority: Priority) -> bool:
        assert priority is Priority.NEWEST
        self.sent.append(frame)
        return True

    def take(self) -> list[str]:
        """What was sent since the last call, as `185:01020304`."""
        sent, self.sent = self.sent, []
        return [f"{frame.can_id:x}:{frame.data.hex()}" for frame in sent]

    def show(self, **values: Value) -> None:
        for name, value in values.items():
            self.cell.image.values[self.by_name[name]] = value

    def value(self, name: str) -> Value:
        return self.cell.image.values[self.by_name[name]]

    def entry(self, name: str) -> PdoEntry:
        """The mapping entry of a variable, or of a dummy like `dummy_5`."""
        prefix, _, number = name.partition("_")
        if prefix == "dummy":
            dummy = next(one for one in CanType if one.code == int(number))
            return PdoEntry(None, dummy.code, 0, dummy.bits)
        one = self.objects[self.by_name[name]]
        return PdoEntry(one.variable, one.index, one.subindex, one.type.bits)

    def configuration(
        self,
        names: Iterable[str],
        *,
        number: int = 1,
        can_id: int = 0x185,
        transmission: int = 255,
        inhibit: float = 0.0,
        event: float = 0.0,
        sync_start: int = 0,
    ) -> Configuration:
        mapping = tuple(self.mapped(name) for name in names)
        layout = Layout(mapping, self.variables)
        return Configuration(number, can_id, transmission, mapping, layout, inhibit, event, sync_start)

    def mapped(self, name: str) -> Mapped:
        entry = self.entry(name)
        if entry.variable is None:
            return Mapped(None, next(one for one in CanType if one.code == entry.index))
        return Mapped(entry.variable, self.objects[entry.variable].type)

    def table(self, *pdos: PdoPlan) -> PdoTable:
        """The PDO table of a node, in a dictionary with the variables; fills `dictionary`."""
        plan = CanopenPlan(
            interface="virtual",
            channel="test",
            bitrate=500_000,
            node=NODE,
            autostart=False,
            heartbeat=0,
            sync=SyncPlan(),
            consumers=(),
            objects=tuple(self.objects),
            pdos=pdos,
            rpdo_writer=LINE,
            sdo_writer=None,
        )
        table = PdoTable(
            plan,
            self.variables,
            self._find,
            self._changed,
        )
        self.dictionary = Dictionary([*table.objects(), *self._variable_objects()])
        return table

    def pdo(self, direction: Direction, number: int, *names: str, **more: int) -> PdoPlan:
        """A PDO of a plan, at its predefined COB-ID unless one is given."""
        plan = PdoPlan(
            number=number,
            direction=direction,
            cob_id=0,
            predefined="cob_id" not in more and number <= 4,
            transmission=255,
            inhibit=0,
            event=0,
            entries=tuple(self.entry(name) for name in names),
        )
        return replace(plan, **more)  # type: ignore[arg-type]  # fields with integers

    def write(self, index: int, subindex: int, value: int) -> AbortCode | None:
        """Download by SDO; returns the abort code."""
        size = self.dictionary.entry(index, subindex).type.size
        assert size is not None
        try:
            self.dictionary.write(index, subindex, value.to_bytes(size, "little"))
        except Abort as abort:
            return abort.code
        return None

    def read(self, index: int, subindex: int) -> int:
        return int.from_bytes(self.dictionary.read(index, subindex), "little")

    def _find(self, index: int, subindex: int) -> Entry:
        return self.dictionary.entry(index, subindex)

    def _changed(self, direction: Direction, number: int, configuration: Configuration | None) -> None:
        self.changes += 1
        self.configurations[direction, number] = configuration

    def _variable_objects(self) -> list[Object]:
        by_index: dict[int, list[Entry]] = {}
        for one in self.objects:
            is_output = self.variables[one.variable].direction is Direction.OUTPUT
            entry = Entry(
                one.subindex,
                self.variables[one.variable].name,
                one.type,
                Access.RO if is_output else Access.RWW,
                pdo=Pdo.TRANSMIT if is_output else Pdo.RECEIVE,
            )
            by_index.setdefault(one.index, []).append(entry)
        unmappable = Entry(1, "not mappable", CanType.UNSIGNED32, Access.RW)
        return [
            *(array(index, f"{index:x}", entries) for index, entries in by_index.items()),
            array(0x5F00, "status", [unmappable]),
        ]


def make_bench(**changes: object) -> Bench:
    """A bench with the robot connected; `changes` are fields of single variables, as `out_real_0={"deadband": 0.5}`."""
    variables, objects = draw()
    for name, fields in changes.items():
        index = next(index for index, variable in enumerate(variables) if variable.name == name)
        variables[index] = replace(variables[index], **fields)  # type: ignore[arg-type]  # a dict of fields
    locks = [
        Lock(variable.name, (index,), (LINE, PLC))
        for index, variable in enumerate(variables)
        if variable.direction is Direction.INPUT
    ]
    definition = CellDefinition(
        name="test",
        fingerprint=1,
        variables=tuple(variables),
        locks=tuple(locks),
        writers=(Writer("line"), Writer("plc")),
        stale_after=0.1,
    )
    cell = Cell(definition)
    cell.robot_connected(NOW)
    cell.adopt({}, NOW)
    cell.package_arrived(1.0, NOW)
    cell.outputs_written(NOW)
    return Bench(variables, objects, cell)


@pytest.fixture(scope="session")
def new_bench() -> Callable[..., Bench]:
    """Makes benches; see `make_bench`."""
    return make_bench


@pytest.fixture(scope="session")
def shared_bench() -> Bench:
    """For properties that make tables of their own on it again and again."""
    return make_bench()


@pytest.fixture
def bench() -> Bench:
    return make_bench()


@pytest.fixture
def guarded_bench() -> Bench:
    """`out_int_0` may not be read while it is not good."""
    return make_bench(out_int_0={"on_stale": Fallback(FallbackKind.EXCEPTION)})


@pytest.fixture
def limited_bench() -> Bench:
    """`in_int_0` has limits."""
    return make_bench(in_int_0={"limits": Limits(-10, 10)})
