"""Nothing that a plan means is left out of what is said of it."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.heartbeat import Consumer
from gatewayd.canopen.sync import SyncPlan
from gatewayd.core.definition import Direction, Fallback, FallbackKind, Limits, ValueKind
from gatewayd.links.canopen_node.plan import CanopenPlan, IdentityPlan, ObjectPlan, PdoEntry, PdoPlan
from gatewayd.links.modbus_server.plan import ModbusPlan, SecuredPlan, TrustFiles
from gatewayd.links.robot.plan import RobotPlan
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan
from gatewayd.modbus.exceptions import ExceptionCode
from gatewayd.report import facts

TEXT = """\
gatewayd: 1
cell: press
robot:
  host: 127.0.0.1
  watchdog: {field: input_int_register_23, frequency: 10, requires: plc}
modbus: {listen: '127.0.0.1:1502', allow: [127.0.0.0/8], idle_timeout: 60s}
canopen:
  {channel: can0, bitrate: 500000, node: 16,
   pdos: {command: {variables: [order]}, answer: {status: [flags, quality of door]}}}
writers:
  plc:  {modbus: [127.0.0.2, 127.0.1.0/24], timeout: 100ms}
  hmi:  {modbus: 127.0.0.3}
  line: {canopen: rpdo, node: 1, heartbeat: 500ms}
groups: {motion: {owner: [plc, hmi], lease: 2s}}
variables:
  word:   {robot: input_bit_registers32_to_63, modbus: 0, owner: plc}
  bit:    {robot: input_bit_register_3, modbus: [{holding: 2.3}, {coil: 7}], owner: plc}
  order:  {robot: input_int_register_2, canopen: {type: UNSIGNED16}, owner: line}
  speed:  {robot: input_double_register_1, modbus: {holding: 24, type: int16, scale: 0.1, offset: -5, order: BADC},
           group: motion, limits: [-1, 1.5]}
  path:   {robot: input_int_register_1, modbus: 30, group: motion, on_release: 7}
  pose:   {robot: {field: 'actual_TCP_pose[2]', type: VECTOR6D}, modbus: 40, on_stale: exception}
  door:   {robot: actual_digital_input_bits.3, modbus: {discrete: 64}, on_stale: true, comment: front}
"""


@cache
def plan() -> Plan:
    loaded = load(TEXT.encode(), "cell.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def told(of: Plan) -> tuple[object, ...]:
    return facts.links(of), facts.writers(of), facts.groups(of), facts.variables(of)


def test_variables_are_told_as_the_file_spells_them() -> None:
    found = facts.variables(plan())
    assert found["word"]["robot"] == "input_bit_registers32_to_63"
    assert found["word"]["type"] == "uint32"
    assert found["bit"]["robot"] == "input_bit_register_3"
    assert found["bit"]["modbus"] == "holding 2.3 (400003.3), coil 7 (000008)"
    assert found["speed"]["modbus"] == "holding 24 (400025) int16 BADC * 0.1 + -5"
    assert found["speed"]["limits"] == "-1..1.5"
    assert (found["speed"]["group"], "owner" in found["speed"]) == ("motion", False)
    assert found["path"]["on_release"] == "7"
    assert (found["pose"]["robot"], found["pose"]["on_stale"]) == ("actual_TCP_pose[2]", "exception")
    assert (found["door"]["robot"], found["door"]["on_stale"]) == ("actual_digital_input_bits.3", "true")
    assert facts.groups(plan())["motion"] == {"members": "speed, path", "owner": "plc > hmi", "lease": "2 s"}
    assert facts.writers(plan())["plc"] == {"modbus": "127.0.0.2, 127.0.1.0/24", "timeout": "0.1 s"}


OTHERWISE: dict[type, Any] = {str: "other", bool: None, int: 77, float: 0.123456789, tuple: ()}
OF_LINKS: dict[str, Any] = {
    "watchdog": None,
    "sync": SyncPlan(producer=True),
    "identity": IdentityPlan(product=5),
    "guarded": (Consumer(0, 300, 0),),
    "rpdo_writer": 0,
    "sdo_writer": 0,
    "robot_away": ExceptionCode.BUSY,
    "tls": SecuredPlan("127.0.0.1", 802, TrustFiles("/own.crt", "/own.key", "/clients.crt", None)),
}
KNOWN = {
    "source", "fingerprint", "number", "name", "lock", "low", "high", "members", "kind", "cell", "shown", "shows_nan",
}  # fmt: skip
"""Fields that a difference is told by elsewhere (numbers, names), or that follow from others."""


def changed(value: Any) -> Any:
    match value:
        case bool():
            return not value
        case Direction():
            return Direction.OUTPUT if value is Direction.INPUT else Direction.INPUT
        case ValueKind():
            return ValueKind((value + 1) % 3)
        case Fallback():
            return Fallback(FallbackKind.VALUE, 55)
        case Limits() | None:
            return Limits(3, 4, clamp=True)
    return OTHERWISE[type(value)]


CASES = [
    *(("robot", field.name) for field in dataclasses.fields(plan().the(RobotPlan))),
    *(("modbus", field.name) for field in dataclasses.fields(plan().the(ModbusPlan))),
    *(("canopen", field.name) for field in dataclasses.fields(plan().the(CanopenPlan))),
    *(("variables", field.name) for field in dataclasses.fields(plan().cell.variables[0])),
    *(("locks", field.name) for field in dataclasses.fields(plan().cell.locks[0])),
    *(("writers", field.name) for field in dataclasses.fields(plan().cell.writers[0])),
    ("cell", "stale_after"),
    ("cell", "adopt_for"),
    ("cell", "clear_on_connect"),
]


@pytest.mark.parametrize("part, name", [case for case in CASES if case[1] not in KNOWN])
def test_whatever_differs_is_told(part: str, name: str) -> None:
    """Each field of the plan, by itself, to another value: some fact is another one."""
    old = plan()
    cell: Any = old.cell
    if part in old.links:
        section: Any = old.links[part]
        other = OF_LINKS[name] if name in OF_LINKS else changed(getattr(section, name))
        new = old.with_links(**{part: dataclasses.replace(section, **{name: other})})
    elif part == "cell":
        new = dataclasses.replace(old, cell=dataclasses.replace(cell, **{name: changed(getattr(cell, name))}))
    else:
        things = list(getattr(cell, part))
        # The last lock is the one with several owners; the last variable is an output, the first an input.
        index = -1 if part == "locks" or name == "on_stale" else 0
        other = {"bit": 3, "element": 3, "lease": 9.0}.get(name) or changed(getattr(things[index], name))
        things[index] = dataclasses.replace(things[index], **{name: other})
        new = dataclasses.replace(old, cell=dataclasses.replace(cell, **{part: tuple(things)}))
    assert told(new) != told(old)


NESTED = [
    *(("sync", field.name) for field in dataclasses.fields(SyncPlan)),
    *(("identity", field.name) for field in dataclasses.fields(IdentityPlan)),
    *(("consumers", field.name) for field in dataclasses.fields(Consumer)),
    *(("objects", field.name) for field in dataclasses.fields(ObjectPlan)),
    *(("pdos", field.name) for field in dataclasses.fields(PdoPlan)),
]


@pytest.mark.parametrize("part, name", NESTED)
def test_whatever_differs_inside_a_node_is_told(part: str, name: str) -> None:
    """Each field of the first PDO, object, watched node, and of SYNC."""
    old = plan()
    canopen: Any = old.the(CanopenPlan)
    things = getattr(canopen, part)
    first: Any = things[0] if isinstance(things, tuple) else things
    known: dict[str, Any] = {
        "writer": 0,
        "variable": 1,
        "linear": (2.0, 1.0),
        "type": CanType.REAL64,
        "revision": "auto",
        "serial": 5,
    }
    other = known[name] if name in known else changed(getattr(first, name))
    first = dataclasses.replace(first, **{name: other})
    new = old.with_links(
        canopen=dataclasses.replace(
            canopen, **{part: (first, *things[1:]) if isinstance(things, tuple) else first}
        )
    )
    assert told(new) != told(old)


@pytest.mark.parametrize("name", [field.name for field in dataclasses.fields(PdoEntry)])
def test_whatever_differs_in_an_entry_of_a_pdo_is_told(name: str) -> None:
    old = plan()
    canopen = old.the(CanopenPlan)
    pdo = canopen.pdos[0]
    entry: Any = pdo.entries[0]
    other = 1 if name in ("variable", "quality_of") else changed(getattr(entry, name))
    entry = dataclasses.replace(entry, **{name: other})
    pdos = (dataclasses.replace(pdo, entries=(entry, *pdo.entries[1:])), *canopen.pdos[1:])
    assert told(old.with_links(canopen=dataclasses.replace(canopen, pdos=pdos))) != told(old)


def test_keys_of_supervision_and_takeover_are_told() -> None:
    text = TEXT.replace("timeout: 100ms}", "timeout: 100ms, timeout_counts: writes, grace: 2s}")
    text = text.replace("{owner: [plc, hmi], lease: 2s}", "{owner: [plc, hmi], lease: 2s, whole: true}")
    text = text.replace("  host: 127.0.0.1\n", "  host: 127.0.0.1\n  adopt_for: none\n")
    loaded = load(text.replace("on_stale: exception", "valid: running").encode(), "cell.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    assert facts.writers(loaded.plan)["plc"] == {
        "modbus": "127.0.0.2, 127.0.1.0/24",
        "timeout": "0.1 s",
        "timeout_counts": "writes",
        "grace": "2 s",
    }
    assert facts.groups(loaded.plan)["motion"]["takeover"] == "whole"
    assert facts.variables(loaded.plan)["pose"]["valid"] == "running"
    robot = facts.links(loaded.plan)["robot"]
    assert robot["adopt_for"] == "none"
    assert "runtime_state" in robot["subscribed"].split()
    assert facts.links(plan())["robot"]["adopt_for"] == "10 s"


def test_status_words_in_a_pdo_are_told_by_name() -> None:
    settings = facts.links(plan())["canopen"]
    pdos = [text for name, text in settings.items() if name.startswith(("TPDO ", "RPDO "))]
    assert ["quality of door 5F40h:07/16" in text for text in pdos].count(True) == 1
    assert "".join(pdos).count("quality of") == 1
