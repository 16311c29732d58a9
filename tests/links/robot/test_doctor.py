"""A look at a controller: the simulator in this process, and peers that are none."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Hashable, Iterable
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest

from gatewayd.links.examination import Observation, Outcome, RunningCell, Surroundings
from gatewayd.links.robot import doctor
from gatewayd.links.robot.declaration import KIND
from gatewayd.links.robot.doctor import EXAMINATION, carrier_of, wanted_inputs
from gatewayd.links.robot.plan import RobotPlan
from gatewayd.mapping.plan import Plan
from gatewayd.rtde import survey
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.faults import Faults
from gatewayd.simulator.server import SimulatedController
from tests.links.robot.rig import plan_for

MAPPING = """\
  cycles: {robot: output_int_register_0, modbus: 1}
  part:   {robot: input_int_register_3, modbus: 4}
  limit:  {robot: input_double_register_7, modbus: 10}
  volts:  {robot: standard_analog_output_0, modbus: {holding: 20, type: float32}}
  select: {robot: standard_analog_output_mask.0, modbus: 30.0}
"""


@pytest.fixture(autouse=True)
def _brief(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "LISTEN", 0.1)
    monkeypatch.setattr(survey, "RELEASE", 0.01)


@asynccontextmanager
async def simulated(**faults: object) -> AsyncIterator[tuple[SimulatedController, Plan]]:
    controller = Controller(faults=Faults(**faults))  # type: ignore[arg-type]
    async with SimulatedController(controller, host="127.0.0.1", port=0) as server:
        yield server, plan_for(server.port, MAPPING)


async def look(plan: Plan, *running: RunningCell, probe: bool = False) -> list[Observation]:
    around = Surroundings(running, probe)
    return [seen async for seen in EXAMINATION.examine(plan.the(RobotPlan), plan.cell, around)]


def of(found: list[Observation], check: str) -> list[str]:
    return [f"{seen.outcome.value}: {seen.text}" for seen in found if seen.check == check]


def serving(
    plan: Plan, *, host: str = "127.0.0.1", watchdog: bool | None = None, **figures: object
) -> RunningCell:
    robot = {"address": f"{host}:{plan.the(RobotPlan).port}", "watchdog": watchdog, **figures}
    status = {"name": "press", "links": [{"name": "robot", "title": KIND.title}], "robot": robot}
    variables = [
        {"direction": "input", "robot": "input_int_register_3"},
        {"direction": "input", "robot": "standard_analog_output_0"},
        {"direction": "output", "robot": "output_int_register_0"},
    ]
    return RunningCell("/run/s", status, variables)


async def test_a_well_robot_needs_nothing() -> None:
    async with simulated() as (_, plan):
        found = await look(plan)
    # A busy machine may simulate fewer cycles than it should.
    assert not [seen for seen in found if seen.outcome.is_finding and seen.check != "data"]
    assert [seen.check for seen in found] == [
        "name", "route", "port", "RTDE service", "version", "fields", "data", "claims",
    ]  # fmt: skip
    assert of(found, "claims")[0].startswith("skipped: 5 inputs not tried: only claiming shows")


async def test_nothing_is_claimed_unless_that_is_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    async with simulated() as (server, plan):
        claimed: list[str] = []
        claims = server.controller.claims
        claim = claims.claim

        def note(owner: Hashable, fields: Iterable[str]) -> frozenset[str]:
            names = tuple(fields)
            claimed.extend(names)
            return claim(owner, names)

        monkeypatch.setattr(claims, "claim", note)
        await look(plan)
        assert claimed == []
        await look(plan, probe=True)
        assert set(claimed) == set(wanted_inputs(plan.the(RobotPlan), plan.cell))


async def test_what_others_hold_is_named_with_who_that_probably_is() -> None:
    async with simulated(adapter="profinet") as (_, plan):
        found = await look(plan, probe=True)
    (registers, outputs) = (seen for seen in found if seen.check == "claims" and seen.outcome.is_finding)
    assert "input_int_register_3, input_double_register_7" in registers.text
    assert "PROFINET or EtherNet/IP adapter" in registers.cause
    assert "standard_analog_output_0" in outputs.text
    assert "ROS driver" in outputs.cause


async def test_what_the_gateway_of_this_machine_holds_is_not_somebody_elses() -> None:
    held = [{"field": "input_double_register_9", "probably": "a URCap"}]
    async with simulated(hold=("input_int_register_3", "standard_analog_output_type")) as (_, plan):
        found = await look(plan, serving(plan, held_elsewhere=held), probe=True)
    assert of(found, "claims")[1:] == [
        "ok: 2 inputs can be claimed",
        "ok: 3 inputs claimed by the gateway on this machine",
        "problem: in use by another client: input_double_register_9",
    ]


async def test_a_gateway_that_serves_another_robot_changes_nothing() -> None:
    async with simulated(hold=("input_int_register_3",)) as (_, plan):
        found = await look(plan, serving(plan, host="192.0.2.9"), probe=True)
    assert "problem: in use by another client: input_int_register_3" in of(found, "claims")


@pytest.mark.parametrize("watchdog, own", [(None, 3), (True, 4)])
def test_the_watchdog_is_claimed_by_a_gateway_that_feeds_one(watchdog: bool | None, own: int) -> None:
    plan = plan_for(30004, MAPPING)
    robot = replace(plan.the(RobotPlan), watchdog=plan_with_watchdog().watchdog)
    assert len(doctor.own_claims(robot, [serving(plan, watchdog=watchdog)])) == own


def plan_with_watchdog() -> RobotPlan:
    options = ", watchdog: {field: input_int_register_23, frequency: 10}"
    return plan_for(30004, MAPPING, options).the(RobotPlan)


def test_the_watchdogs_register_is_wanted_too() -> None:
    plan = plan_for(30004, MAPPING)
    assert wanted_inputs(plan_with_watchdog(), plan.cell)[-1] == "input_int_register_23"


@pytest.mark.parametrize(
    "faults, check, outcome",
    [
        ({"v1_only": True}, "RTDE service", Outcome.NOTE),
        ({"silence": True}, "data", Outcome.PROBLEM),
        ({"freeze": True}, "data", Outcome.PROBLEM),
        ({"text_on_connect": "SafetySetup has not been confirmed yet"}, "text", Outcome.NOTE),
    ],
)
async def test_faults_of_a_controller_are_seen(
    faults: dict[str, object], check: str, outcome: Outcome
) -> None:
    async with simulated(**faults) as (_, plan):
        found = await look(plan)
    assert [seen.outcome for seen in found if seen.check == check] == [outcome]


@asynccontextmanager
async def peer(answer: bytes, *, close: bool = False) -> AsyncIterator[Plan]:
    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(answer)
        if not close:
            await reader.read()
        writer.close()

    async with await asyncio.start_server(serve, "127.0.0.1", 0) as server:
        yield plan_for(server.sockets[0].getsockname()[1], MAPPING)


@pytest.mark.parametrize(
    "answer, close, words",
    [
        (b"", False, "did not arrive within"),
        (b"", True, "by the controller"),
        (b"\0\0\0\0", False, "is not RTDE"),
        (b"HTTP/1.1 200 OK\r\n", False, "did not arrive within"),
        (b"\x00\x05V\x01\x00\x00\x04\x76\x00", False, "did not arrive within"),
    ],
    ids=["silent", "closing", "garbage", "web server", "torn"],
)
async def test_who_is_no_controller_is_a_problem_and_ends_the_look(
    answer: bytes, close: bool, words: str
) -> None:
    async with peer(answer, close=close) as plan:
        found = await look(plan)
    (problem,) = (seen for seen in found if seen.outcome.is_finding)
    assert problem.check == "RTDE service"
    assert words in problem.text
    assert "data" not in [seen.check for seen in found]


async def test_a_refused_port_ends_the_look() -> None:
    async with peer(b"") as plan:
        pass
    found = await look(plan)
    assert [seen.check for seen in found] == ["name", "route", "port"]
    assert "its RTDE service is off" in found[-1].cause


async def test_a_name_that_nobody_knows_ends_the_look() -> None:
    plan = plan_for(30004, MAPPING)
    lost = replace(plan, links={**plan.links, "robot": replace(plan.the(RobotPlan), host="robot.invalid")})
    (found,) = await look(lost)
    assert (found.check, found.outcome) == ("name", Outcome.PROBLEM)
    assert found.text.startswith("robot.invalid: ")


@pytest.mark.parametrize(
    "name, field",
    [
        ("input_int_register_3", "input_int_register_3"),
        ("input_bit_register_5", "input_bit_registers0_to_31"),
        ("input_bit_register_63", "input_bit_registers32_to_63"),
        ("input_bit_register_64", "input_bit_register_64"),
        ("external_force_torque[2]", "external_force_torque"),
        ("speed_slider_mask.0", "speed_slider_mask"),
        ("", ""),
    ],
)
def test_the_field_of_what_the_control_interface_names(name: str, field: str) -> None:
    assert carrier_of(name) == field
