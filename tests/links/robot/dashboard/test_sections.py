"""Ports, times and programs of the section."""

from __future__ import annotations

import pytest

from gatewayd.links.robot.dashboard.plan import DashboardPlan
from tests.links.robot.dashboard.cells import loaded, planned

LINE = "  program: {dashboard: load, modbus: 2, owner: plc}\n"


def test_defaults_are_those_of_controllers() -> None:
    plan = planned(LINE, ", dashboard: {programs: {7: 'cell 3/pick.urp'}}").the(DashboardPlan)
    assert (plan.port, plan.period, plan.programs) == (29999, 0.5, ((7, "cell 3/pick.urp"),))


@pytest.mark.parametrize(
    "section, rule",
    [
        ("{programs: {0: pick.urp}}", "GW111"),
        ("{programs: {256: pick.urp}}", "GW111"),
        ("{programs: {01: pick.urp}}", "GW111"),
        ("{programs: {one: pick.urp}}", "GW111"),
        ("{programs: {1: ' pick.urp'}}", "GW850"),
        ('{programs: {1: "pick.urp\\nplay"}}', "GW850"),
        ("{programs: {1: grün.urp}}", "GW850"),
        ("{poll: 10ms}", "GW116"),
        ("{port: 0}", "GW116"),
        ("{ports: 1}", "GW108"),
    ],
)
def test_what_is_refused(section: str, rule: str) -> None:
    ids = {found.rule.id for found in loaded(LINE, f", dashboard: {section}").diagnostics}
    assert rule in ids, ids
