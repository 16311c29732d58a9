"""From an expanded cell to the plan that runs."""

from __future__ import annotations

import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.heartbeat import Consumer
from gatewayd.canopen.sync import SyncPlan
from gatewayd.core.definition import (
    Direction,
    Fallback,
    FallbackKind,
    Limits,
    Lock,
    ValueKind,
    Variable,
    Writer,
)
from gatewayd.links.canopen_node.plan import CanopenPlan, ObjectPlan, PdoEntry, PdoPlan, canopen_of
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.robot.plan import RobotPlan, WatchdogPlan, robot_of
from gatewayd.mapping.compile import compile_plan
from gatewayd.mapping.expand import expand
from gatewayd.mapping.plan import Plan
from gatewayd.mapping.reader import read_document
from gatewayd.mapping.source import parse
from gatewayd.modbus.areas import Area

FINGERPRINT = 0xABC6_4CDE
"""Of `GOOD`, since the first version of the language."""

GOOD = """gatewayd: 1
cell: press-3
robot:
  host: 192.0.2.10
  series: e
  frequency: 250
  watchdog: {field: input_int_register_23, frequency: 5, requires: [plc]}
modbus:
  listen: 127.0.0.1:1502
  allow: [192.0.2.0/24]
writers:
  hmi: {modbus: [192.0.2.0/28, 192.0.2.21], timeout: 3s}
  plc: {modbus: 192.0.2.20}
groups:
  motion: {owner: [plc, hmi], lease: 2s}
variables:
  start: {robot: input_bit_register_33, modbus: 0.0, owner: plc}
  force: {robot: input_double_register_0, modbus: {holding: 20, type: int16, scale: 0.1}, group: motion,
          limits: [0, 150], clamp: true, unit: N, comment: how hard, on_release: 10}
  speed: {robot: input_double_register_1, modbus: 24, group: motion, on_release: hold}
  clock: {robot: timestamp, modbus: 30}
  mode: {robot: robot_mode, modbus: [100, {input: 0, order: CDAB}], on_stale: -1}
  stop: {robot: input_bit_register_34, modbus: {coil: 1}, owner: [hmi, plc], on_release: true}
  lamps: {robot: output_bit_register_0..1, modbus: {discrete: 7}, on_stale: exception}
"""


def compiled(text: str = GOOD) -> Plan:
    document, findings = read_document(parse(text.encode(), "cell.yaml"))
    assert findings == ()
    return compile_plan(expand(document))


def variable(name: str) -> Variable:
    return next(found for found in compiled().cell.variables if found.name == name)


def test_variables_are_numbered_in_file_order() -> None:
    variables = compiled().cell.variables
    assert [found.number for found in variables] == list(range(1, 9))
    assert variables[-1].name == "lamps[1]"


def test_bit_of_a_register_word() -> None:
    start = variable("start")
    assert (start.direction, start.kind) == (Direction.INPUT, ValueKind.BOOL)
    assert (start.field, start.bit, start.element) == ("input_bit_registers32_to_63", 1, None)
    assert (start.low, start.high) == (None, None)


def test_everything_a_line_says_is_in_the_variable() -> None:
    force = variable("force")
    assert force.limits == Limits(0, 150, clamp=True)
    assert (force.unit, force.comment) == ("N", "how hard")
    assert force.on_release == Fallback(FallbackKind.VALUE, 10.0)
    assert type(force.on_release.value) is float
    assert variable("speed").on_release.kind is FallbackKind.HOLD
    assert variable("stop").on_release == Fallback(FallbackKind.VALUE, True)
    assert variable("lamps[0]").on_stale.kind is FallbackKind.EXCEPTION


def test_integers_know_the_range_of_the_robots_type() -> None:
    mode = variable("mode")
    assert (mode.low, mode.high, mode.on_stale.value) == (-(1 << 31), (1 << 31) - 1, -1)


def test_locks_and_writers_by_index() -> None:
    cell = compiled().cell
    assert cell.writers == (Writer("hmi", 3.0), Writer("plc", None))
    assert cell.locks == (
        Lock("start", (0,), (1,), takeover=False, lease=None),
        Lock("motion", (1, 2), (1, 0), takeover=True, lease=2.0),
        Lock("stop", (5,), (0, 1), takeover=True, lease=5.0),
    )
    assert [found.lock for found in cell.variables] == [0, 1, 1, None, None, 2, None, None]


def test_robot_plan_lists_fields_by_first_variable() -> None:
    """Without the timestamp, which the link asks for in any case, and without the watchdog's register."""
    robot = compiled().the(RobotPlan)
    assert robot.outputs == ("robot_mode", "output_bit_registers0_to_31")
    assert robot.inputs == (
        "input_bit_registers32_to_63",
        "input_double_register_0",
        "input_double_register_1",
    )
    assert robot.watchdog == WatchdogPlan("input_int_register_23", 5.0, (1,))
    assert (robot.host, robot.port, robot.frequency, robot.verify) == ("192.0.2.10", 30004, 250.0, True)


def test_modbus_plan() -> None:
    """Placements by variable; peers from the most specific network to the widest."""
    modbus = compiled().the(ModbusPlan)
    assert modbus is not None
    assert (modbus.host, modbus.port, modbus.unit, modbus.fill_gaps) == ("127.0.0.1", 1502, 1, False)
    assert [str(network) for network in modbus.allow] == ["192.0.2.0/24"]
    assert [(str(network), writer) for network, writer in modbus.writers] == [
        ("192.0.2.20/32", 1),
        ("192.0.2.21/32", 0),
        ("192.0.2.0/28", 0),
    ]
    places = [
        (placed.variable, placed.area, placed.address, placed.bit, placed.words)
        for placed in modbus.placements
    ]
    assert places == [
        (0, Area.HOLDING, 0, 0, 1),
        (1, Area.HOLDING, 20, None, 1),
        (2, Area.HOLDING, 24, None, 4),
        (3, Area.HOLDING, 30, None, 4),
        (4, Area.HOLDING, 100, None, 2),
        (4, Area.INPUT, 0, None, 2),
        (5, Area.COIL, 1, None, 1),
        (6, Area.DISCRETE, 7, None, 1),
        (7, Area.DISCRETE, 8, None, 1),
    ]
    codec = modbus.placements[1].codec
    assert codec is not None
    assert codec.encode(12.34) == (123).to_bytes(2, "big")


CANOPEN = """gatewayd: 1
cell: press-3
robot: {host: 192.0.2.10}
canopen:
  channel: can0
  bitrate: 500000
  node: 16
  heartbeat: 250ms
  sync: {cob_id: 0x90, producer: true, period: 12.5ms, counter: 10}
  pdo: {inhibit: 2.5ms, event: 300ms, deadline: 400ms}
  cob_ids: {tpdo: 0x680..0x68F}
  pdos:
    forces: {cob_id: 0x1C0, transmission: 4, sync_start: 2, inhibit: none, event: none, variables: force}
writers:
  hmi: {canopen: sdo}
  line: {canopen: rpdo, node: 1, heartbeat: 1.5s}
variables:
  start: {robot: input_bit_register_33, canopen: auto, owner: line}
  speed: {robot: input_double_register_1, canopen: {type: REAL32}, owner: [line, hmi]}
  mode: {robot: robot_mode, canopen: object}
  force: {robot: output_double_register_0, canopen: auto}
"""


def node(text: str = CANOPEN) -> CanopenPlan:
    found = compiled(text).the(CanopenPlan)
    assert found is not None
    return found


def test_canopen_plan() -> None:
    """Times in the units of the object dictionary, writers and variables by index."""
    plan = node()
    assert (plan.interface, plan.channel, plan.bitrate, plan.node) == ("socketcan", "can0", 500_000, 16)
    assert (plan.autostart, plan.heartbeat) == (False, 250)
    assert plan.sync == SyncPlan(0x90, producer=True, period=12_500, counter=10)
    assert plan.consumers == (Consumer(1, 1500, 1),)
    assert (plan.rpdo_writer, plan.sdo_writer) == (1, 0)
    assert plan.objects == (
        ObjectPlan(0, 0x2000, 1, CanType.BOOLEAN),
        ObjectPlan(1, 0x2030, 1, CanType.REAL32),
        ObjectPlan(2, 0x2410, 1, CanType.INTEGER32),
        ObjectPlan(3, 0x2420, 1, CanType.REAL64),
    )


def test_pdo_plans() -> None:
    """Those towards the robot first; a deadline is the event time of an RPDO."""
    bits, speed, forces = node().pdos
    assert (bits.number, bits.direction, bits.cob_id, bits.predefined) == (1, Direction.INPUT, 0x210, True)
    assert (bits.transmission, bits.inhibit, bits.event) == (254, 25, 400)
    assert speed.entries == (PdoEntry(1, 0x2030, 1, 32),)
    assert forces == PdoPlan(
        number=1,
        direction=Direction.OUTPUT,
        cob_id=0x1C0,
        predefined=False,
        transmission=4,
        inhibit=0,
        event=0,
        entries=(PdoEntry(3, 0x2420, 1, 64),),
        sync_start=2,
        name="forces",
    )


def test_without_a_heartbeat_and_without_writers() -> None:
    text = (
        "gatewayd: 1\ncell: c\nrobot: {host: r}\n"
        "canopen: {channel: can0, bitrate: 10000, node: 1, heartbeat: none}\n"
    )
    plan = node(f"{text}variables: {{a: {{robot: robot_mode, canopen: auto}}}}")
    assert (plan.heartbeat, plan.rpdo_writer, plan.sdo_writer, plan.consumers) == (0, None, None, ())
    assert plan.sync == SyncPlan()


CANOPEN_CHANGES = [
    ("can0", "can1"),
    ("bitrate: 500000", "bitrate: 250000"),
    ("node: 16", "node: 17"),
    ("heartbeat: 250ms", "heartbeat: none"),
    ("heartbeat: 250ms", "autostart: true"),
    ("cob_id: 0x90", "cob_id: 0x80"),
    ("producer: true", "producer: false"),
    ("12.5ms", "20ms"),
    ("counter: 10", "counter: 0"),
    ("inhibit: 2.5ms", "inhibit: 5ms"),
    ("event: 300ms", "transmission: sync"),
    ("deadline: 400ms", "deadline: none"),
    ("0x1C0", "0x1C1"),
    ("transmission: 4", "transmission: 5"),
    ("sync_start: 2", "sync_start: 3"),
    ("canopen: sdo", "canopen: any"),
    ("node: 1, heartbeat: 1.5s", "node: 2, heartbeat: 1.5s"),
    ("heartbeat: 1.5s", "heartbeat: 2s"),
    ("type: REAL32", "type: REAL64"),
    ("canopen: object", "canopen: auto"),
    ("robot_mode, canopen: object", "robot_mode, modbus: 4"),
]


def test_fingerprint_changes_with_the_canopen_side() -> None:
    """What a master was configured for is what it finds."""
    fingerprints = {compiled(CANOPEN).cell.fingerprint}
    for old, new in CANOPEN_CHANGES:
        assert old in CANOPEN, old
        fingerprints.add(compiled(CANOPEN.replace(old, new, 1)).cell.fingerprint)
    assert len(fingerprints) == len(CANOPEN_CHANGES) + 1


@pytest.mark.parametrize(
    "old, new", [("0x1C0", "0x1c0"), ("250ms", "0.25s"), ("canopen: auto, owner", "canopen: {}, owner")]
)
def test_fingerprint_stays_with_the_meaning_of_the_canopen_side(old: str, new: str) -> None:
    assert compiled(CANOPEN.replace(old, new, 1)).cell.fingerprint == compiled(CANOPEN).cell.fingerprint


def test_a_canopen_section_changes_nothing_for_those_without() -> None:
    """Fingerprints that PLCs have stored stay what they were."""
    assert compiled().links.get("canopen") is None
    assert compiled().cell.fingerprint == FINGERPRINT


def test_without_a_modbus_section_there_is_no_modbus_plan() -> None:
    text = "gatewayd: 1\ncell: c\nrobot: {host: r}\nvariables: {a: {robot: robot_mode}}"
    assert not compiled(text).of(ModbusPlan)


@pytest.mark.parametrize(
    "robot, seconds",
    [
        ("frequency: 250, series: e", 0.1),
        ("frequency: 10", 0.5),
        ("frequency: 40, series: cb3", 0.12),
        ("series: x", 0.1),
        ("frequency: 10, stale_after: 2s", 2.0),
    ],
)
def test_stale_after(robot: str, seconds: float) -> None:
    """Five periods as the controller divides them, at least 100 ms; or as the file says."""
    text = f"gatewayd: 1\ncell: c\nrobot: {{host: r, {robot}}}\nvariables: {{a: {{robot: robot_mode}}}}"
    assert compiled(text).cell.stale_after == pytest.approx(seconds)


def test_compiling_is_deterministic() -> None:
    assert compiled() == compiled()


@pytest.mark.parametrize(
    "old, new",
    [
        ("gatewayd: 1", "# a comment\ngatewayd: 1"),
        ("comment: how hard", "comment: rather hard"),
        ("{robot: timestamp, modbus: 30}", "{modbus: 30, robot: timestamp}"),
        ("{robot: timestamp, modbus: 30}", "{robot: 'timestamp', modbus: {holding: 30, type: float64}}"),
        ("timeout: 3s", "timeout: 3000ms"),
        ("modbus: 192.0.2.20", "modbus: [192.0.2.20/32]"),
        ("frequency: 250", "frequency: 250.0"),
    ],
)
def test_fingerprint_stays_with_the_meaning(old: str, new: str) -> None:
    """Comments, formatting and other words for the same thing do not count."""
    assert old in GOOD
    assert compiled(GOOD.replace(old, new)).cell.fingerprint == compiled().cell.fingerprint


CHANGES = [
    ("cell: press-3", "cell: press-4"),
    ("192.0.2.10", "192.0.2.11"),
    ("frequency: 250", "frequency: 125"),
    ("frequency: 5", "frequency: 6"),
    ("requires: [plc]", "requires: [hmi]"),
    ("127.0.0.1:1502", "127.0.0.1:1503"),
    ("allow: [192.0.2.0/24]", "allow: [192.0.2.0/23]"),
    ("192.0.2.21", "192.0.2.22"),
    ("timeout: 3s", "timeout: 4s"),
    ("lease: 2s", "lease: 3s"),
    ("owner: [plc, hmi]", "owner: [hmi, plc]"),
    ("start:", "begin:"),
    ("input_bit_register_33", "input_bit_register_35"),
    ("modbus: 0.0", "modbus: 0.1"),
    ("type: int16", "type: uint16"),
    ("scale: 0.1", "scale: 0.01"),
    ("limits: [0, 150]", "limits: [0, 151]"),
    ("clamp: true", "clamp: false"),
    ("unit: N", "unit: kN"),
    ("on_release: 10", "on_release: 0"),
    ("on_release: hold", "on_release: clear"),
    ("on_release: true", "on_release: false"),
    ("on_stale: -1", "on_stale: hold"),
    ("order: CDAB", "order: DCBA"),
    ("{coil: 1}", "{coil: 2}"),
    ("owner: [hmi, plc]", "takeover: false, owner: [hmi, plc]"),
    ("discrete: 7", "holding: 7.0"),
]


def test_fingerprint_changes_with_every_change_of_meaning() -> None:
    """A PLC that compares it knows that the map is the one it was built for."""
    fingerprints = {compiled().cell.fingerprint}
    for old, new in CHANGES:
        assert old in GOOD, old
        fingerprints.add(compiled(GOOD.replace(old, new)).cell.fingerprint)
    assert len(fingerprints) == len(CHANGES) + 1
    assert all(0 <= fingerprint < 1 << 32 for fingerprint in fingerprints)


def test_cell_with_errors_is_not_compiled() -> None:
    document, _ = read_document(parse(b"gatewayd: 1\ncell: c\nvariables: {}", "f"))
    with pytest.raises(ValueError, match="f has errors"):
        compile_plan(expand(document))


def keyed(*pairs: tuple[str, str]) -> Plan:
    """`GOOD` with some keys more."""
    text = GOOD
    for old, new in pairs:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return compiled(text)


@pytest.mark.parametrize(
    "written, seconds",
    [("", 10.0), ("adopt_for: 3s", 3.0), ("adopt_for: 10s", 10.0), ("adopt_for: none", None)],
)
def test_adopted_inputs_wait_for_an_owner(written: str, seconds: float | None) -> None:
    """The default counts for nothing in the fingerprint, written or not; every other value does."""
    plan = keyed(("  series: e\n", f"  series: e\n  {written}\n"))
    assert plan.cell.adopt_for == seconds
    assert (plan.cell.fingerprint == FINGERPRINT) is (seconds == 10.0)


def test_writers_keep_what_they_promise() -> None:
    plan = keyed(
        ("192.0.2.21], timeout: 3s}", "192.0.2.21], timeout: 3s, timeout_counts: writes, grace: 500ms}"),
        ("plc: {modbus: 192.0.2.20}", "plc: {canopen: sdo, node: 1, heartbeat: 1s, grace: none}"),
        ("writers:\n", "canopen: {channel: can0, bitrate: 500000, node: 16}\nwriters:\n"),
    )
    assert plan.cell.writers == (
        Writer("hmi", timeout=3.0, grace=0.5, counts_writes=True),
        Writer("plc", heartbeat=1.0),
    )


def test_a_group_may_be_whole() -> None:
    plan = keyed(("lease: 2s}\nvariables", "lease: 2s, whole: true}\nvariables"))
    assert [lock.name for lock in plan.cell.locks if lock.whole] == ["motion"]


def test_outputs_that_hang_on_the_program() -> None:
    """One variable, or all output registers; what says whether the program runs is then asked for."""
    one = keyed(("input: 0, order: CDAB}], ", "input: 0, order: CDAB}], valid: running, "))
    assert [variable.name for variable in one.cell.variables if variable.valid_running] == ["mode"]
    cell = keyed(("  series: e\n", "  series: e\n  valid: running\n"))
    assert [v.name for v in cell.cell.variables if v.valid_running] == ["lamps[0]", "lamps[1]"]
    for plan in (one, cell):
        assert robot_of(plan).outputs == ("robot_mode", "output_bit_registers0_to_31", "runtime_state")
        assert plan.cell.fingerprint != FINGERPRINT


def test_what_follows_from_places_is_no_meaning_of_its_own() -> None:
    """A later gatewayd may judge differently what a place can show."""
    plan = compiled()
    assert plan.cell.variables[1].shown == pytest.approx((-3276.85, 3276.75))
    assert plan.cell.fingerprint == FINGERPRINT


def test_status_words_are_entries_of_a_tpdo() -> None:
    """Objects without a variable of their own; a quality names the variable that it is of."""
    section = (
        "canopen: {channel: can0, bitrate: 500000, node: 16, "
        "pdos: {state: {status: [lag, quality of clock], variables: lamps}}}\nwriters:\n"
    )
    plan = keyed(("writers:\n", section))
    assert canopen_of(plan) is not None
    (pdo,) = plan.the(CanopenPlan).pdos
    assert pdo.direction is Direction.OUTPUT
    assert pdo.entries == (
        PdoEntry(None, 0x5F00, 30, 32),
        PdoEntry(None, 0x5F40, 4, 16, quality_of=3),
        PdoEntry(6, 0x2400, 1, 1),
        PdoEntry(7, 0x2400, 2, 1),
    )
