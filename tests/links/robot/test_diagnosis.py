from __future__ import annotations

import errno
import os
from dataclasses import replace

import pytest

from gatewayd.links.examination import Observation, Outcome
from gatewayd.links.robot import diagnosis
from gatewayd.links.robot.plan import RobotPlan
from gatewayd.mapping.plan import Plan
from gatewayd.rtde.fields import OUTPUTS, Series
from gatewayd.rtde.loss import Loss, LossReason
from gatewayd.rtde.messages import ControllerVersion, TextMessage
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.session import Session, Unavailable
from gatewayd.rtde.types import DataType
from gatewayd.rtde.visit import Visit
from tests.links.robot.rig import plan_for

MAPPING = """\
  part:  {robot: output_int_register_3, modbus: 1}
  pose:  {robot: actual_TCP_pose, modbus: 10}
  go:    {robot: input_bit_register_0, modbus: 0.0}
"""


def compiled() -> Plan:
    return plan_for(30004, MAPPING)


def robot(**settings: object) -> RobotPlan:
    return replace(compiled().the(RobotPlan), **settings)  # type: ignore[arg-type]


def session(
    *refused: Unavailable,
    protocol: int = 2,
    version: tuple[int, int, int, int] = (5, 12, 0, 1),
    **types: DataType,
) -> Session:
    names = ("timestamp", "output_int_register_3", "actual_TCP_pose")
    kinds = {name: types.get(name, OUTPUTS[name].type) for name in names}
    for one in refused:
        kinds.pop(one.field, None)
    controller = ControllerVersion(*version)
    series = Series.from_major(controller.major)
    return Session(
        controller, series, protocol, 0.008, Recipe(tuple(kinds), tuple(kinds.values())), {}, refused
    )


def absent(name: str, word: str = "NOT_FOUND", *, output: bool = True) -> Unavailable:
    return Unavailable(name, output, word, "")


def texts(found: list[Observation]) -> list[str]:
    return [f"{seen.outcome.value}: {seen.text}" for seen in found]


@pytest.mark.parametrize(
    "number, cause",
    [
        (errno.ECONNREFUSED, "its RTDE service is off"),
        (errno.ETIMEDOUT, "the robot is off or has another address"),
        (errno.EHOSTUNREACH, "a switch or firewall is between"),
        (errno.ECONNRESET, "ends connections at once"),
        (errno.EMFILE, "not known"),
    ],
)
def test_every_way_to_refuse_has_its_cause(number: int, cause: str) -> None:
    found = diagnosis.port_refused(OSError(number, os.strerror(number)), "robot:30004")
    assert found.text == f"robot:30004: {os.strerror(number).lower()}"
    assert cause in found.cause
    assert found.remedy


@pytest.mark.parametrize("reason", list(LossReason))
def test_every_loss_has_a_cause_and_a_remedy(reason: LossReason) -> None:
    found = diagnosis.session_missing(Loss(reason, "robot:30004: it failed"))
    assert (found.outcome, found.text) == (Outcome.PROBLEM, "robot:30004: it failed")
    assert found.cause
    assert found.remedy
    assert diagnosis.session_missing(None).text == "no session"


@pytest.mark.parametrize(
    "frequency, outcome", [(0.0, Outcome.NOTE), (125.0, Outcome.NOTE), (50.0, Outcome.WARNING)]
)
def test_protocol_1_matters_to_who_chose_a_rate(frequency: float, outcome: Outcome) -> None:
    service, _ = diagnosis.spoken(session(protocol=1), robot(frequency=frequency))
    assert service.outcome is outcome


@pytest.mark.parametrize(
    "series, version, outcome, text",
    [
        ("e", "5.12", Outcome.OK, "5.12.0.1, series e"),
        ("e", "5.9", Outcome.NOTE, "which is newer"),
        ("e", "5.23", Outcome.WARNING, "fields that were checked may be missing"),
        ("cb3", None, Outcome.WARNING, "the mapping says series cb3, the controller runs 5.12.0"),
        (None, None, Outcome.NOTE, "with `series: e` and `version: 5.12` in the mapping"),
    ],
)
def test_the_software_is_compared_with_the_mapping(
    series: str | None, version: str | None, outcome: Outcome, text: str
) -> None:
    *_, software = diagnosis.spoken(session(), robot(series=series, version=version))
    assert software.outcome is outcome
    assert text in software.text


def test_a_controller_of_an_unknown_series_is_said_to_be_one() -> None:
    *_, software = diagnosis.spoken(session(version=(7, 1, 0, 0)), robot())
    assert software == Observation.well("version", "7.1.0.0, series unknown")


def outputs(found: Session, *read: str, plan: RobotPlan | None = None) -> list[str]:
    return texts(list(diagnosis.outputs(found, plan or robot(), compiled().cell, read)))


def test_all_fields_there_is_one_line() -> None:
    assert outputs(session(), "input_bit_registers0_to_31") == [
        "ok: 3 of 3 fields of the mapping can be read"
    ]


def test_each_missing_field_is_named() -> None:
    found = session(absent("actual_TCP_pose"), absent("input_bit_registers0_to_31"))
    assert outputs(found, "input_bit_registers0_to_31") == [
        "problem: actual_TCP_pose: the controller does not have it",
        "problem: input_bit_registers0_to_31: the controller does not have it",
        "ok: 1 of 3 fields of the mapping can be read",
    ]


def test_a_field_that_the_list_had_no_room_for_is_named() -> None:
    assert outputs(session(absent("actual_TCP_pose", "TOO_LONG")))[0] == "problem: actual_TCP_pose: TOO_LONG"


def test_another_type_than_the_mappings_is_a_problem() -> None:
    (first, _) = outputs(session(output_int_register_3=DataType.DOUBLE))
    assert first.startswith("problem: part (output_int_register_3): the controller answers DOUBLE")


@pytest.mark.parametrize(
    "name, version, cause, remedy",
    [
        ("ft_raw_wrench", (5, 8, 0, 0), "from 5.9.0 on", "update the controller"),
        ("ft_raw_wrench", (3, 15, 0, 0), "series cb3 do not have it", "remove it"),
        ("actual_tcp_pose", (5, 12, 0, 0), "no guide has the name", "did you mean actual_TCP_pose?"),
        ("qqqqqq", (5, 12, 0, 0), "no guide has the name", "correct the name"),
    ],
)
def test_why_a_field_is_missing_is_what_the_guides_say(
    name: str, version: tuple[int, int, int, int], cause: str, remedy: str
) -> None:
    found = session(absent(name), version=version)
    (missing, *_) = diagnosis.outputs(found, robot(outputs=(name,)), compiled().cell, ())
    assert cause in missing.cause
    assert remedy in missing.remedy


def test_claims_are_grouped_by_who_probably_holds_them() -> None:
    words = {f"input_int_register_{number}": "IN_USE" for number in (0, 1, 20)}
    words |= {
        "input_int_register_30": "INT32",
        "input_int_register_31": "NOT_FOUND",
        "input_int_register_32": "?",
    }
    missing, lower, ranged, free = diagnosis.claims(words, session())
    assert missing.text == "input_int_register_31: the controller does not have it"
    assert lower.text == "in use by another client: input_int_register_0, input_int_register_1"
    assert "PROFINET or EtherNet/IP adapter" in lower.cause
    assert ranged.text == "in use by another client: input_int_register_20"
    assert "ur_rtde using its lower range" in ranged.cause
    assert texts([free]) == ["ok: 1 input can be claimed"]


def visited(**found: object) -> Visit:
    whole = Visit(session(), None, packages=126, span=1.0, advance=1.0)
    return replace(whole, **found)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "found, outcome, text",
    [
        (visited(), Outcome.OK, "125 Hz, 125 Hz agreed"),
        (visited(packages=81), Outcome.WARNING, "80 Hz, 125 Hz agreed: packages are left out"),
        (visited(packages=81, advance=0.64), Outcome.NOTE, "80 Hz, 125 Hz agreed: the controller's clock"),
        (visited(advance=0.0), Outcome.PROBLEM, "the controller's clock stands still (125 Hz)"),
        (visited(packages=1, span=0.0), Outcome.PROBLEM, "1 package came"),
        (
            visited(packages=0, span=0.0, loss=Loss(LossReason.SILENT, "no data for 3 s")),
            Outcome.PROBLEM,
            "no data for 3 s",
        ),
    ],
)
def test_the_rate_is_compared_with_what_was_agreed(found: Visit, outcome: Outcome, text: str) -> None:
    seen = diagnosis.rate(found, session())
    assert seen.outcome is outcome
    assert text in seen.text


def test_each_text_of_the_controller_is_said_once() -> None:
    message = TextMessage("confirm the safety set-up", "URControl", 2)
    found = list(diagnosis.text_messages([message, message, replace(message, level=9)]))
    assert [seen.text for seen in found] == [
        "the controller says (warning): confirm the safety set-up",
        "the controller says (level 9): confirm the safety set-up",
    ]
    assert {seen.outcome for seen in found} == {Outcome.NOTE}
