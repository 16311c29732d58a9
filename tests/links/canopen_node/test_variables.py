"""Variables as objects: an SDO client reads the image and writes by the rules of the cell."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, AbortCode, Access, Dictionary, ObjectCode, Pdo
from gatewayd.canopen.sdo.server import SdoServer
from gatewayd.canopen.sync import SyncPlan
from gatewayd.core.cell import Cell
from gatewayd.core.definition import (
    CellDefinition,
    Direction,
    Fallback,
    FallbackKind,
    Limits,
    Lock,
    ValueKind,
    Variable,
    Writer,
)
from gatewayd.core.refusal import Reason
from gatewayd.core.requester import Requester
from gatewayd.links.canopen_node.plan import CanopenPlan, ObjectPlan, PdoEntry, PdoPlan
from gatewayd.links.canopen_node.variables import VariableObjects

LINE, HMI = range(2)
LOW, HIGH = -(2.0**31), 2.0**31 - 1
START, PART, FORCE, SPEED, STRANGE, CYCLES, ALARM, LEVEL = range(8)

INPUT, OUTPUT = Direction.INPUT, Direction.OUTPUT
VARIABLES = (
    Variable(1, "start", INPUT, ValueKind.BOOL, "input_bit_registers0_to_31", bit=0, lock=0),
    Variable(
        2,
        "part",
        INPUT,
        ValueKind.INT,
        "input_int_register_0",
        low=LOW,
        high=HIGH,
        limits=Limits(-9.5, 100.5),
        lock=1,
    ),
    Variable(
        3, "force", INPUT, ValueKind.FLOAT, "input_double_register_0", limits=Limits(0.0, 150.0), lock=2
    ),
    Variable(
        4,
        "speed",
        INPUT,
        ValueKind.FLOAT,
        "input_double_register_1",
        limits=Limits(0.0, 1.0, clamp=True),
        lock=3,
    ),
    Variable(5, "strange", INPUT, ValueKind.INT, "input_int_register_1", low=LOW, high=HIGH, lock=4),
    Variable(6, "cycles", OUTPUT, ValueKind.INT, "output_int_register_0", low=LOW, high=HIGH),
    Variable(
        7,
        "alarm",
        OUTPUT,
        ValueKind.BOOL,
        "output_bit_registers0_to_31",
        bit=0,
        on_stale=Fallback(FallbackKind.EXCEPTION),
    ),
    Variable(8, "level", OUTPUT, ValueKind.FLOAT, "output_double_register_0"),
)

DEFINITION = CellDefinition(
    name="press",
    fingerprint=1,
    variables=VARIABLES,
    locks=(
        Lock("start", (START,), (LINE,)),
        Lock("part", (PART,), (LINE, HMI)),
        Lock("force", (FORCE,), (LINE, HMI)),
        Lock("speed", (SPEED,), (LINE, HMI)),
        Lock("strange", (STRANGE,), (HMI,)),
    ),
    writers=(Writer("line"), Writer("hmi")),
    stale_after=0.1,
)

PLAN = CanopenPlan(
    interface="virtual",
    channel="test",
    bitrate=500_000,
    node=16,
    autostart=False,
    heartbeat=0,
    sync=SyncPlan(),
    consumers=(),
    objects=(
        ObjectPlan(START, 0x2000, 1, CanType.BOOLEAN),
        ObjectPlan(PART, 0x2010, 1, CanType.INTEGER32),
        ObjectPlan(STRANGE, 0x2010, 2, CanType.INTEGER32),
        ObjectPlan(FORCE, 0x2020, 1, CanType.REAL64),
        ObjectPlan(SPEED, 0x2030, 1, CanType.REAL32),
        ObjectPlan(CYCLES, 0x2460, 1, CanType.INTEGER16),
        ObjectPlan(ALARM, 0x2400, 1, CanType.BOOLEAN),
        ObjectPlan(LEVEL, 0x2430, 1, CanType.REAL32),
    ),
    pdos=(),
    rpdo_writer=None,
    sdo_writer=LINE,
)


class Node:
    """A cell with its robot up at time 0, and an SDO server in front of its variables."""

    def __init__(self, plan: CanopenPlan = PLAN, definition: CellDefinition = DEFINITION) -> None:
        self.now = 1.0
        self.plan = plan
        self.cell = Cell(definition)
        self.heard = True
        self.dictionary = Dictionary(
            VariableObjects(plan, self.cell, lambda: self.now, self._requester).objects()
        )
        self.server = SdoServer(self.dictionary)

    def _requester(self) -> Requester:
        return Requester(self.plan.sdo_writer, trusted=self.heard)

    def connect(self) -> None:
        inputs = range(5)
        self.cell.robot_connected(0.0)
        self.cell.adopt({index: VARIABLES[index].kind.zero for index in inputs}, 0.0)
        assert self.cell.package_arrived(0.0, 0.0)
        self.cell.image.values[CYCLES:] = [5, True, 2.5]
        self.cell.outputs_written(0.0)

    def abort_of(self, act: Callable[[], object]) -> AbortCode:
        with pytest.raises(Abort) as error:
            act()
        return error.value.code

    def write(self, index: int, subindex: int, data: bytes) -> AbortCode | None:
        try:
            self.dictionary.write(index, subindex, data)
        except Abort as abort:
            return abort.code
        return None


@pytest.fixture
def node() -> Node:
    node = Node()
    node.connect()
    return node


def test_objects_are_arrays_by_index_named_as_in_the_mapping(node: Node) -> None:
    objects = {one.index: one for one in node.dictionary}
    assert list(objects) == [0x2000, 0x2010, 0x2020, 0x2030, 0x2400, 0x2430, 0x2460]
    part = objects[0x2010]
    assert (part.code, part.name) == (ObjectCode.ARRAY, "Input INTEGER32")
    assert [entry.name for entry in part.entries] == ["Highest sub-index supported", "part", "strange"]
    assert part.entries[0].value == b"\2"
    assert objects[0x2400].name == "Output BOOLEAN"


def test_further_indices_of_a_type_are_numbered() -> None:
    first, second = (ObjectPlan(index, 0x2010 + index, 1, CanType.INTEGER32) for index in (PART, STRANGE))
    objects = list(
        VariableObjects(
            replace(PLAN, objects=(first, second)), Cell(DEFINITION), float, partial(Requester, None)
        ).objects()
    )
    assert [one.name for one in objects] == ["Input INTEGER32", "Input INTEGER32 2"]


@pytest.mark.parametrize(
    "index, access, pdo",
    [(0x2000, Access.RWW, Pdo.RECEIVE), (0x2460, Access.RO, Pdo.TRANSMIT)],
)
def test_od_access_follows_the_direction(node: Node, index: int, access: Access, pdo: Pdo) -> None:
    entry = node.dictionary.entry(index, 1)
    assert (entry.access, entry.pdo) == (access, pdo)


def test_inputs_are_read_only_where_nobody_writes_them() -> None:
    node = Node(replace(PLAN, sdo_writer=None))
    entry = node.dictionary.entry(0x2000, 1)
    assert (entry.access, entry.pdo) == (Access.RO, Pdo.NONE)
    assert node.write(0x2000, 1, b"\1") is AbortCode.READ_ONLY


@pytest.mark.parametrize(
    "plan",
    [
        replace(PLAN, sdo_writer=None, rpdo_writer=LINE),
        replace(
            PLAN,
            sdo_writer=None,
            pdos=(PdoPlan(1, INPUT, 0x210, True, 255, 0, 0, (PdoEntry(START, 0x2000, 1, 1),)),),
        ),
    ],
    ids=["an RPDO may be mapped", "an RPDO is mapped"],
)
def test_inputs_that_only_rpdos_write_refuse_sdo_and_the_cell_knows(plan: CanopenPlan) -> None:
    node = Node(plan)
    node.connect()
    assert node.dictionary.entry(0x2000, 1).pdo is Pdo.RECEIVE
    assert node.write(0x2000, 1, b"\1") is AbortCode.READ_ONLY
    assert node.cell.health.writes_refused == 1


def test_od_defaults_are_what_clear_gives(node: Node) -> None:
    assert node.dictionary.entry(0x2020, 1).default == bytes(8)
    assert node.dictionary.entry(0x2000, 1).default == b"\0"


def test_od_limits_are_those_of_the_mapping_that_the_type_does_not_have(node: Node) -> None:
    def limits(index: int, subindex: int) -> tuple[float | None, float | None]:
        entry = node.dictionary.entry(index, subindex)
        return entry.low, entry.high

    assert limits(0x2010, 1) == (-9, 100)
    assert limits(0x2020, 1) == (0.0, 150.0)
    assert limits(0x2030, 1) == (None, None), "what is out of them is clamped, not refused"
    assert limits(0x2010, 2) == (None, None)
    assert limits(0x2000, 1) == (None, None)


def test_a_type_wider_than_the_robots_is_limited_to_it() -> None:
    wide = replace(PLAN, objects=(ObjectPlan(STRANGE, 0x2090, 1, CanType.INTEGER64),), sdo_writer=HMI)
    node = Node(wide)
    node.connect()
    entry = node.dictionary.entry(0x2090, 1)
    assert (entry.low, entry.high) == (LOW, HIGH)
    assert node.write(0x2090, 1, struct.pack("<q", 2**31)) is AbortCode.VALUE_TOO_HIGH


def test_reading_gives_the_image_now(node: Node) -> None:
    assert node.dictionary.read(0x2460, 1) == b"\5\0"
    node.cell.image.values[CYCLES] = -2
    assert node.dictionary.read(0x2460, 1) == b"\xfe\xff"
    assert node.dictionary.read(0x2430, 1) == struct.pack("<f", 2.5)
    assert node.dictionary.read(0x2400, 1) == b"\1"


@pytest.mark.parametrize("value, shown", [(40000, 32767), (-40000, -32768), (2**31, 32767)])
def test_reading_saturates(node: Node, value: int, shown: int) -> None:
    node.cell.image.values[CYCLES] = value
    assert node.dictionary.read(0x2460, 1) == struct.pack("<h", shown)


def test_a_stale_output_whose_policy_is_exception_is_not_read(node: Node) -> None:
    node.cell.robot_lost("gone", 2.0)
    assert node.abort_of(lambda: node.dictionary.read(0x2400, 1)) is AbortCode.DEVICE_STATE
    assert node.dictionary.read(0x2460, 1) == b"\0\0"


def test_writing_reaches_the_cell_as_the_sdo_writer(node: Node) -> None:
    assert node.write(0x2000, 1, b"\1") is None
    assert node.write(0x2010, 1, struct.pack("<i", -7)) is None
    assert node.write(0x2020, 1, struct.pack("<d", 12.5)) is None
    assert node.cell.image.values[:3] == [True, -7, 12.5]
    assert [type(value) for value in node.cell.image.values[:3]] == [bool, int, float]
    assert node.cell.ownership.owners[:3] == [LINE, LINE, LINE]
    assert node.cell.image.times[START] == 1.0
    assert node.dictionary.read(0x2010, 1) == struct.pack("<i", -7)


def test_writing_clamps_where_the_mapping_says_so(node: Node) -> None:
    assert node.write(0x2030, 1, struct.pack("<f", 7.0)) is None
    assert node.cell.image.values[SPEED] == 1.0


@pytest.mark.parametrize("limit", [0.05, -0.3])
def test_a_real32_that_is_nearest_to_a_limit_is_the_limit(limit: float) -> None:
    """The master's REAL32 of 0.05 decodes to more than 0.05; the robot gets 0.05."""
    limited = replace(VARIABLES[SPEED], limits=Limits(-0.3, 0.05))
    node = Node(
        definition=replace(DEFINITION, variables=(*VARIABLES[:SPEED], limited, *VARIABLES[SPEED + 1 :]))
    )
    node.connect()
    assert node.write(0x2030, 1, struct.pack("<f", limit)) is None
    assert node.cell.image.values[SPEED] == limit
    assert node.write(0x2030, 1, struct.pack("<f", 0.050000005)) is AbortCode.VALUE_TOO_HIGH


def held(node: Node) -> None:
    assert node.cell.request(Requester(HMI), PART, node.now) is None


def lost(node: Node) -> None:
    node.cell.robot_lost("gone", node.now)


def claimed(node: Node) -> None:
    node.cell.set_availability([PART], False, "in use", node.now)


def unheard(node: Node) -> None:
    node.heard = False


def nothing(_node: Node) -> None:
    pass


@pytest.mark.parametrize(
    "before, index, subindex, data, code, reason",
    [
        pytest.param(nothing, 0x2010, 2, bytes(4), AbortCode.READ_ONLY, Reason.NOT_WRITABLE, id="never"),
        pytest.param(held, 0x2010, 1, bytes(4), AbortCode.LOCAL_CONTROL, Reason.HELD, id="held"),
        pytest.param(lost, 0x2010, 1, bytes(4), AbortCode.DEVICE_STATE, Reason.ROBOT_LOST, id="robot lost"),
        pytest.param(
            unheard, 0x2010, 1, bytes(4), AbortCode.DEVICE_STATE, Reason.HEARTBEAT_LOST, id="not heard"
        ),
        pytest.param(
            claimed, 0x2010, 1, bytes(4), AbortCode.DEVICE_STATE, Reason.CLAIMED_ELSEWHERE, id="claimed"
        ),
        pytest.param(
            nothing, 0x2010, 1, b"\x65\0\0\0", AbortCode.VALUE_TOO_HIGH, Reason.OUT_OF_LIMITS, id="too high"
        ),
        pytest.param(
            nothing,
            0x2010,
            1,
            struct.pack("<i", -10),
            AbortCode.VALUE_TOO_LOW,
            Reason.OUT_OF_LIMITS,
            id="too low",
        ),
        pytest.param(
            nothing,
            0x2020,
            1,
            struct.pack("<d", math.nan),
            AbortCode.INVALID_VALUE,
            Reason.OUT_OF_LIMITS,
            id="NaN",
        ),
        pytest.param(
            nothing, 0x2000, 1, b"\2", AbortCode.VALUE_TOO_HIGH, Reason.OUT_OF_LIMITS, id="no BOOLEAN"
        ),
        pytest.param(nothing, 0x2010, 1, bytes(2), AbortCode.LENGTH, Reason.PARTIAL_VALUE, id="part"),
        pytest.param(nothing, 0x2010, 1, bytes(8), AbortCode.LENGTH, Reason.PARTIAL_VALUE, id="too much"),
        pytest.param(nothing, 0x2010, 1, b"", AbortCode.LENGTH, Reason.PARTIAL_VALUE, id="nothing"),
    ],
)
def test_refusals_have_their_abort_code_and_are_recorded(
    node: Node,
    before: Callable[[Node], None],
    *,
    index: int,
    subindex: int,
    data: bytes,
    code: AbortCode,
    reason: Reason,
) -> None:
    before(node)
    values = list(node.cell.image.values)
    assert node.write(index, subindex, data) is code
    assert node.cell.image.values == values
    last = node.cell.last_refusal
    assert last is not None
    assert (last.refusal.reason, last.writer) == (reason, LINE)
    assert node.cell.health.writes_refused == 1


def test_outputs_are_read_only(node: Node) -> None:
    assert node.write(0x2460, 1, bytes(2)) is AbortCode.READ_ONLY


def test_an_integer_takes_no_real_that_is_none() -> None:
    node = Node(replace(PLAN, objects=(ObjectPlan(STRANGE, 0x2030, 1, CanType.REAL32),), sdo_writer=HMI))
    node.connect()
    assert node.write(0x2030, 1, struct.pack("<f", math.inf)) is AbortCode.INVALID_VALUE
    assert node.write(0x2030, 1, struct.pack("<f", -3.0)) is None
    assert node.cell.image.values[STRANGE] == -3


def test_nothing_is_written_before_the_transfer_is_complete(node: Node) -> None:
    data = struct.pack("<d", 12.5)
    assert node.server.receive(bytes.fromhex("2120200108000000"), 0.0)[0][0] == 0x60
    assert node.server.receive(b"\0" + data[:7], 0.0)[0][0] == 0x20
    assert node.cell.image.values[FORCE] == 0.0
    assert node.server.receive(b"\x1d" + data[7:] + bytes(6), 0.0)[0][0] == 0x30
    assert node.cell.image.values[FORCE] == 12.5


def test_a_refused_segmented_write_is_not_confirmed(node: Node) -> None:
    data = struct.pack("<d", 151.0)
    node.server.receive(bytes.fromhex("2120200108000000"), 0.0)
    node.server.receive(b"\0" + data[:7], 0.0)
    answer = struct.pack("<BHBI", 0x80, 0x2020, 1, AbortCode.VALUE_TOO_HIGH)
    assert node.server.receive(b"\x1d" + data[7:] + bytes(6), 0.0) == [answer]


@given(st.sampled_from(PLAN.objects), st.binary(max_size=9))
def test_any_bytes_are_written_or_refused(item: ObjectPlan, data: bytes) -> None:
    """What was taken is read back; what was refused has changed nothing."""
    node = Node()
    node.connect()
    before = list(node.cell.image.values)
    code = node.write(item.index, item.subindex, data)
    if code is not None:
        assert node.cell.image.values == before
    elif item.variable != SPEED:
        assert node.dictionary.read(item.index, item.subindex) == data
