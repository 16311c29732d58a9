"""What status, page and verdict know of the controller."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from gatewayd.core.events import EventKind
from gatewayd.core.image import Quality
from gatewayd.links.contract import Level
from gatewayd.links.robot.controller import Contradiction, ControllerNotes, contradiction
from gatewayd.links.robot.plan import RobotPlan
from gatewayd.report.verdict import judge
from gatewayd.rtde.fields import Field, SoftwareVersion
from gatewayd.rtde.messages import TextMessage
from gatewayd.rtde.types import DataType
from tests.links.robot.rig import Rig, plan_for, rigged

Until = Callable[..., Awaitable[None]]

PART = """\
  part: {robot: input_int_register_3, modbus: 1}
  go:   {robot: input_bit_register_0, modbus: 0.0}
"""
DEXTERITY = """\
  part:      {robot: input_int_register_3, modbus: 1}
  dexterity: {robot: {field: dexterity, type: DOUBLE}, modbus: {holding: 10, type: float32}}
"""


def plan(series: str | None = None, version: str | None = None) -> RobotPlan:
    return RobotPlan("robot", 30004, 0.0, (), (), verify=True, series=series, version=version)


def figures(rig: Rig) -> Any:
    return rig.link.health().figures


def problems(rig: Rig) -> tuple[str, ...]:
    now = rig.cell.freshness.last_progress
    return judge(rig.cell, rig.link.health(), {}, now).problems


@pytest.mark.parametrize(
    "series, version, runs, found",
    [
        (None, None, "5.12.0", None),
        ("e", None, "5.12.0", None),
        ("e", "5.12.0", "5.12.0", None),
        (None, "5.12.0", "5.12.3", None),
        ("x", None, "5.12.0", Contradiction("the mapping says series x, the controller runs 5.12.0", True)),
        (
            "cb3",
            "3.15.0",
            "5.12.0",
            Contradiction("the mapping says series cb3, the controller runs 5.12.0", True),
        ),
        (
            None,
            "5.15.0",
            "5.12.0",
            Contradiction(
                "the mapping says software 5.15.0, the controller runs 5.12.0: fields that were checked may be missing",
                True,
            ),
        ),
        (
            "e",
            "5.12.0",
            "5.15.1",
            Contradiction(
                "the mapping says software 5.12.0, the controller runs 5.15.1, which is newer", False
            ),
        ),
        (
            None,
            "10.7.0",
            "5.12.0",
            Contradiction(
                "the mapping says software 10.7.0, the controller runs 5.12.0: fields that were checked may be missing",
                True,
            ),
        ),
    ],
)
def test_what_the_mapping_says_of_the_controller_is_compared_with_it(
    series: str | None, version: str | None, runs: str, found: Contradiction | None
) -> None:
    assert contradiction(plan(series, version), SoftwareVersion.parse(runs)) == found


def test_nothing_is_said_of_a_controller_that_was_never_there() -> None:
    notes = ControllerNotes()
    assert notes.problems(plan("x", "10.7.0")) == ()
    assert notes.figures(plan("x"), 1.0) == {
        "controller": None,
        "series": None,
        "protocol": None,
        "contradiction": None,
        "last_text": None,
        "unavailable": [],
        "held_elsewhere": [],
    }


def test_the_last_text_is_kept_with_its_age() -> None:
    notes = ControllerNotes()
    notes.text(TextMessage("first", "URControl", 3), 1.0)
    notes.text(TextMessage("SafetySetup has not been confirmed yet", "URControl", 2), 2.0)
    assert notes.figures(plan(), 4.5)["last_text"] == {
        "text": "SafetySetup has not been confirmed yet",
        "source": "URControl",
        "level": "warning",
        "age": 2.5,
    }
    notes.text(TextMessage("odd", "", 77), 5.0)
    last: Any = notes.figures(plan(), 5.0)["last_text"]
    assert last["level"] == "77"


async def test_which_register_another_client_holds_and_who_it_probably_is(until: Until) -> None:
    held = ["input_int_register_3", "input_bit_registers0_to_31"]
    async with rigged(PART, prepare=lambda robot: robot.controller.hold(held)) as rig:
        await until(lambda: rig.cell.image.quality == [Quality.UNAVAILABLE] * 2)
        found = figures(rig)
        assert [one["field"] for one in found["held_elsewhere"]] == held
        assert all("PROFINET" in one["probably"] for one in found["held_elsewhere"])
        assert [(one["field"], one["variables"]) for one in found["unavailable"]] == [
            ("input_int_register_3", ["part"]),
            ("input_bit_registers0_to_31", ["go"]),
        ]
        assert all(one["reason"].startswith("IN_USE: probably claimed by") for one in found["unavailable"])
        await until(lambda: rig.cell.freshness.last_progress > 0)
        said = "; ".join(problems(rig))
        assert f"another client holds {', '.join(held)}: probably the robot's PROFINET" in said
        assert "ur_rtde" not in said, "it has register 3 on software from 5.23 on, and this is 5.12"
        assert rig.link.health().level is Level.WARN
        rig.robot.controller.free(held)
        await until(lambda: rig.cell.image.quality == [Quality.GOOD] * 2)
        found = figures(rig)
        assert (found["held_elsewhere"], found["unavailable"]) == ([], [])
        assert problems(rig) == ()
        assert rig.link.health().level is Level.GOOD


async def test_a_register_that_only_the_watchdog_has_is_named_too(until: Until) -> None:
    options = ", watchdog: {field: input_int_register_9, requires: [plc]}"
    prepare = lambda robot: robot.controller.hold(["input_int_register_9"])  # noqa: E731
    async with rigged(PART, options=options, prepare=prepare) as rig:
        await until(lambda: rig.cell.accepts_writes)
        assert [one["field"] for one in figures(rig)["held_elsewhere"]] == ["input_int_register_9"]
        assert any("another client holds input_int_register_9" in problem for problem in problems(rig))


async def test_software_protocol_and_text_of_the_controller(until: Until) -> None:
    async with rigged(PART, version=SoftwareVersion(5, 20, 1)) as rig:
        await until(lambda: rig.cell.accepts_writes)
        found = figures(rig)
        assert (found["controller"], found["series"], found["protocol"]) == ("5.20.1.0", "e", 2)
        assert (found["contradiction"], found["last_text"]) == (None, None)
        rig.robot.say("Protective stop")
        await until(lambda: figures(rig)["last_text"])
        assert figures(rig)["last_text"]["text"] == "Protective stop"
        await rig.robot.stop()
        await until(lambda: not rig.cell.accepts_writes)
        assert figures(rig)["controller"] == "5.20.1.0"


@pytest.mark.parametrize(
    "options, words, grave",
    [
        (", series: x", "the mapping says series x, the controller runs 5.12.0", True),
        (", version: 5.15", "the mapping says software 5.15.0, the controller runs 5.12.0", True),
        (", version: 5.9", "the controller runs 5.12.0, which is newer", False),
    ],
)
async def test_a_controller_that_the_mapping_does_not_describe(
    options: str, words: str, grave: bool, until: Until
) -> None:
    async with rigged(PART, options=options) as rig:
        await until(lambda: rig.cell.accepts_writes)
        assert words in figures(rig)["contradiction"]
        assert any(words in problem for problem in problems(rig)) is grave


def test_what_is_said_of_the_controller_does_not_change_the_fingerprint() -> None:
    silent, said = plan_for(30004, PART), plan_for(30004, PART, ", series: e, version: 5.12")
    assert silent.cell.fingerprint == said.cell.fingerprint
    declared = plan_for(30004, DEXTERITY.replace("DOUBLE", "INT32").replace("float32", "int32"))
    assert declared.cell.fingerprint != plan_for(30004, DEXTERITY).cell.fingerprint


async def test_a_field_newer_than_the_catalogue_works_by_its_declared_type(until: Until) -> None:
    fields = [Field("dexterity", DataType.DOUBLE, "")]
    async with rigged(DEXTERITY, fields=fields) as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.robot.set("dexterity", 0.25)
        await until(lambda: rig.cell.image.values[1] == 0.25)
        assert rig.cell.image.quality[1] is Quality.GOOD
        assert problems(rig) == ()


@pytest.mark.parametrize(
    "fields, reason",
    [
        (
            [Field("dexterity", DataType.VECTOR3D, "")],
            "the controller answers VECTOR3D, but the mapping declares DOUBLE",
        ),
        ([], "NOT_FOUND: this controller's software does not have the field"),
    ],
    ids=["another type", "not there"],
)
async def test_the_controllers_answer_decides_about_a_declared_field(
    fields: list[Field], reason: str, until: Until
) -> None:
    async with rigged(DEXTERITY, fields=fields) as rig:
        await until(lambda: rig.cell.accepts_writes)
        assert rig.cell.image.quality == [Quality.GOOD, Quality.UNAVAILABLE]
        assert figures(rig)["unavailable"] == [
            {"field": "dexterity", "reason": reason, "variables": ["dexterity"]}
        ]
        assert f"dexterity: {reason}" in problems(rig)
        assert rig.events(EventKind.UNAVAILABLE) == [reason]
