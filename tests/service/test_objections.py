"""What a running cell objects to, by kind: what its owners would lose, and what its robot would keep."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.core.requester import Requester
from gatewayd.links.robot.plan import robot_of
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan
from gatewayd.report.diff import compare
from gatewayd.service.cell_runtime import CellRuntime
from gatewayd.service.objections import objections_of_change, objections_of_removal

TEXT = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1}
modbus: {listen: '127.0.0.1:1502'}
writers: {plc: {modbus: 127.0.0.2}, hmi: {modbus: 127.0.0.3}}
groups: {move: {owner: plc}}
variables:
  go:    {robot: input_bit_register_0, modbus: 0.0, owner: plc}
  part:  {robot: input_int_register_0, modbus: 1, owner: plc, on_release: hold}
  to:    {robot: input_int_register_1, modbus: 3, group: move}
  speed: {robot: input_int_register_2, modbus: 5, group: move}
  count: {robot: output_int_register_0, modbus: 100}
"""
GO, PART, TO, SPEED = range(4)
PLC = Requester(0)


def plan(*replaced: tuple[str, str]) -> Plan:
    text = TEXT
    for old, new in replaced:
        assert old in text
        text = text.replace(old, new)
    found = load(text.encode(), "press.yaml").plan
    assert found is not None
    return found


@pytest.fixture
def runtime(tmp_path: Path) -> CellRuntime:
    """`plc` owns all, `part` is 7, and the robot is there."""
    runtime = CellRuntime(plan(), tmp_path, 0.0)
    cell = runtime.cell
    cell.robot_connected(0.0)
    cell.adopt(dict.fromkeys(range(4), 0), 0.0)
    changes = [Change(GO, value=True), Change(PART, 7), Change(TO, 1), Change(SPEED, 2)]
    assert cell.write(PLC, changes, 1.0) is None
    return runtime


def asked(runtime: CellRuntime, new: Plan) -> list[Objection]:
    return objections_of_change(runtime, compare(runtime.plan, new))


def kinds(found: list[Objection]) -> list[str]:
    return [each.kind.value for each in found]


def test_who_owns_what_would_be_removed_loses_it(runtime: CellRuntime) -> None:
    line = next(line for line in TEXT.splitlines(keepends=True) if "  go:" in line)
    assert asked(runtime, plan((line, ""))) == [
        Objection(ObjectionKind.RELEASE, "`go` is owned by plc now and would be removed")
    ]


def test_who_may_own_it_no_more_loses_it(runtime: CellRuntime) -> None:
    found = asked(runtime, plan(("0.0, owner: plc", "0.0, owner: hmi")))
    assert found[0].text == "`go` is owned by plc now and would be released: not the same in the new mapping"
    assert found[0].kind is ObjectionKind.RELEASE


def test_a_group_is_one_loss(runtime: CellRuntime) -> None:
    found = asked(runtime, plan(("  speed: {robot: input_int_register_2, modbus: 5, group: move}\n", "")))
    assert [each.text.split(" now ")[0] for each in found] == ["`to` and `speed` are owned by plc"]


def test_another_robot_is_a_loss_of_everything_and_what_is_held_stays_in_the_present_one(
    runtime: CellRuntime,
) -> None:
    other = plan(("host: 127.0.0.1", "host: 127.0.0.9"))
    found = asked(runtime, other)
    assert kinds(found) == ["release", "left"]
    assert found[0].text.endswith("would be released: its robot would be another one")
    assert found[-1].text == "the robot would keep what it holds in `part`"
    assert runtime.succeed(other, 2.0) == ("part",)
    assert runtime.cell.ownership.owners == [None] * 3


def test_another_robot_is_nobodys_matter_while_this_one_holds_nothing(tmp_path: Path) -> None:
    runtime = CellRuntime(plan(), tmp_path, 0.0)
    assert asked(runtime, plan(("host: 127.0.0.1", "host: 127.0.0.9"))) == []


def test_a_robot_that_is_away_keeps_all_of_it(runtime: CellRuntime) -> None:
    runtime.cell.robot_lost("cable", 1.5)
    found = objections_of_removal(runtime)
    assert kinds(found) == ["gone", "release", "left"]
    assert found[-1].text == "the robot would keep what it holds in `go`, `part` and 2 more"


def test_a_force_that_would_end_is_a_loss(runtime: CellRuntime) -> None:
    count = 4
    assert runtime.cell.operator.force(count, 3, 1.0, 60.0, "anna") is None
    found = asked(
        runtime, plan(("  count: {robot: output_int_register_0", "  other: {robot: output_int_register_0"))
    )
    assert [each.text for each in found] == ["`count` is forced now, and the force would end"]


def test_the_watchdog_promises_and_pauses(tmp_path: Path) -> None:
    watched = ("host: 127.0.0.1", "host: 127.0.0.1, watchdog: {field: input_int_register_20, requires: plc}")
    runtime = CellRuntime(plan(watched), tmp_path, 0.0)
    slower = (watched[1][:-1], watched[1][:-1] + ", frequency: 5")
    cases = {
        ("weakening", "watchdog"): (watched, slower),
        ("weakening",): (watched, (", requires: plc", "")),
        ("watchdog",): (watched, ("host: 127.0.0.1", "frequency: 125, host: 127.0.0.1")),
    }
    for expected, changes in cases.items():
        assert kinds(asked(runtime, plan(*changes))) == list(expected)
    assert kinds(asked(runtime, plan())) == ["weakening"]
    other = (watched, ("register_20", "register_21"))
    assert kinds(asked(runtime, plan(*other))) == ["weakening", "watchdog"]


def test_what_the_session_subscribed_needs_no_new_one(runtime: CellRuntime) -> None:
    """An output that is dropped, and mapped again by the next reload."""
    link, whole = runtime.source, runtime.plan
    line = next(line for line in TEXT.splitlines(keepends=True) if "count:" in line)
    for new in (plan((line, "")), whole):
        runtime.succeed(new, 2.0)
        assert runtime.source is link
    assert robot_of(runtime.plan).outputs == robot_of(whole).outputs
    wider = replace(robot_of(whole), outputs=("output_int_register_7",))
    runtime.succeed(whole.with_links(robot=wider), 2.0)
    assert runtime.source is not link
