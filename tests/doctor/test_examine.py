from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import replace

import pytest

from gatewayd.control.running import RunningGateways
from gatewayd.core.definition import CellDefinition
from gatewayd.doctor import examine as examining
from gatewayd.doctor.examine import about_gateway, about_machine, about_mapping, examine
from gatewayd.links.examination import Examination, Observation, Outcome, RunningCell, Surroundings
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import LinkPlan
from tests.control.served import plan


class _Look(Examination):
    """Reports the kind of what it is given, and what surrounds it."""

    async def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        yield Observation.well(plan.kind, f"{cell.name} {around.probe_claims} {len(around.running)}")


def served(*problems: str, fingerprint: str | None = None, name: str = "press") -> RunningGateways:
    own = f"{plan().cell.fingerprint:08X}"
    status = {"name": name, "fingerprint": fingerprint or own, "problems": list(problems)}
    return RunningGateways(("/run/s",), (RunningCell("/run/s", status),))


async def test_every_link_is_looked_at_in_the_order_of_the_kinds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(examining, "examination_of", lambda _key: _Look())
    turned = replace(plan(), links=dict(reversed(list(plan().links.items()))))
    lines = [line async for line in examine(turned, served(), probe_claims=True)]
    assert [(line.cell, line.link, line.observation.text) for line in lines[1:]] == [
        ("press", "robot", "press True 1"),
        ("press", "modbus", "press True 1"),
    ]


async def test_a_kind_that_has_nothing_to_look_at_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(examining, "examination_of", lambda _key: None)
    assert [line.link async for line in examine(plan(), RunningGateways())] == ["gateway"]


@pytest.mark.parametrize(
    "gateways, outcomes, text",
    [
        (RunningGateways(), [Outcome.OK], "no gateway runs on this machine"),
        (served(), [Outcome.OK], "by the gateway at /run/s, and well"),
        (served("robot silent", "writer plc lost"), [Outcome.WARNING], "robot silent; writer plc lost"),
        (served(name="other"), [Outcome.NOTE], "serves 1 cell, not this one"),
        (served(fingerprint="00000000"), [Outcome.OK, Outcome.NOTE], "another state of this mapping"),
    ],
)
def test_what_runs_here_is_said(gateways: RunningGateways, outcomes: list[Outcome], text: str) -> None:
    found = list(about_gateway(plan(), gateways))
    assert [seen.outcome for seen in found] == outcomes
    assert text in found[-1].text


def test_a_gateway_that_does_not_answer_is_a_warning_with_its_reason() -> None:
    (line,) = about_machine(RunningGateways(silent=(("/run/s", "you may not use /run/s"),)))
    assert (line.cell, line.observation.outcome) == ("", Outcome.WARNING)
    assert line.observation.text == "you may not use /run/s"


def test_a_mapping_with_errors_is_a_problem_and_warnings_are_none() -> None:
    broken = about_mapping(load(b"gatewayd: 1\n", "a.yaml"))
    assert broken.observation.outcome is Outcome.PROBLEM
    assert "`gatewayd check a.yaml`" in broken.observation.remedy
    text = b"""\
gatewayd: 1
cell: a
robot: {host: 127.0.0.1}
modbus: {listen: '127.0.0.1:1502'}
variables: {q: {robot: robot_mode, modbus: 0}}
"""
    assert not about_mapping(load(text, "a.yaml")).observation.outcome.is_finding
