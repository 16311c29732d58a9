"""What is told is exactly what is documented, and problems are told in words."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from gatewayd.canopen.bus import BusState
from gatewayd.control.api import Api
from gatewayd.control.views import cell_view, declare
from gatewayd.core.admission import Change
from gatewayd.core.requester import Requester
from gatewayd.core.unserved import Unserved
from gatewayd.links.canopen_node.plan import CanopenPlan, canopen_of
from gatewayd.links.canopen_node.runtime import CanLink
from gatewayd.mapping.loader import load
from gatewayd.report.schema import documented
from gatewayd.report.summary import summary
from gatewayd.report.verdict import verdict_of
from gatewayd.service.cell_runtime import CellRuntime
from tests.control.served import CYCLES, LIMIT, SPEED, Served, at
from tests.works import finished

PLC, HMI = 0, 1


def test_the_status_has_the_documented_fields(api: Api, press: Served) -> None:
    assert press.cell.write(Requester(PLC), [Change(LIMIT, 999.0)], 0.5) is not None
    press.cell.unserved(Requester(None, "192.0.2.7"), Unserved.NO_SUCH_UNIT, "asked unit 7", 0.5)
    status = finished(api.status(at(1.0)))
    (cell,) = status["cells"]
    assert status.keys() == documented()["status"].keys()
    assert cell.keys() == documented()["cell"].keys()
    assert cell["robot"].keys() == documented()["robot"].keys()
    assert cell["modbus"].keys() == documented()["modbus"].keys()
    assert cell["writers"][0].keys() == documented()["writer"].keys()
    assert cell["last_refusal"].keys() == documented()["refusal"].keys()
    assert cell["last_unserved"].keys() == documented()["unserved"].keys()
    assert cell["unserved"]["no_such_unit"] == sum(cell["unserved"].values()) == 1
    assert api.version().keys() == documented()["version"].keys()


def test_variables_and_locks_have_the_documented_fields(api: Api) -> None:
    assert all(
        one.keys() == documented()["variable"].keys()
        for one in finished(api.variables({}, at(1.0)))["variables"]
    )
    assert all(one.keys() == documented()["lock"].keys() for one in finished(api.locks({}, at(1.0)))["locks"])


def test_events_and_records_have_documented_fields_only(api: Api, press: Served) -> None:
    cell = press.cell
    assert cell.write(Requester(PLC), [Change(LIMIT, 1.0)], 1.0) is None
    assert cell.write(Requester(HMI), [Change(LIMIT, 2.0)], 1.1) is not None
    assert cell.operator.force(CYCLES, 5, 1.2, 2.0, "by anna") is None
    cell.operator.take_lock(2, 1.3, detail="by anna")
    cell.robot_lost("gone", 1.4)
    events = finished(api.events({}, at(2.0)))["events"]
    records = finished(api.audit({}, at(2.0)))["records"]
    assert len(events) > 6
    for told, fields, always in ((events, documented()["event"], 4), (records, documented()["audit"], 4)):
        for one in told:
            assert one.keys() <= fields.keys()
            assert list(one)[:always] == list(fields)[:always]
            assert one["text"]
            assert isinstance(one["bad"], bool)


def test_events_records_and_the_last_refusal_are_told_in_the_same_words(api: Api, press: Served) -> None:
    assert press.cell.write(Requester(PLC), [Change(SPEED, 1.0)], 1.0) is None
    assert press.cell.operator.force(SPEED, 2.0, 1.1, 2.0, "by anna") is None
    assert press.cell.write(Requester(PLC), [Change(LIMIT, 999.0)], 1.2) is not None
    same = [
        ("operator forced speed to 2 (by anna)", True),
        ("plc wrote limit = 999 N: refused, value out of limits, 0..150", True),
    ]
    for told in (finished(api.events({}, at(2.0)))["events"], finished(api.audit({}, at(2.0)))["records"]):
        assert [(one["text"], one["bad"]) for one in told][-2:] == same
    records = finished(api.audit({"writer": "plc", "variable": "speed"}, at(2.0)))["records"]
    assert [(one["text"], one["bad"]) for one in records] == [("plc wrote speed: 0 -> 1", False)]
    last = finished(api.status(at(2.0)))["cells"][0]["last_refusal"]
    assert last["text"] == "plc wrote limit: refused, value out of limits, 0..150"


def test_a_variable_tells_both_places_and_its_owner(api: Api, press: Served) -> None:
    assert press.cell.write(Requester(PLC), [Change(SPEED, 1.5)], 1.0) is None
    (speed,) = finished(api.variables({"name": "speed"}, at(1.5)))["variables"]
    assert speed["robot"] == "input_double_register_1"
    assert speed["modbus"] == [{"area": "holding", "address": 24, "bit": None, "notation": "400025"}]
    assert (speed["value"], speed["quality"], speed["age"]) == (1.5, "good", 0.5)
    assert (speed["lock"], speed["owner"], speed["lease"], speed["fallback"]) == ("motion", "plc", 1.5, 0.5)
    (cycles,) = finished(api.variables({"name": "cycles"}, at(1.5)))["variables"]
    assert [place["notation"] for place in cycles["modbus"]] == ["400101", "300008"]
    assert (cycles["lock"], cycles["owner"], cycles["fallback"]) == (None, None, "exception")


@pytest.mark.parametrize(
    "name, robot, notation",
    [
        ("start", "input_bit_register_33", "400001.1"),
        ("tcp[2]", "actual_TCP_pose[2]", "400209"),
        ("door", "actual_digital_input_bits.3", "100065"),
    ],
)
def test_the_robots_side_is_named_as_the_mapping_names_it(
    api: Api, name: str, robot: str, notation: str
) -> None:
    (found,) = finished(api.variables({"name": name}, at(1.0)))["variables"]
    assert (found["robot"], found["modbus"][0]["notation"]) == (robot, notation)


def test_a_force_is_told_with_what_is_left_of_it(api: Api, press: Served) -> None:
    assert press.cell.operator.force(CYCLES, 7, 1.0, 11.0) is None
    (found,) = finished(api.variables({"name": "cycles"}, at(4.0)))["variables"]
    assert (found["value"], found["quality"], found["age"]) == (7, "forced", 3.0)
    truth = {"reported": 1, "reported_quality": "good", "by": None}
    assert found["forced"] == {"value": 7, "remaining": 7.0} | truth


def test_a_forced_input_has_what_the_robot_reads_back_beside_it(api: Api, press: Served) -> None:
    def beside() -> tuple[object, object]:
        (found,) = finished(api.variables({"name": "limit"}, at(4.0)))["variables"]
        return found["forced"]["reported"], found["forced"]["reported_quality"]

    assert press.cell.operator.force(LIMIT, 7.0, 1.0, 11.0) is None
    assert beside() == (None, None)
    press.source.held = {LIMIT: 6.5}
    press.cell.package_arrived(4.0, 4.0)
    assert beside() == (6.5, "good")
    press.cell.robot_lost("gone", 4.0)
    assert beside() == (6.5, "stale")


def problems(served: Served, now: float) -> list[str]:
    return list(verdict_of(served, now).problems)


class TestProblems:
    def test_a_good_cell_has_none(self, press: Served) -> None:
        assert problems(press, 0.01) == []

    def test_a_lost_robot_and_for_how_long(self, press: Served) -> None:
        press.cell.robot_lost("gone", 1.0)
        assert problems(press, 8.0) == ["robot not connected for 8 s"]

    def test_why_the_robot_cannot_be_reached(self, api: Api, press: Served) -> None:
        """Cause and remedy."""
        press.cell.robot_lost("gone", 1.0)
        press.without_session("connection refused: the robot is booting")
        (cell,) = finished(api.status(at(8.0)))["cells"]
        assert cell["problems"] == ["robot not connected for 8 s: connection refused: the robot is booting"]

    def test_inputs_that_are_not_adopted(self, press: Served) -> None:
        press.cell.robot_connected(1.0)
        assert press.cell.package_arrived(1.0, 1.0)
        assert problems(press, 1.0) == ["the robot's inputs are not adopted yet, nothing can be written"]

    def test_what_is_unavailable_by_name(self, press: Served) -> None:
        press.cell.set_availability(range(5), False, "in use", 1.0)
        assert problems(press, 0.0) == ["5 of 12 variables unavailable: start, limit, speed and 2 more"]

    def test_what_the_operator_left_behind(self, press: Served) -> None:
        assert press.cell.operator.force(SPEED, 1.0, 0.0, 9.0) is None
        assert problems(press, 0.0) == [
            "forced by the local operator: speed",
            "1 lock held by the local operator: motion",
        ]

    def test_a_writer_that_was_there_but_not_one_that_never_came(self, press: Served) -> None:
        press.cell.writer_connected(Requester(HMI), 0.0)
        press.cell.writer_disconnected(Requester(HMI), 0.0, "closed")
        assert problems(press, 0.0) == ["writer hmi lost for 0 s"]


def _texts(value: object) -> list[object]:
    if isinstance(value, Mapping):
        return [one for inner in value.values() for one in _texts(inner)]
    if isinstance(value, list):
        return [one for inner in value for one in _texts(inner)]
    return [value]


@pytest.mark.parametrize("odd", [math.nan, math.inf, -math.inf])
def test_odd_reals_are_still_json(api: Api, press: Served, odd: float) -> None:
    assert press.cell.write(Requester(PLC), [Change(SPEED, odd)], 1.0) is None
    answers: list[Mapping[str, Any]] = [
        finished(api.status(at(1.0))),
        finished(api.variables({}, at(1.0))),
        finished(api.events({}, at(1.0))),
        finished(api.audit({}, at(1.0))),
    ]
    assert str(odd) in _texts(json.loads(json.dumps(answers, allow_nan=False)))


def test_a_variable_on_canopen_tells_its_object_and_pdo() -> None:
    mapping = Path(__file__).parents[2] / "mappings" / "two-buses.yaml"
    plan = load(mapping.read_bytes(), mapping.name).plan
    assert plan is not None
    assert canopen_of(plan) is not None
    found = {one["name"]: one["canopen"] for one in declare(plan).variables}
    carried = {entry.variable for pdo in plan.the(CanopenPlan).pdos for entry in pdo.entries}
    for one in plan.the(CanopenPlan).objects:
        told = found[plan.cell.variables[one.variable].name]
        assert told["object"] == f"{one.index:04X}h:{one.subindex:02X}"
        assert told["type"] == one.type.name
        assert (told["cob_id"] is not None) == (one.variable in carried)
    assert carried


def test_a_bus_that_does_not_carry_is_a_problem(tmp_path: Path) -> None:
    mapping = Path(__file__).parents[2] / "mappings" / "two-buses.yaml"
    plan = load(mapping.read_bytes(), mapping.name).plan
    assert plan is not None
    runtime = CellRuntime(plan, tmp_path, 0.0)
    told = cell_view(runtime, declare(plan), 1.0)
    assert told["canopen"].keys() == documented()["canopen"].keys()
    assert (told["canopen"]["bus"], told["canopen"]["nmt_state"]) == ("absent", "initialising")
    assert "CAN bus absent" in told["problems"]
    assert "CAN bus absent" in summary([(runtime.cell, verdict_of(runtime, 1.0))])
    link = runtime.links["canopen"]
    assert isinstance(link, CanLink)
    link.node.bus = BusState.ACTIVE
    assert not any("CAN" in problem for problem in verdict_of(runtime, 1.0).problems)
    assert "CAN" not in summary([(runtime.cell, verdict_of(runtime, 1.0))])


def test_every_link_is_told_in_words(api: Api) -> None:
    robot, modbus = finished(api.status(at(0.0)))["cells"][0]["links"]
    assert robot.keys() == documented()["link"].keys()
    assert (robot["name"], robot["address"], robot["words"]) == (
        "robot",
        "192.0.2.10:30004",
        "fresh and writable",
    )
    assert (modbus["title"], modbus["level"]) == ("Modbus TCP server", "good")
    assert (modbus["address"], modbus["words"]) == ("127.0.0.1:1502 unit 1", "listening, no connections")
