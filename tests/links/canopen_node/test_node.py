"""One node over one cell, frame by frame: what its services do together."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace
from datetime import UTC, datetime
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.heartbeat import Consumer
from gatewayd.canopen.identity import revision
from gatewayd.canopen.nmt import UNCONFIGURED, NmtState
from gatewayd.canopen.product import PRODUCT_CODE
from gatewayd.canopen.sync import SyncPlan
from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Lock, Value, ValueKind, Variable, Writer
from gatewayd.core.refusal import Reason
from gatewayd.core.requester import Requester, new_connection
from gatewayd.core.succession import succeed
from gatewayd.links.canopen_node.communication_errors import OVERRUN_TIME
from gatewayd.links.canopen_node.continuity import goes_on
from gatewayd.links.canopen_node.node import Node
from gatewayd.links.canopen_node.observer import Observer
from gatewayd.links.canopen_node.plan import (
    GUARDING,
    CanopenPlan,
    IdentityPlan,
    ObjectPlan,
    PdoEntry,
    PdoPlan,
    canopen_of,
)
from gatewayd.links.canopen_node.status_words import HEADER
from gatewayd.links.canopen_node.store import Saved, Store
from gatewayd.mapping.loader import load
from tests.links.canopen_node.wire import Wire

NODE = 5
MASTER = 1
LINE, TOOL = 0, 1
PART, SPEED, CYCLES, FORCE = range(4)
START = bytes([1, 0])
STOP = bytes([2, 0])
PRE_OPERATIONAL = bytes([128, 0])
RESET_NODE = bytes([129, 0])
RESET_COMMUNICATION = bytes([130, 0])
BOOT_UP = Frame(0x705, b"\0")

_VARIABLES = (
    Variable(
        1,
        "part",
        Direction.INPUT,
        ValueKind.INT,
        "input_int_register_0",
        low=-(2**31),
        high=2**31 - 1,
        lock=0,
    ),
    Variable(2, "speed", Direction.INPUT, ValueKind.FLOAT, "input_double_register_0", lock=1),
    Variable(3, "cycles", Direction.OUTPUT, ValueKind.INT, "output_int_register_0"),
    Variable(4, "force", Direction.OUTPUT, ValueKind.FLOAT, "output_double_register_0"),
)
_CELL = CellDefinition(
    "press-3",
    0xCAFE_F00D,
    _VARIABLES,
    (Lock("part", (PART,), (LINE, TOOL)), Lock("speed", (SPEED,), (LINE, TOOL))),
    (Writer("line"), Writer("tool")),
    0.1,
)
_OBJECTS = (
    ObjectPlan(PART, 0x2001, 1, CanType.INTEGER32),
    ObjectPlan(SPEED, 0x2002, 1, CanType.REAL32),
    ObjectPlan(CYCLES, 0x2401, 1, CanType.INTEGER32),
    ObjectPlan(FORCE, 0x2402, 1, CanType.REAL32),
)


def _pdo(number: int, direction: Direction, one: ObjectPlan, transmission: int, event: int = 0) -> PdoPlan:
    base = 0x100 + 0x100 * number if direction is Direction.INPUT else 0x80 + 0x100 * number
    entry = PdoEntry(one.variable, one.index, one.subindex, one.type.bits)
    return PdoPlan(number, direction, base + NODE, True, transmission, 0, event, (entry,))


PLAN = CanopenPlan(
    interface="virtual",
    channel="test",
    bitrate=500_000,
    node=NODE,
    autostart=False,
    heartbeat=1000,
    sync=SyncPlan(),
    consumers=(Consumer(MASTER, 500, LINE),),
    objects=_OBJECTS,
    pdos=(
        _pdo(1, Direction.INPUT, _OBJECTS[PART], 255),
        _pdo(2, Direction.INPUT, _OBJECTS[SPEED], 1),
        _pdo(1, Direction.OUTPUT, _OBJECTS[CYCLES], 255),
        _pdo(2, Direction.OUTPUT, _OBJECTS[FORCE], 1),
    ),
    rpdo_writer=LINE,
    sdo_writer=TOOL,
)


class Notebook(Observer):
    """Remembers what was reported to it."""

    def __init__(self) -> None:
        self.filters = 0
        self.reports: list[str] = []
        self.times: list[datetime] = []
        self.rates: list[tuple[int, float]] = []

    def cob_ids_changed(self) -> None:
        self.filters += 1

    def report(self, text: str) -> None:
        self.reports.append(text)

    def time_received(self, moment: datetime, now: float) -> None:
        self.times.append(moment)

    def switch_bit_rate(self, bit_rate: int, delay: float, now: float) -> None:
        self.rates.append((bit_rate, delay))


class Plant:
    """A node on an active bus, with the robot connected, and a master's hands."""

    def __init__(self, plan: CanopenPlan = PLAN, store: Store | None = None) -> None:
        self.now = 100.0
        self.wire = Wire()
        self.alive = True
        self.notebook = Notebook()
        self.cell = Cell(_CELL)
        self.cell.robot_connected(self.now)
        self.cell.adopt({PART: 0, SPEED: 0.0}, self.now)
        self.cell.package_arrived(1.0, self.now)
        self.node = Node(
            plan,
            self.cell,
            self.wire.send,
            store or Store(),
            lambda _now: self.alive,
            observer=self.notebook,
        )
        self.cell.listeners.append(lambda direction: self.node.image_changed(direction, self.now))

    def power_on(self, bus: BusState = BusState.ACTIVE) -> Plant:
        self.node.bus_changed(bus, self.now)
        self.node.start(self.now)
        return self

    def operational(self) -> Plant:
        self.power_on()
        self.hear(0, START)
        self.wire.take()
        return self

    @property
    def state(self) -> NmtState:
        return self.node.nmt.state

    def hear(self, can_id: int, data: bytes = b"") -> list[Frame]:
        """A frame comes; what the node sends on it."""
        self.node.receive(Frame(can_id, data), self.now)
        return self.take()

    def take(self) -> list[Frame]:
        return self.wire.take()

    def run(self, seconds: float) -> list[Frame]:
        """Let time pass as a link would; what is sent meanwhile."""
        end = self.now + seconds
        for _ in range(1000):
            self.now = max(self.now, self.node.next_deadline(self.now))
            if self.now > end:
                break
            self.node.tick(self.now)
        else:
            pytest.fail("the node is never done")
        self.now = end
        return self.take()

    def bus(self, state: BusState) -> list[Frame]:
        self.node.bus_changed(state, self.now)
        return self.take()

    def show(self, variable: int, value: Value) -> list[Frame]:
        """The robot reports a value."""
        self.cell.image.values[variable] = value
        self.cell.outputs_written(self.now)
        return self.take()

    def heartbeat(self, state: int = 5) -> list[Frame]:
        return self.hear(0x700 + MASTER, bytes([state]))

    def read(self, index: int, subindex: int = 0, node: int = NODE) -> int | None:
        """Expedited SDO upload; None without an answer, negative for an abort code."""
        return _answer(self.hear(0x600 + node, b"\x40" + _multiplexer(index, subindex) + bytes(4)))

    def write(
        self, index: int, subindex: int, value: int | bytes, size: int = 4, node: int = NODE
    ) -> int | None:
        """Expedited SDO download; 0 for success."""
        data = value if isinstance(value, bytes) else value.to_bytes(size, "little")
        command = 0x23 | (4 - len(data)) << 2
        request = bytes([command]) + _multiplexer(index, subindex) + data.ljust(4, b"\0")
        return _answer(self.hear(0x600 + node, request))

    def part(self, value: int) -> list[Frame]:
        return self.hear(0x205, value.to_bytes(4, "little"))


def _multiplexer(index: int, subindex: int) -> bytes:
    return index.to_bytes(2, "little") + bytes([subindex])


def _answer(frames: list[Frame]) -> int | None:
    answers = [frame for frame in frames if 0x580 <= frame.can_id < 0x600]
    if not answers:
        return None
    assert len(answers) == 1
    data = answers[0].data
    value = int.from_bytes(data[4:8], "little")
    return -value if data[0] == 0x80 else value


def _emergencies(frames: list[Frame]) -> list[int]:
    return [int.from_bytes(frame.data[:2], "little") for frame in frames if frame.can_id == 0x80 + NODE]


# -- start and NMT ---------------------------------------------------------------------------------------------------


def test_node_boots_and_tells_heartbeats() -> None:
    plant = Plant().power_on()
    assert plant.take() == [BOOT_UP]
    assert plant.run(2.0) == [Frame(0x705, b"\x7f")] * 2


def test_node_that_finds_no_bus_boots_when_there_is_one() -> None:
    plant = Plant().power_on(BusState.ABSENT)
    assert plant.run(5.0) == []
    assert plant.state is NmtState.INITIALISING
    assert plant.bus(BusState.ACTIVE) == [BOOT_UP]


def test_heartbeat_is_silent_while_the_core_does_not_live() -> None:
    plant = Plant().power_on()
    plant.take()
    plant.alive = False
    assert plant.run(3.0) == []
    plant.alive = True
    assert len(plant.run(1.0)) == 1


def test_autostart() -> None:
    plant = Plant(replace(PLAN, autostart=True)).power_on()
    assert plant.state is NmtState.OPERATIONAL
    assert plant.take() == [BOOT_UP, Frame(0x185, bytes(4))]


@pytest.mark.parametrize(
    "command, sdo, pdo, emcy, lss",
    [
        (START, True, True, True, False),
        (PRE_OPERATIONAL, True, False, True, True),
        (STOP, False, False, False, True),
    ],
    ids=["OPERATIONAL", "PRE_OPERATIONAL", "STOPPED"],
)
def test_cct_state_03_services_by_state(command: bytes, sdo: bool, pdo: bool, emcy: bool, lss: bool) -> None:
    plant = Plant().operational()
    plant.hear(0, command)
    assert (plant.read(0x1000) == 0) is sdo
    plant.part(7)
    assert (plant.cell.image.values[PART] == 7) is pdo
    assert bool(plant.show(CYCLES, 3)) is pdo
    plant.node.frames_lost(1, plant.now)
    assert bool(_emergencies(plant.take())) is emcy
    plant.hear(0x7E5, b"\x04\x01" + bytes(6))
    assert bool(plant.hear(0x7E5, b"\x5e" + bytes(7))) is lss
    assert len(plant.run(1.0)) >= 1, "the heartbeat runs in every state"


def test_cct_state_04_emergencies_wait_for_a_state_that_allows_them() -> None:
    plant = Plant().operational()
    plant.hear(0, STOP)
    plant.node.frames_lost(1, plant.now)
    assert _emergencies(plant.take()) == []
    assert _emergencies(plant.hear(0, PRE_OPERATIONAL)) == [0x8110]


@pytest.mark.parametrize("command", [RESET_NODE, RESET_COMMUNICATION])
def test_cct_transition_04_resets_bring_communication_defaults_and_boot_again(command: bytes) -> None:
    plant = Plant().operational()
    plant.write(0x1017, 0, 20, 2)
    plant.write(0x1800, 1, 0x8000_0185)
    plant.write(0x1800, 1, 0x4000_0190)
    assert plant.hear(0, command) == [BOOT_UP]
    assert plant.read(0x1017) == 1000
    assert plant.read(0x1800, 1) == 0x4000_0185


# -- PDO and SYNC ----------------------------------------------------------------------------------------------------


def test_rpdo_reaches_the_cell_and_the_image_the_bus() -> None:
    plant = Plant().operational()
    plant.part(1234)
    assert plant.cell.image.values[PART] == 1234
    assert plant.show(CYCLES, 5) == [Frame(0x185, b"\5\0\0\0")]
    assert plant.show(CYCLES, 5) == []


def test_sync_sends_and_applies_what_waits_for_it() -> None:
    plant = Plant().operational()
    plant.show(FORCE, 1.0)
    plant.hear(0x305, CanType.REAL32.pack(2.5))
    assert plant.cell.image.values[SPEED] == 0.0
    assert plant.hear(0x80) == [Frame(0x285, CanType.REAL32.pack(1.0))]
    assert plant.cell.image.values[SPEED] == 2.5


def test_sync_of_wrong_length_is_an_emergency_until_a_good_one() -> None:
    plant = Plant().operational()
    assert _emergencies(plant.hear(0x80, b"\1")) == [0x8240]
    assert _emergencies(plant.hear(0x80)) == [0]


def test_synchronous_rpdos_after_the_window_are_dropped() -> None:
    plant = Plant().operational()
    plant.write(0x1007, 0, 5000)
    plant.hear(0x80)
    plant.now += 0.01
    plant.hear(0x305, CanType.REAL32.pack(2.5))
    plant.part(7)
    plant.hear(0x80)
    assert (plant.cell.image.values[SPEED], plant.cell.image.values[PART]) == (0.0, 7)
    assert plant.node.counters.outside_window == 1


def test_node_as_sync_producer() -> None:
    plant = Plant(replace(PLAN, sync=SyncPlan(producer=True, period=100_000, counter=10))).operational()
    assert plant.run(0.25) == [
        Frame(0x80, b"\1"),
        Frame(0x285, bytes(4)),
        Frame(0x80, b"\2"),
        Frame(0x285, bytes(4)),
    ]


def test_length_faults_are_emergencies() -> None:
    plant = Plant().operational()
    assert _emergencies(plant.hear(0x205, b"\1\2")) == [0x8210]
    assert _emergencies(plant.hear(0x205, bytes(8))) == [0x8220]
    assert _emergencies(plant.part(1)) == [0]


def test_refused_write_is_an_emergency_until_one_succeeds() -> None:
    plant = Plant().operational()
    assert plant.write(0x2001, 1, 9) == 0
    assert _emergencies(plant.part(7)) == [0xFF01]
    assert plant.cell.image.values[PART] == 9
    plant.cell.release(Requester(TOOL), PART, plant.now)
    assert _emergencies(plant.part(7)) == [0]


def test_time_reaches_the_log() -> None:
    plant = Plant().operational()
    plant.hear(0x100, bytes(6))
    assert plant.notebook.times == [datetime(1984, 1, 1, tzinfo=UTC)]


# -- writers ---------------------------------------------------------------------------------------------------------


def _line_alive(plant: Plant) -> bool:
    return plant.cell.writers.alive[LINE]


def test_rpdo_writer_lives_from_its_first_rpdo_and_is_counted_once() -> None:
    plant = Plant().operational()
    plant.heartbeat()
    assert not _line_alive(plant)
    plant.part(1)
    plant.part(2)
    plant.hear(0x305, bytes(4))
    assert plant.cell.writers.connections == [1, 0]
    assert plant.cell.ownership.owners == [LINE, None]


@pytest.mark.parametrize("command", [PRE_OPERATIONAL, STOP, RESET_NODE, RESET_COMMUNICATION])
def test_leaving_operational_loses_the_rpdo_writer(command: bytes) -> None:
    plant = Plant().operational()
    plant.part(7)
    plant.hear(0, command)
    assert not _line_alive(plant)
    assert plant.cell.ownership.owners == [None, None]
    assert plant.cell.image.values[PART] == 0


def test_lost_heartbeat_loses_the_writer_and_operational() -> None:
    plant = Plant().operational()
    plant.heartbeat()
    plant.part(7)
    frames = plant.run(0.6)
    assert _emergencies(frames) == [0x8130]
    assert plant.state is NmtState.PRE_OPERATIONAL
    assert not _line_alive(plant)
    assert plant.read(0x1001) == 0x11
    assert _emergencies(plant.heartbeat()) == [0]


@pytest.mark.parametrize(
    "behaviour, state",
    [(0, NmtState.PRE_OPERATIONAL), (1, NmtState.OPERATIONAL), (2, NmtState.STOPPED)],
)
def test_error_behaviour_1029h(behaviour: int, state: NmtState) -> None:
    plant = Plant().operational()
    plant.write(0x1029, 1, behaviour, 1)
    plant.heartbeat()
    plant.part(7)
    plant.run(0.6)
    assert (plant.state, _line_alive(plant)) == (state, False)


def test_a_master_that_restarts_is_lost_as_a_writer_without_an_emergency() -> None:
    plant = Plant().operational()
    plant.heartbeat()
    plant.part(7)
    assert plant.heartbeat(0) == []
    assert (plant.state, _line_alive(plant)) == (NmtState.OPERATIONAL, False)


def test_rpdo_deadline_loses_the_writer() -> None:
    first, *others = PLAN.pdos
    plant = Plant(replace(PLAN, heartbeat=0, pdos=(replace(first, event=50), *others))).operational()
    plant.part(7)
    assert _emergencies(plant.run(0.06)) == [0x8250]
    assert not _line_alive(plant)
    assert _emergencies(plant.part(8)) == [0]
    assert _line_alive(plant)


def _kept_for_sync(behaviour: int = 0) -> Plant:
    """An RPDO of the watched master waits for SYNC."""
    plant = Plant().operational()
    plant.write(0x1029, 1, behaviour, 1)
    plant.heartbeat()
    plant.hear(0x305, CanType.REAL32.pack(2.5))
    return plant


@pytest.mark.parametrize("loss", ["boot-up", "heartbeat", "bus"])
def test_what_a_lost_writer_left_for_sync_is_never_written(loss: str) -> None:
    """Whatever 1029h says, and though the master is heard again before the SYNC."""
    plant = _kept_for_sync(behaviour=1)
    if loss == "boot-up":
        plant.heartbeat(0)
    elif loss == "heartbeat":
        plant.run(0.6)
    else:
        plant.bus(BusState.DOWN)
        plant.bus(BusState.ACTIVE)
    assert plant.state is NmtState.OPERATIONAL
    assert not _line_alive(plant)
    plant.heartbeat()
    plant.part(1)
    plant.hear(0x80)
    assert (plant.cell.image.values[PART], plant.cell.image.values[SPEED]) == (1, 0.0)
    plant.hear(0x305, CanType.REAL32.pack(1.5))
    plant.hear(0x80)
    assert plant.cell.image.values[SPEED] == 1.5


def test_what_a_deadline_of_one_rpdo_costs_the_others() -> None:
    """The writer is lost with it, and what another RPDO of it has left for SYNC as well."""
    first, *others = PLAN.pdos
    plant = Plant(replace(PLAN, heartbeat=0, pdos=(replace(first, event=50), *others))).operational()
    plant.part(7)
    plant.hear(0x305, CanType.REAL32.pack(2.5))
    plant.run(0.06)
    assert plant.hear(0x80) == [Frame(0x285, bytes(4))]
    assert plant.cell.image.values[SPEED] == 0.0
    assert plant.cell.ownership.owners == [None, None]


def test_a_writer_that_has_timed_out_writes_nothing_with_a_sync() -> None:
    definition = replace(_CELL, writers=(Writer("line", timeout=1.0), Writer("tool")))
    plant = Plant()
    cell = plant.cell = Cell(definition)
    cell.robot_connected(plant.now)
    cell.adopt({PART: 0, SPEED: 0.0}, plant.now)
    plant.node = Node(PLAN, cell, plant.wire.send, Store(), lambda _now: True)
    plant.operational()
    plant.hear(0x305, CanType.REAL32.pack(2.5))
    plant.run(2.0)
    cell.tick(plant.now)
    assert not _line_alive(plant)
    plant.hear(0x80)
    assert cell.image.values[SPEED] == 0.0
    assert not _line_alive(plant)


def test_sdo_client_is_a_writer_until_sdo_is_no_longer_served() -> None:
    plant = Plant().power_on()
    plant.read(0x1000)
    assert plant.cell.writers.alive == [False, True]
    plant.hear(0, START)
    plant.hear(0, PRE_OPERATIONAL)
    assert plant.cell.writers.alive == [False, True]
    plant.hear(0, STOP)
    assert plant.cell.writers.alive == [False, False]


def test_heartbeat_feeds_a_writer_that_sends_only_changes() -> None:
    definition = replace(_CELL, writers=(Writer("line", timeout=1.0), Writer("tool")))
    plant = Plant()
    cell = plant.cell = Cell(definition)
    cell.robot_connected(plant.now)
    cell.adopt({PART: 0, SPEED: 0.0}, plant.now)
    plant.node = Node(PLAN, cell, plant.wire.send, Store(), lambda _now: True)
    plant.operational()
    plant.part(7)
    for _ in range(10):
        plant.heartbeat()
        plant.run(0.4)
        cell.tick(plant.now)
    assert _line_alive(plant)


# -- status words in PDOs --------------------------------------------------------------------------------------------

_ROBOT_STATE, _HEARTBEAT_WORD = 7, 4
"""Sub-indices of 5F00h."""


def _status_pdo(transmission: int, *words: tuple[int, int], inhibit: int = 0) -> Plant:
    """TPDO 3 carries words of the status block behind an output."""
    cycles = PdoEntry(CYCLES, 0x2401, 1, 32)
    status = tuple(PdoEntry(None, index, subindex, 16) for index, subindex in words)
    pdo = PdoPlan(3, Direction.OUTPUT, 0x385, True, transmission, inhibit, 0, (cycles, *status))
    return Plant(replace(PLAN, pdos=(*PLAN.pdos, pdo)))


_STATUS_MAPPING = b"""\
gatewayd: 1
cell: sample
robot: {host: robot}
canopen:
  channel: can0
  bitrate: 500000
  node: 1
  pdos:
    state: {status: [flags, robot_state, quality of ready], event: 500ms}
writers: {line: {canopen: any}}
variables:
  start: {robot: input_bit_register_0, canopen: auto, owner: line}
  ready: {robot: output_int_register_0, canopen: auto}
"""


def _sent_in_tpdo_3(frames: list[Frame]) -> list[tuple[int, ...]]:
    """The words behind the output."""
    return [struct.unpack_from("<2H", frame.data, 4) for frame in frames if frame.can_id == 0x385]


def test_an_event_driven_tpdo_tells_states_and_qualities_when_the_robot_is_lost() -> None:
    plant = _status_pdo(255, (0x5F00, _ROBOT_STATE), (0x5F40, CYCLES + 1))
    plant.operational()
    plant.show(CYCLES, 5)
    plant.cell.robot_lost("cable", plant.now)
    assert _sent_in_tpdo_3(plant.take())[-1] == (0, 1)
    plant.cell.robot_connected(plant.now)
    plant.cell.adopt({}, plant.now)
    assert _sent_in_tpdo_3(plant.take())[-1] == (1, 1)
    plant.cell.package_arrived(2.0, plant.now)
    assert _sent_in_tpdo_3(plant.show(CYCLES, 5)) == [(2, 0)]
    assert _sent_in_tpdo_3(plant.run(5.0)) == []


def test_an_owner_in_a_tpdo_is_reported_when_it_changes() -> None:
    plant = _status_pdo(254, (0x5F10, PART + 1), (0x5F10, SPEED + 1))
    plant.operational()
    assert _sent_in_tpdo_3(plant.part(7)) == [(1, 0)]
    assert _sent_in_tpdo_3(plant.heartbeat(0)) == [(0, 0)], "a master that boots has lost its lock"
    assert plant.write(0x5F00, 26, SPEED + 1, 2) == 0
    assert _sent_in_tpdo_3(plant.run(0.11)) == [(0, 2)], "a lock request changes no value"


def test_a_word_that_changes_with_time_is_sent_as_the_inhibit_time_allows() -> None:
    for inhibit, least, most in ((0, 9, 11), (5000, 1, 3)):
        plant = _status_pdo(255, (0x5F00, _HEARTBEAT_WORD), (0x5F00, _ROBOT_STATE), inhibit=inhibit)
        plant.operational()
        reported = []
        for _ in range(10):
            plant.cell.health.heartbeat += 1
            reported += _sent_in_tpdo_3(plant.run(0.1))
        assert least <= len(reported) <= most


def test_status_words_with_sync() -> None:
    plant = _status_pdo(1, (0x5F00, _ROBOT_STATE), (0x5F40, CYCLES + 1))
    plant.operational()
    plant.show(CYCLES, 5)
    assert _sent_in_tpdo_3(plant.hear(0x80)) == [(2, 0)]
    plant.cell.robot_lost("cable", plant.now)
    assert _sent_in_tpdo_3(plant.hear(0x80)) == [(0, 1)]


def test_words_that_a_mapping_puts_into_a_tpdo_are_shown_as_its_mapping_and_sent() -> None:
    plan = load(_STATUS_MAPPING, "cell").plan
    assert plan is not None
    assert canopen_of(plan) is not None
    wire, cell = Wire(), Cell(plan.cell)
    node = Node(plan.the(CanopenPlan), cell, wire.send, Store(), lambda _now: True)
    node.bus_changed(BusState.ACTIVE, 1.0)
    node.start(1.0)
    number = next(
        pdo.number
        for pdo in plan.the(CanopenPlan).pdos
        if any(entry.index >= HEADER for entry in pdo.entries)
    )
    shown = [node.dictionary.read(0x1A00 + number - 1, slot)[::-1].hex() for slot in (1, 2, 3)]
    assert sorted(shown) == ["5f000210", "5f000710", "5f400210"]
    node.receive(Frame(0, bytes([1, 1])), 1.0)
    values = {"5f000210": 0, "5f000710": 0, "5f400210": 3}
    expected = struct.pack("<3H", *(values[one] for one in shown))
    assert expected in [frame.data[-6:] for frame in wire.take()]


def test_a_master_maps_status_words_by_sdo_but_no_request() -> None:
    plant = Plant().power_on()
    assert plant.write(0x1A02, 1, 0x5F00_0710) == 0
    assert plant.write(0x1A02, 2, 0x5F40_0310) == 0
    assert plant.write(0x1A02, 3, 0x5F00_1A10) == -0x0604_0041
    assert plant.write(0x1A02, 3, 0x5F40_0510) == -0x0602_0000
    assert plant.write(0x1602, 1, 0x5F00_0710) == -0x0604_0041
    assert plant.write(0x1A02, 0, 2, 1) == 0
    assert plant.write(0x1802, 1, 0x4000_0385) == 0
    plant.hear(0, START)
    plant.take()
    plant.cell.robot_lost("cable", plant.now)
    assert [frame.data for frame in plant.take() if frame.can_id == 0x385][-1] == bytes([0, 0, 3, 0])


@pytest.mark.parametrize("behaviour", [0, 1, 2])
def test_a_lost_robot_is_an_emergency_and_no_communication_error(behaviour: int) -> None:
    plant = Plant().power_on()
    plant.node.dictionary.write(0x1029, 1, bytes([behaviour]))
    plant.hear(0, START)
    plant.take()
    plant.cell.robot_lost("cable", plant.now)
    assert _emergencies(plant.take()) == [0xFF10]
    assert plant.read(0x1001) == 0x81
    assert (plant.state, plant.node.counters.communication_errors) == (NmtState.OPERATIONAL, 0)
    plant.hear(0, RESET_COMMUNICATION)
    assert _emergencies(plant.run(0.0)) in ([0xFF10], [])
    assert plant.read(0x1001) == 0x81
    plant.cell.robot_connected(plant.now)
    plant.cell.package_arrived(2.0, plant.now)
    plant.show(CYCLES, 5)
    assert _emergencies(plant.run(1.1)) == [0]
    assert plant.read(0x1001) == 0


# -- a promised heartbeat --------------------------------------------------------------------------------------------


def _promised(behaviour: int = 1, **changes: Any) -> Plant:
    """Operational, and staying so whatever 8130h: the master, node 1, is both writers unless `changes` say more."""
    plant = Plant(replace(PLAN, sdo_writer=LINE, **changes)).power_on()
    plant.node.dictionary.write(0x1029, 1, bytes([behaviour]))
    plant.hear(0, START)
    plant.take()
    return plant


def _refused_for(plant: Plant) -> Reason | None:
    last = plant.cell.last_refusal
    return last.refusal.reason if last is not None else None


@pytest.mark.parametrize("service", ["RPDO", "SDO", "lock"])
def test_a_writer_that_never_tells_its_heartbeat_is_lost_after_the_time(service: str) -> None:
    plant = _promised()
    if service == "RPDO":
        plant.part(7)
    elif service == "SDO":
        assert plant.write(0x2001, 1, 7) == 0
    else:
        assert plant.write(0x5F00, 26, PART + 1, 2) == 0
    assert _emergencies(plant.run(0.49)) == []
    assert plant.cell.ownership.owners == [LINE, None]
    assert _emergencies(plant.run(0.02)) == []
    assert not _line_alive(plant)
    assert plant.cell.ownership.owners == [None, None]
    assert plant.cell.image.values[PART] == 0
    assert plant.node.counters.communication_errors == 0
    assert _emergencies(plant.part(8)) == [0xFF06]


@pytest.mark.parametrize("behaviour", [0, 1, 2])
def test_a_heartbeat_that_never_came_is_no_communication_error(behaviour: int) -> None:
    """CiA 301 supervises from the first heartbeat on; the mapping's promise is another matter."""
    plant = _promised(behaviour)
    plant.part(7)
    plant.run(0.6)
    assert (plant.state, _line_alive(plant)) == (NmtState.OPERATIONAL, False)


@pytest.mark.parametrize("behaviour, state", [(0, NmtState.PRE_OPERATIONAL), (2, NmtState.STOPPED)])
def test_a_heartbeat_that_ends_is_a_communication_error_whoever_wrote(
    behaviour: int, state: NmtState
) -> None:
    plant = _promised(behaviour)
    plant.heartbeat()
    assert _emergencies(plant.run(0.6)) == [0x8130]
    assert (plant.state, plant.node.counters.communication_errors) == (state, 1)


def test_a_read_begins_nothing() -> None:
    plant = _promised()
    plant.read(0x2001, 1)
    plant.read(0x5F00, 2)
    plant.write(0x5F00, 27, PART + 1, 2)
    plant.run(9.0)
    assert _line_alive(plant)
    assert plant.write(0x2001, 1, 7) == 0


@pytest.mark.parametrize("time", [0, 60_000])
def test_a_promise_cannot_be_switched_off_from_the_bus(time: int) -> None:
    """The configuration tool is confirmed, its value is read back and stored; the master dies, and its command ends."""
    store = Store()
    plant = Plant(replace(PLAN, sdo_writer=LINE), store).power_on()
    value = MASTER << 16 | time if time else 0
    for _ in range(2):
        assert plant.write(0x1016, 1, value) == 0
        plant.run(0.01)
    assert plant.write(0x1010, 1, b"save") == 0
    assert plant.read(0x1016, 1) == value
    reported = [text for text in plant.notebook.reports if "1016h" in text]
    assert len(reported) == 2, reported
    assert "line" in reported[0]
    assert "1016h:01" in reported[1]
    for _ in range(2):
        plant.hear(0, START)
        plant.heartbeat()
        plant.part(7)
        plant.run(0.4)
        assert plant.cell.image.values[PART] == 7
        assert _emergencies(plant.run(0.2)) == []
        assert (plant.cell.image.values[PART], plant.cell.ownership.owners[0]) == (0, None)
        assert _emergencies(plant.part(8)) == [0xFF06]
        plant = Plant(replace(PLAN, sdo_writer=LINE), store).power_on()
        assert plant.read(0x1016, 1) == value
        assert len(plant.notebook.reports) == 2


def test_1016h_may_be_stricter_than_the_promise() -> None:
    plant = _promised()
    plant.write(0x1016, 1, MASTER << 16 | 200)
    plant.part(7)
    plant.run(0.25)
    assert _refused_for(plant) is None
    assert plant.cell.image.values[PART] == 0
    plant.heartbeat()
    plant.part(7)
    assert _emergencies(plant.run(0.25)) == [0x8130]
    assert plant.cell.image.values[PART] == 0
    assert plant.notebook.reports == []


def test_a_stricter_mapping_counts_at_once_whatever_was_stored() -> None:
    store = Store()
    plant = Plant(PLAN, store).power_on()
    plant.write(0x1016, 1, MASTER << 16 | 400)
    plant.write(0x1010, 1, b"save")
    stricter = replace(PLAN, consumers=(Consumer(MASTER, 100, LINE),))
    plant = Plant(stricter, store).operational()
    assert plant.read(0x1016, 1) == MASTER << 16 | 400
    plant.heartbeat()
    plant.part(7)
    plant.run(0.11)
    assert (plant.cell.image.values[PART], plant.state) == (0, NmtState.OPERATIONAL)


def test_writing_1016h_over_and_over_does_not_put_off_the_loss() -> None:
    plant = _promised()
    plant.part(7)
    for number in range(10):
        plant.write(0x1016, 1, MASTER << 16 | 500 + number)
        plant.run(0.06)
    assert plant.cell.image.values[PART] == 0


def test_a_watched_node_that_uses_nothing_is_not_missed() -> None:
    plant = _promised()
    plant.hear(0x80)
    assert _emergencies(plant.run(9.0)) == []


def test_a_writer_that_promised_nothing_is_not_missed() -> None:
    plant = Plant(replace(PLAN, consumers=(Consumer(MASTER, 500, None),))).operational()
    plant.part(7)
    assert _emergencies(plant.run(9.0)) == []
    assert plant.cell.ownership.owners == [LINE, None]


def test_what_a_lost_writer_goes_on_sending_is_refused_until_its_heartbeat_is_back() -> None:
    plant = _promised()
    plant.heartbeat()
    plant.part(7)
    plant.run(0.6)
    seen = set()
    reported = []
    for _ in range(20):
        reported += _emergencies(plant.part(7)) + _emergencies(plant.run(0.1))
        seen.add(plant.cell.image.values[PART])
        assert (plant.cell.writers.alive, plant.cell.writers.connections) == ([False, False], [0, 0])
    assert (seen, reported) == ({0}, [0xFF06])
    assert plant.cell.health.writes_refused == 20
    assert plant.cell.ownership.owners == [None, None]
    assert plant.read(0x5F00, 0x15) == Reason.HEARTBEAT_LOST
    assert _emergencies(plant.heartbeat()) == []
    assert _emergencies(plant.part(7)) == [0], "both errors have gone"
    assert (plant.cell.image.values[PART], plant.cell.ownership.owners[0]) == (7, LINE)


def test_sdo_of_a_lost_writer_reads_and_configures_but_neither_writes_nor_locks() -> None:
    plant = _promised()
    plant.part(7)
    plant.run(0.6)
    assert plant.write(0x2001, 1, 9) == -0x0800_0022
    assert _refused_for(plant) is Reason.HEARTBEAT_LOST
    assert plant.write(0x5F00, 26, PART + 1, 2) == -0x0800_0022
    assert plant.write(0x5F00, 27, 0xFFFF, 2) == -0x0800_0022
    assert plant.read(0x2001, 1) == 0
    assert plant.write(0x1017, 0, 100, 2) == 0
    assert not _line_alive(plant)
    plant.heartbeat()
    assert plant.write(0x2001, 1, 9) == 0


def test_a_synchronous_rpdo_of_a_lost_writer_is_refused_and_not_kept() -> None:
    plant = _promised()
    plant.hear(0x305, CanType.REAL32.pack(2.5))
    plant.run(0.6)
    assert _emergencies(plant.hear(0x305, CanType.REAL32.pack(2.5))) == [0xFF06]
    plant.heartbeat()
    plant.hear(0x80)
    assert plant.cell.image.values[SPEED] == 0.0


def test_being_started_again_is_no_heartbeat() -> None:
    """A lost heartbeat ends OPERATIONAL; the master that starts the node is not heard by that."""
    plant = _promised(behaviour=0)
    plant.heartbeat()
    plant.part(7)
    plant.run(0.6)
    plant.hear(0, START)
    assert plant.state is NmtState.OPERATIONAL
    assert _emergencies(plant.part(7)) == [0xFF06]
    assert plant.cell.image.values[PART] == 0


@pytest.mark.parametrize("command", [RESET_NODE, RESET_COMMUNICATION])
def test_after_a_reset_the_heartbeat_is_waited_for_anew(command: bytes) -> None:
    plant = _promised()
    plant.part(7)
    plant.run(0.6)
    plant.hear(0, command)
    plant.hear(0, START)
    plant.part(8)
    assert plant.cell.image.values[PART] == 8
    assert _emergencies(plant.run(0.6)) == []
    assert plant.cell.image.values[PART] == 0


def test_a_deadline_that_was_missed_over_and_over_does_not_put_off_the_loss() -> None:
    """A writer that comes and goes is believed for one heartbeat time, not for one at each return."""
    first, *others = PLAN.pdos
    plant = _promised(pdos=(replace(first, event=50), *others))
    for _ in range(10):
        plant.part(7)
        plant.run(0.1)
    assert plant.cell.last_refusal is not None
    assert _refused_for(plant) is Reason.HEARTBEAT_LOST


def test_a_master_that_restarts_before_its_first_heartbeat_is_lost_as_a_writer() -> None:
    plant = _promised()
    plant.part(7)
    assert plant.heartbeat(0) == []
    assert not _line_alive(plant)
    assert _emergencies(plant.run(9.0)) == [], "it owes nothing before it is there again"


def test_the_modbus_side_of_a_writer_is_not_bound_by_its_heartbeat() -> None:
    """What it took by Modbus stays with that connection, and moves for nothing that comes by CANopen."""
    plant = _promised()
    modbus = Requester(LINE, connection=new_connection())
    plant.cell.writer_connected(modbus, plant.now, "Modbus")
    plant.part(6)
    assert plant.cell.write(modbus, [Change(PART, 7)], plant.now) is None
    plant.run(0.6)
    assert (_line_alive(plant), plant.cell.writers.connections) == (True, [1, 0])
    assert plant.cell.ownership.owners == [LINE, None]
    assert _emergencies(plant.part(8)) == [0xFF06]
    assert plant.write(0x5F00, 27, PART + 1, 2) == -0x0800_0022
    assert plant.cell.image.values[PART] == 7
    assert plant.cell.write(modbus, [Change(PART, 9)], plant.now) is None
    plant.cell.writer_disconnected(modbus, plant.now, "hung up")
    assert plant.cell.ownership.owners == [None, None]


def test_what_a_writer_took_by_canopen_ends_with_its_heartbeat() -> None:
    """A connection by Modbus keeps the writer alive, but is not the one that works with the lock."""
    plant = _promised()
    plant.cell.writer_connected(Requester(LINE, connection=new_connection()), plant.now, "Modbus")
    plant.part(7)
    plant.run(0.6)
    assert _line_alive(plant)
    assert plant.cell.ownership.owners == [None, None]
    assert plant.cell.image.values[PART] == 0


def _reload(plant: Plant) -> None:
    """The cell goes on with another definition, and the node with it."""
    former = plant.node
    plant.cell = succeed(plant.cell, _CELL, plant.now).cell
    plant.node = Node(former.plan, plant.cell, plant.wire.send, Store(), lambda _now: True)
    plant.node.resume(former, plant.now)


@pytest.mark.parametrize("lost", [False, True])
def test_the_node_of_a_succeeding_cell_goes_on_with_what_is_owed_and_what_is_lost(lost: bool) -> None:
    plant = _promised()
    plant.part(7)
    plant.run(0.6 if lost else 0.3)
    _reload(plant)
    plant.take()
    plant.part(8)
    assert plant.cell.image.values[PART] == (0 if lost else 8)
    plant.run(0.3)
    assert (_line_alive(plant), plant.cell.image.values[PART]) == (False, 0)
    plant.part(8)
    assert _refused_for(plant) is Reason.HEARTBEAT_LOST
    plant.heartbeat()
    plant.part(8)
    assert plant.cell.image.values[PART] == 8


@pytest.mark.parametrize("missed", [False, True])
def test_the_deadline_of_an_rpdo_goes_on_through_a_reload(missed: bool) -> None:
    """Else the last command of a master that dies just before a reload would stay for ever."""
    first, *others = PLAN.pdos
    plan = replace(PLAN, pdos=(replace(first, event=300), *others), consumers=())
    plant = Plant(plan).operational()
    plant.part(7)
    plant.run(0.4 if missed else 0.2)
    _reload(plant)
    assert _emergencies(plant.run(0.2)) == ([] if missed else [0x8250])
    assert (_line_alive(plant), plant.cell.image.values[PART]) == (False, 0)
    assert _emergencies(plant.part(8)) == [0]


def test_what_was_wrong_with_an_rpdo_before_a_reload_is_over_with_a_good_one() -> None:
    plant = Plant().operational()
    assert _emergencies(plant.hear(0x205, b"\7")) == [0x8210]
    _reload(plant)
    assert _emergencies(plant.part(8)) == [0]


def test_a_synchronous_rpdo_waits_through_a_reload() -> None:
    first, *others = PLAN.pdos
    plant = Plant(replace(PLAN, pdos=(replace(first, transmission=1), *others))).operational()
    plant.part(7)
    _reload(plant)
    plant.hear(0x80)
    assert plant.cell.image.values[PART] == 7


def test_an_overrun_ends_though_the_node_was_succeeded_meanwhile() -> None:
    plant = Plant().operational()
    plant.node.frames_lost(3, plant.now)
    assert _emergencies(plant.take()) == [0x8110]
    _reload(plant)
    assert _emergencies(plant.run(OVERRUN_TIME)) == [0]


@pytest.mark.parametrize("missed", [False, True])
def test_a_guarding_master_is_watched_through_a_reload(missed: bool) -> None:
    plant = Plant(replace(PLAN, heartbeat=0)).operational()
    plant.node.dictionary.write(0x1029, 1, bytes([1]))
    plant.write(0x100C, 0, 100, 2)
    plant.write(0x100D, 0, 3, 1)
    plant.node.receive(Frame(0x705, b"", remote=True), plant.now)
    assert plant.take() == [Frame(0x705, b"\5")]
    plant.run(0.4 if missed else 0.2)
    _reload(plant)
    assert _emergencies(plant.run(0.2)) == ([] if missed else [0x8130])
    plant.node.receive(Frame(0x705, b"", remote=True), plant.now)
    frames = plant.take()
    assert Frame(0x705, b"\x85") in frames, "the toggle bit goes on"
    assert _emergencies(frames) == [0]


def test_heartbeat_and_sync_keep_their_time_through_a_reload() -> None:
    sync = replace(PLAN.sync, producer=True, period=100_000, counter=10)
    plan = replace(PLAN, sync=sync, heartbeat=150)
    plant = Plant(plan).operational()
    begin, moments = plant.now, []
    for turn in range(200):
        plant.now = begin + turn * 0.01
        if turn % 7 == 0:
            _reload(plant)
            plant.take()
        plant.node.tick(plant.now)
        moments += [(frame, turn) for frame in plant.take() if frame.can_id in (0x80, 0x705)]
    syncs = [frame.data[0] for frame, _turn in moments if frame.can_id == 0x80]
    assert syncs == [number % 10 + 1 for number in range(len(syncs))]
    for can_id, period in ((0x80, 0.1), (0x705, PLAN.heartbeat / 1000)):
        turns = [turn for frame, turn in moments if frame.can_id == can_id]
        assert len(turns) >= 2 / period - 2
        assert max(after - before for before, after in pairwise(turns)) <= 100 * period + 1


# -- a gap of our own ------------------------------------------------------------------------------------------------


def _stand_still(plant: Plant, seconds: float) -> None:
    """The process stands still; what follows has waited, until `caught_up`."""
    since, plant.now = plant.now, plant.now + seconds
    plant.node.gap(since, plant.now)


@pytest.mark.parametrize("heard", [False, True])
def test_nobody_is_accused_for_our_own_silence(heard: bool) -> None:
    first, *others = PLAN.pdos
    plant = _promised(pdos=(replace(first, event=300), *others))
    plant.heartbeat()
    plant.part(7)
    _stand_still(plant, 5.0)
    if heard:
        plant.heartbeat()
        plant.part(7)
    plant.node.caught_up()
    assert _emergencies(plant.run(0.25)) == []
    assert (_line_alive(plant), plant.node.counters.communication_errors) == (True, 0)
    assert _emergencies(plant.run(0.35)) == [0x8250, 0x8130]
    assert not _line_alive(plant)


def test_a_guarding_master_is_not_accused_and_gets_no_answer_that_it_waits_for_no_more() -> None:
    plant = Plant(replace(PLAN, heartbeat=0)).operational()
    plant.write(0x100C, 0, 100, 2)
    plant.write(0x100D, 0, 3, 1)
    plant.node.receive(Frame(0x705, b"", remote=True), plant.now)
    assert plant.take() == [Frame(0x705, b"\5")]
    _stand_still(plant, 5.0)
    for _ in range(9):
        plant.node.receive(Frame(0x705, b"", remote=True), plant.now)
    plant.node.caught_up()
    assert plant.run(0.29) == []
    plant.node.receive(Frame(0x705, b"", remote=True), plant.now)
    assert plant.take() == [Frame(0x705, b"\x85")], "the toggle bit that it expects"
    _stand_still(plant, 5.0)
    plant.node.caught_up()
    assert _emergencies(plant.run(0.29)) == []
    assert _emergencies(plant.run(0.02)) == [0x8130]


def test_syncs_that_waited_send_nothing_and_count() -> None:
    second = replace(PLAN.pdos[3], transmission=2)
    plant = Plant(replace(PLAN, pdos=(*PLAN.pdos[:3], second))).operational()
    assert [frame.can_id for frame in plant.hear(0x80)] == [0x285]
    _stand_still(plant, 5.0)
    assert [frame for _ in range(499) for frame in plant.hear(0x80)] == []
    plant.node.caught_up()
    assert [frame.can_id for frame in plant.hear(0x80)] == [0x285]
    assert plant.node.sync.count == 501


def test_a_gap_brings_one_heartbeat_and_one_sync() -> None:
    sync = SyncPlan(producer=True, period=10_000)
    plant = Plant(replace(PLAN, heartbeat=100, sync=sync)).operational()
    _stand_still(plant, 5.0)
    plant.node.caught_up()
    plant.node.tick(plant.now)
    sent = [frame.can_id for frame in plant.take()]
    assert (sent.count(0x80), sent.count(0x705)) == (1, 1)


def test_parameters_of_a_client_that_has_given_up_are_not_set() -> None:
    plant = Plant().power_on()
    _stand_still(plant, 0.4)
    assert plant.write(0x1017, 0, 100, 2) == 0
    plant.node.caught_up()
    _stand_still(plant, 3.0)
    assert plant.write(0x1017, 0, 50, 2) == -0x0800_0022
    assert plant.read(0x1017) == 100
    plant.node.caught_up()
    assert plant.write(0x1017, 0, 50, 2) == 0


def test_commands_of_the_master_are_carried_out_however_late() -> None:
    plant = Plant().operational()
    _stand_still(plant, 5.0)
    plant.hear(0, STOP)
    assert plant.state is NmtState.STOPPED


@pytest.mark.parametrize("seconds, value, owner", [(0.3, 8, LINE), (5.0, 0, None)])
def test_an_rpdo_that_waited_longer_than_its_writer_may_be_silent_is_dropped_and_its_locks_released(
    seconds: float, value: int, owner: int | None
) -> None:
    plant = Plant(replace(PLAN, consumers=())).operational()
    plant.part(7)
    _stand_still(plant, seconds)
    reported = _emergencies(plant.part(8))
    assert (plant.cell.image.values[PART], plant.cell.ownership.owners[0]) == (value, owner)
    assert reported == ([] if owner == LINE else [0xFF08])
    plant.node.caught_up()
    assert _emergencies(plant.part(9)) == ([] if owner == LINE else [0])
    assert plant.cell.image.values[PART] == 9


@pytest.mark.parametrize("sync_waits", [False, True])
@pytest.mark.parametrize("before", [False, True])
def test_a_synchronous_rpdo_that_waited_is_not_written_with_a_later_sync(
    before: bool, sync_waits: bool
) -> None:
    """Whether it came before the gap or in it, and whether SYNC did."""
    plant = Plant(replace(PLAN, consumers=())).operational()
    speed = CanType.REAL32.pack(2.5)
    if before:
        plant.hear(0x305, speed)
        _stand_still(plant, 5.0)
    else:
        _stand_still(plant, 5.0)
        plant.hear(0x305, speed)
    if sync_waits:
        reported = plant.hear(0x80)
        plant.node.caught_up()
    else:
        plant.node.caught_up()
        reported = plant.hear(0x80)
    assert plant.cell.image.values[SPEED] == 0.0
    assert _emergencies(reported) == [0xFF08]
    plant.hear(0x305, speed)
    plant.hear(0x80)
    assert plant.cell.image.values[SPEED] == 2.5


def test_writes_and_lock_requests_by_sdo_that_waited_are_aborted_and_releases_are_not() -> None:
    plant = Plant().power_on()
    assert plant.write(0x2001, 1, 7) == 0
    _stand_still(plant, 5.0)
    assert plant.write(0x2001, 1, 8) == -0x0800_0022
    assert _refused_for(plant) is Reason.WAITED
    assert plant.write(0x5F00, 26, SPEED + 1, 2) == -0x0800_0022
    assert plant.cell.image.values[PART] == 7
    assert plant.write(0x5F00, 27, PART + 1, 2) == 0
    assert plant.cell.ownership.owners == [None, None]


def test_two_gaps_in_a_row_are_one_wait() -> None:
    plant = Plant().operational()
    _stand_still(plant, 0.3)
    _stand_still(plant, 0.3)
    assert plant.write(0x1017, 0, 50, 2) == -0x0800_0022


# -- bus -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("state", [BusState.BUS_OFF, BusState.DOWN, BusState.ABSENT])
def test_without_a_bus_nobody_writes_and_nothing_is_sent(state: BusState) -> None:
    plant = Plant().operational()
    plant.part(7)
    plant.read(0x1000)
    assert plant.bus(state) == []
    assert plant.cell.writers.alive == [False, False]
    assert plant.state is NmtState.PRE_OPERATIONAL
    assert plant.show(CYCLES, 9) == []
    assert plant.run(10.0) == []


@pytest.mark.parametrize(
    "autostart, state", [(False, NmtState.PRE_OPERATIONAL), (True, NmtState.OPERATIONAL)]
)
def test_recovery_from_bus_off_boots_again_and_is_an_emergency(autostart: bool, state: NmtState) -> None:
    plant = Plant(replace(PLAN, autostart=autostart)).operational()
    plant.bus(BusState.BUS_OFF)
    plant.run(1.0)
    frames = plant.bus(BusState.ACTIVE)
    assert frames[0] == BOOT_UP
    assert _emergencies(frames) == [0x8140, 0]
    assert plant.state is state


def test_a_bus_that_was_down_is_no_bus_off() -> None:
    plant = Plant().operational()
    plant.bus(BusState.ABSENT)
    assert plant.bus(BusState.ACTIVE) == [BOOT_UP]


def test_a_node_that_was_not_operational_goes_on_where_it_was() -> None:
    plant = Plant().power_on()
    plant.hear(0, STOP)
    plant.take()
    plant.bus(BusState.DOWN)
    assert plant.bus(BusState.ACTIVE) == []
    assert plant.state is NmtState.STOPPED


def test_error_behaviour_1_stays_operational_and_sends_everything_anew() -> None:
    plant = Plant().operational()
    plant.write(0x1029, 1, 1, 1)
    plant.bus(BusState.DOWN)
    plant.show(CYCLES, 9)
    assert plant.bus(BusState.ACTIVE) == [Frame(0x185, b"\x09\0\0\0")]
    assert plant.state is NmtState.OPERATIONAL


def test_passive_controller_is_an_emergency_while_it_lasts_and_after_a_reset() -> None:
    plant = Plant().operational()
    assert _emergencies(plant.bus(BusState.PASSIVE)) == [0x8120]
    assert _emergencies(plant.hear(0, RESET_COMMUNICATION)) == [0x8120]
    assert _emergencies(plant.bus(BusState.WARNING)) == [0]


def test_overrun_is_an_emergency_until_nothing_is_lost_any_more() -> None:
    plant = Plant().operational()
    plant.node.frames_lost(3, plant.now)
    plant.node.frames_lost(4, plant.now)
    assert _emergencies(plant.take()) == [0x8110]
    assert plant.node.counters.overruns == 7
    assert _emergencies(plant.run(OVERRUN_TIME)) == [0]


def test_node_guarding_without_a_heartbeat() -> None:
    plant = Plant(replace(PLAN, heartbeat=0)).operational()
    plant.write(0x100C, 0, 100, 2)
    plant.write(0x100D, 0, 2, 1)
    plant.node.receive(Frame(0x705, remote=True, length=1), plant.now)
    assert plant.take() == [Frame(0x705, b"\x05")]
    assert _emergencies(plant.run(0.3)) == [0x8130]
    assert plant.state is NmtState.PRE_OPERATIONAL


def test_life_guarding_is_watched_again_from_the_first_request_after_a_loss() -> None:
    plant = Plant(replace(PLAN, heartbeat=0)).operational()
    plant.write(0x100C, 0, 100, 2)
    plant.write(0x100D, 0, 2, 1)
    for _ in range(2):
        plant.node.receive(Frame(0x705, remote=True, length=1), plant.now)
        plant.take()
        assert _emergencies(plant.run(0.3)) == [0x8130]


# -- storage and LSS -------------------------------------------------------------------------------------------------


def test_saved_communication_parameters_and_mappings_survive_a_restart() -> None:
    store = Store()
    first = Plant(store=store).power_on()
    assert first.write(0x1017, 0, 250, 2) == 0
    assert first.write(0x1800, 1, 0xC000_0185) == 0
    assert first.write(0x1A00, 0, 0, 1) == 0
    assert first.write(0x1A00, 1, 0x2402_0120) == 0
    assert first.write(0x1A00, 0, 1, 1) == 0
    assert first.write(0x1800, 1, 0x4000_0185) == 0
    assert first.write(0x1010, 1, b"save") == 0
    second = Plant(store=store).operational()
    assert second.notebook.reports == [
        "stored parameters are used in place of the mapping's: 1017h:00, 1A00h:01"
    ]
    assert (second.read(0x1017), second.read(0x1A00, 1)) == (250, 0x2402_0120)
    assert second.show(FORCE, 1.5) == [Frame(0x185, CanType.REAL32.pack(1.5))]


def test_stored_values_that_make_no_pdo_are_reported_and_defaults_used() -> None:
    store = Store()
    plant = Plant(store=store).power_on()
    plant.write(0x1010, 1, b"save")
    store.save(Saved(store.load().layout, {(0x1800, 2): b"\xfc"}))
    second = Plant(store=store).power_on()
    assert second.read(0x1800, 2) == 255
    assert "1800h" in second.notebook.reports[0]


def test_parameters_are_not_saved_while_operational() -> None:
    plant = Plant().operational()
    assert plant.write(0x1010, 1, b"save") == -0x0800_0022
    assert plant.write(0x1010, 1, b"evas") == -0x0800_0020


def _lss(plant: Plant, *data: int) -> list[Frame]:
    return plant.hear(0x7E5, bytes(data).ljust(8, b"\0"))


def test_new_node_id_comes_with_reset_communication_and_is_kept_if_stored() -> None:
    store = Store()
    plant = Plant(store=store).power_on()
    plant.take()
    _lss(plant, 0x04, 1)
    _lss(plant, 0x11, 9)
    _lss(plant, 0x17)
    _lss(plant, 0x04, 0)
    assert plant.read(0x1000) == 0
    assert plant.hear(0, RESET_COMMUNICATION) == [Frame(0x709, b"\0")]
    assert (plant.read(0x1000), plant.read(0x1014, node=9)) == (None, 0x89)
    assert plant.read(0x1400, 1, node=9) == 0x209
    assert plant.node.cob_ids() >= {0x209, 0x309, 0x609}
    assert not plant.node.cob_ids() & {0x205, 0x605}
    again = Plant(store=store).power_on()
    assert again.take() == [Frame(0x709, b"\0")]
    moved = Plant(replace(PLAN, node=6), store).power_on()
    assert moved.take() == [Frame(0x706, b"\0")]
    assert "node-ID 9" in moved.notebook.reports[0]


def test_unconfigured_node_waits_in_lss_and_boots_with_its_node_id() -> None:
    plant = Plant(replace(PLAN, node=UNCONFIGURED)).power_on()
    assert plant.node.cob_ids() == {0x7E5}
    assert plant.hear(0, START) == []
    assert plant.run(5.0) == []
    assert _lss(plant, 0x4C) == [Frame(0x7E4, b"\x50" + bytes(7))]
    _lss(plant, 0x04, 1)
    _lss(plant, 0x11, 7)
    assert _lss(plant, 0x04, 0) == [Frame(0x707, b"\0")]
    assert plant.read(0x1800, 1, node=7) == 0x4000_0187
    assert plant.run(1.0) == [Frame(0x707, b"\x7f")]


def test_bit_rate_is_the_links_affair() -> None:
    plant = Plant().power_on()
    _lss(plant, 0x04, 1)
    _lss(plant, 0x15, 100, 0)
    assert plant.notebook.rates == [(500_000, 0.1)]
    assert plant.node.bit_rate == 500_000


# -- dictionary and COB-IDs ------------------------------------------------------------------------------------------


def test_filters_hold_exactly_what_the_node_hears() -> None:
    plant = Plant().power_on()
    assert plant.node.cob_ids() == {0x000, 0x080, 0x100, 0x205, 0x305, 0x605, 0x701, 0x705, 0x7E5}
    assert plant.node.remote_ids() == {0x705}


def test_changed_cob_ids_are_announced() -> None:
    plant = Plant().power_on()
    reported = plant.notebook.filters
    plant.write(0x1400, 1, 0x8000_0205)
    plant.write(0x1400, 1, 0x190)
    plant.write(0x1005, 0, 0x90)
    assert plant.notebook.filters > reported
    assert plant.node.cob_ids() == {0x000, 0x090, 0x100, 0x190, 0x305, 0x605, 0x701, 0x705, 0x7E5}
    plant.hear(0, START)
    plant.hear(0x190, b"\7\0\0\0")
    assert plant.cell.image.values[PART] == 7


def test_status_flags_are_the_manufacturer_status_register() -> None:
    plant = Plant().power_on()
    assert plant.read(0x1002) == plant.read(0x5F00, 2)


def _identity(declared: IdentityPlan, plan: CanopenPlan = PLAN) -> list[int | None]:
    plant = Plant(replace(plan, identity=declared)).power_on()
    numbers = [plant.read(0x1018, number) for number in range(1, 5)]
    plant.hear(0x7E5, b"\x04\x01" + bytes(6))
    for number, command in zip(numbers, range(0x5A, 0x5E), strict=True):
        (answer,) = plant.hear(0x7E5, bytes([command]) + bytes(7))
        assert int.from_bytes(answer.data[1:5], "little") == number, "LSS finds it by the same"
    return numbers


def test_identity_follows_from_release_and_cell_unless_the_mapping_declares_it() -> None:
    assert _identity(IdentityPlan()) == [0, PRODUCT_CODE, revision(), zlib.crc32(b"press-3")]
    assert _identity(IdentityPlan(0x319, 2, 0x0001_0002, 42)) == [0x319, 2, 0x0001_0002, 42]
    assert _identity(IdentityPlan(serial="fingerprint"))[3] == 0xCAFE_F00D


def test_an_automatic_revision_follows_the_dictionary_and_nothing_else() -> None:
    auto = IdentityPlan(revision="auto")
    before = _identity(auto)[2]
    assert _identity(replace(auto, serial=1), replace(PLAN, channel="other"))[2] == before
    objects = (replace(_OBJECTS[PART], type=CanType.INTEGER16), *_OBJECTS[1:])
    assert _identity(auto, replace(PLAN, objects=objects, pdos=()))[2] != before
    assert _identity(auto, replace(PLAN, heartbeat=5))[2] != before


def test_device_name_has_the_name_of_the_cell() -> None:
    assert Plant().node.dictionary.read(0x1008, 0) == b"gatewayd press-3"


def test_robot_lost_and_ownership_are_abort_codes() -> None:
    plant = Plant().operational()
    plant.part(7)
    assert plant.write(0x2001, 1, 9) == -0x0800_0021
    plant.cell.robot_lost("unplugged", plant.now)
    assert plant.write(0x2002, 1, 9) == -0x0800_0022


@pytest.mark.parametrize("plan", [PLAN, replace(PLAN, autostart=True), replace(PLAN, node=UNCONFIGURED)])
def test_every_object_can_be_read_or_says_why_not(plan: CanopenPlan) -> None:
    plant = Plant(plan).power_on()
    for one in plant.node.dictionary:
        for entry in one.entries:
            if one.index != 0x1003 and entry.access.readable:
                assert entry.type.size in (None, len(plant.node.dictionary.read(one.index, entry.subindex)))


_OUR_IDS = (0x000, 0x080, 0x100, 0x205, 0x305, 0x605, 0x701, 0x705, 0x7E5)
_WRITABLE = [
    (one.index, entry.subindex, entry.type.size)
    for one in Plant().node.dictionary
    for entry in one.entries
    if entry.access.writable and entry.type.size is not None
]


def _download(place: tuple[int, int, int], value: bytes) -> Frame:
    index, subindex, size = place
    command = 0x23 | (4 - size) << 2
    return Frame(0x605, bytes([command]) + _multiplexer(index, subindex) + value[:size].ljust(4, b"\0"))


_IDENTIFIERS = st.sampled_from(_OUR_IDS) | st.integers(0, 0x7FF)
_FRAMES = (
    st.builds(Frame, _IDENTIFIERS, st.binary(max_size=8) | st.binary(min_size=8, max_size=8))
    | st.builds(Frame, _IDENTIFIERS, st.just(b""), st.just(True), st.integers(0, 8))
    | st.builds(
        _download, st.sampled_from(_WRITABLE), st.binary(min_size=4, max_size=4) | st.just(b"\1\0\0\0")
    )
)
_STEPS = st.lists(
    _FRAMES | st.sampled_from(BusState) | st.sampled_from([START, STOP, PRE_OPERATIONAL, RESET_NODE]),
    max_size=40,
)


@given(_STEPS, st.booleans())
def test_whatever_comes_the_node_stands_and_its_answers_are_bounded(
    steps: list[Frame | BusState | bytes], autostart: bool
) -> None:
    """Any frame in any state: no exception, no flood, 8-byte SDO answers, nothing into a dead bus."""
    plant = Plant(replace(PLAN, autostart=autostart)).power_on()
    plant.take()
    for step in steps:
        if isinstance(step, BusState):
            frames = plant.bus(step)
        elif isinstance(step, bytes):
            frames = plant.hear(0, step)
        else:
            plant.node.receive(step, plant.now)
            frames = plant.take()
        frames += plant.run(0.01)
        assert len(frames) <= 200
        assert not frames or plant.node.bus.carries
        assert all(len(frame.data) == 8 for frame in frames if frame.can_id == 0x585)
    deadline = plant.node.next_deadline(plant.now)
    assert deadline > plant.now


def test_how_each_frame_waits_for_the_bus() -> None:
    sync = SyncPlan(producer=True, period=500_000)
    plant = Plant(replace(PLAN, autostart=True, sync=sync)).power_on()
    plant.hear(0x80)
    plant.heartbeat()
    plant.read(0x1000)
    plant.run(1.0)
    sent = plant.wire.sent
    found = {(frame.can_id, priority.name) for frame, priority in sent}
    assert found == {
        (0x080, "AT_ONCE"),
        (0x085, "EVENT"),
        (0x705, "EVENT"),
        (0x705, "NEWEST"),
        (0x185, "NEWEST"),
        (0x285, "NEWEST"),
        (0x585, "ORDERED"),
    }


def test_sdo_server_tells_its_cob_ids_whatever_the_node_id() -> None:
    plant = Plant().power_on()
    assert (plant.read(0x1200, 1), plant.read(0x1200, 2)) == (0x605, 0x585)
    _lss(plant, 0x04, 1)
    _lss(plant, 0x11, 9)
    plant.hear(0, RESET_COMMUNICATION)
    assert (plant.read(0x1200, 1, node=9), plant.read(0x1200, 2, node=9)) == (0x609, 0x589)


def test_what_the_mapping_says_of_services_is_what_they_begin_with() -> None:
    plan = replace(
        PLAN,
        sync=SyncPlan(window=2000),
        heartbeat=0,
        guard_time=100,
        life_time_factor=3,
        emcy_inhibit=500,
        error_behaviour=2,
    )
    plant = Plant(plan).power_on()
    objects = ((0x1007, 0), (0x100C, 0), (0x100D, 0), (0x1015, 0), (0x1029, 1))
    assert [plant.read(*place) for place in objects] == [2000, 100, 3, 500, 2]
    plant.write(0x1015, 0, 1, 2)
    plant.hear(0, RESET_COMMUNICATION)
    assert plant.read(0x1015) == 500


def _reload_with(plant: Plant, **changes: Any) -> None:
    """The node goes on with another plan."""
    former, plan = plant.node, replace(plant.node.plan, **changes)
    assert goes_on(former.plan, plan, _CELL, _CELL)
    plant.cell = succeed(plant.cell, _CELL, plant.now).cell
    plant.node = Node(plan, plant.cell, plant.wire.send, Store(), lambda _now: True)
    plant.node.resume(former, plant.now)


def test_a_node_with_one_more_tpdo_keeps_its_writer_its_state_and_what_was_written() -> None:
    plant = Plant().operational()
    plant.part(7)
    assert plant.write(0x1801, 5, 250, 2) == 0
    more = replace(_pdo(3, Direction.OUTPUT, _OBJECTS[CYCLES], 255), cob_id=0x385)
    _reload_with(plant, pdos=(*PLAN.pdos, more), heartbeat=700)
    assert [frame.can_id for frame in plant.take() if frame.can_id >= 0x580] == [], "no boot-up"
    assert (plant.state, _line_alive(plant), plant.cell.image.values[PART]) == (NmtState.OPERATIONAL, True, 7)
    assert plant.read(0x1801, 5) == 250
    assert plant.read(0x1017) == 700
    assert plant.read(0x1802, 1) == 0x4000_0385
    plant.cell.listeners.append(lambda direction: plant.node.image_changed(direction, plant.now))
    assert 0x385 in {frame.can_id for frame in plant.show(CYCLES, 5)}


@pytest.mark.parametrize("deadline, faults", [(0, []), (200, [0x8250]), (900, [])])
def test_another_deadline_begins_at_the_reload(deadline: int, faults: list[int]) -> None:
    first, *others = PLAN.pdos
    plant = Plant(replace(PLAN, pdos=(replace(first, event=300), *others), consumers=())).operational()
    plant.part(7)
    plant.run(0.25)
    _reload_with(plant, pdos=(replace(first, event=deadline), *others))
    assert _emergencies(plant.run(0.15)) == []
    assert _emergencies(plant.run(0.3)) == faults


def test_a_segmented_transfer_is_aborted_by_a_reload_and_by_the_end_of_the_node() -> None:
    aborted = b"\x80\x08\x10\x00\x22\x00\x00\x08"
    plant = Plant().operational()
    plant.hear(0x605, b"\x40\x08\x10\x00" + bytes(4))
    _reload(plant)
    assert Frame(0x585, aborted) in plant.take()
    plant.hear(0x605, b"\x40\x08\x10\x00" + bytes(4))
    plant.node.lose_writers("another node", plant.now)
    assert plant.take() == [Frame(0x585, aborted)]


# -- a guarding master that is a writer -------------------------------------------------------------------------------

GUARDED = replace(PLAN, heartbeat=0, consumers=(), guarded=(Consumer(GUARDING, 300, LINE),))


def _guard(plant: Plant) -> list[Frame]:
    plant.node.receive(Frame(0x705, remote=True, length=1), plant.now)
    return plant.take()


def test_a_writer_that_promised_to_guard_the_node_is_lost_without_it_and_refused_until_it_is_back() -> None:
    plant = Plant(GUARDED).operational()
    plant.part(7)
    for _ in range(5):
        plant.run(0.2)
        assert _guard(plant)
    assert plant.cell.writers.alive[LINE]
    plant.run(0.4)
    assert not plant.cell.writers.alive[LINE]
    plant.part(8)
    assert plant.cell.image.values[PART] != 8
    _guard(plant)
    plant.part(9)
    assert plant.cell.image.values[PART] == 9


def test_the_promise_of_guarding_binds_from_the_first_write_and_cannot_be_weakened_from_the_bus() -> None:
    plant = Plant(GUARDED).operational()
    assert plant.write(0x100C, 0, 60_000, 2) == 0
    assert plant.write(0x100D, 0, 255, 1) == 0
    plant.run(5.0)
    plant.part(7)
    plant.run(0.2)
    assert plant.cell.writers.alive[LINE]
    plant.run(0.2)
    assert not plant.cell.writers.alive[LINE]
    assert plant.notebook.reports == []


# -- several writers by RPDO ------------------------------------------------------------------------------------------

TWO_WRITERS = replace(
    PLAN,
    sdo_writer=None,
    error_behaviour=1,  # else the loss of one ends OPERATIONAL, and with it the other
    consumers=(Consumer(MASTER, 500, LINE), Consumer(2, 500, TOOL)),
    pdos=tuple(
        replace(pdo, writer=TOOL, transmission=255) if pdo.cob_id == 0x300 + NODE else pdo
        for pdo in PLAN.pdos
    ),
)


def _speed(plant: Plant, value: float) -> None:
    plant.hear(0x305, CanType.REAL32.pack(value))


def _both_write() -> Plant:
    plant = Plant(TWO_WRITERS).operational()
    plant.heartbeat()
    plant.hear(0x702, b"\5")
    plant.part(7)
    _speed(plant, 0.5)
    return plant


def test_writers_by_rpdo_are_told_apart_by_their_pdo() -> None:
    plant = _both_write()
    assert (plant.cell.image.values[PART], plant.cell.image.values[SPEED]) == (7, 0.5)
    assert list(plant.cell.ownership.owners) == [LINE, TOOL]


def test_the_loss_of_one_leaves_the_other_its_locks() -> None:
    plant = _both_write()
    for _ in range(4):
        plant.run(0.2)
        plant.heartbeat()
    assert list(plant.cell.writers.alive) == [True, False]
    assert list(plant.cell.ownership.owners) == [LINE, None]
    _speed(plant, 0.7)
    assert plant.cell.image.values[SPEED] != CanType.REAL32.unpack(CanType.REAL32.pack(0.7))


def test_both_are_lost_with_operational() -> None:
    plant = _both_write()
    plant.hear(0, PRE_OPERATIONAL)
    assert list(plant.cell.writers.alive) == [False, False]
