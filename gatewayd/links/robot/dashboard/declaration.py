"""What everybody may know of this kind of link."""

from __future__ import annotations

from gatewayd.core.definition import CellDefinition
from gatewayd.core.status_layout import StatusField
from gatewayd.links.contract import Description, LinkKind, LinkMetric, Names
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address, seconds

STATE_WORD, RESULT_WORD = "dashboard_state", "dashboard_result"


class DashboardKind(LinkKind):
    """The kind of the section `dashboard` in `robot`."""

    key = DashboardPlan.kind
    title = "dashboard server"
    traffic = "gatewayd.links.robot.dashboard.traffic"
    doctor = "gatewayd.links.robot.dashboard.doctor"
    fields = {  # noqa: RUF012 - never changed
        "address": "host:port of the dashboard server",
        "state": "`not connected`, `local control`, `remote control` or `connected` (the controller knows no local "
        "control)",
        "trouble": "why there is no connection, or empty",
        "connections": "connections since the start; the first one is not a reconnect",
        "commands": "commands that were sent to the robot",
        "refused": "commands that were not sent, or that the robot refused, by what became of them",
        "result": "what became of the last command, in words",
        "answer": "what the robot answered to it, or null",
        "loaded": "path of the loaded program; empty: none; null: not known",
    }
    status_fields = (
        StatusField(
            52,
            1,
            STATE_WORD,
            "dashboard server: 0 none declared, 1 not connected, 2 connected and in local control, 3 connected",
        ),
        StatusField(
            53,
            1,
            RESULT_WORD,
            "what became of the last command, see the state `result` of the dashboard server",
        ),
    )
    metrics = (
        LinkMetric("gatewayd_dashboard_up", "up", "1 while the dashboard server is connected"),
        LinkMetric(
            "gatewayd_dashboard_connections_total", "connections", "connections to the dashboard server"
        ),
        LinkMetric("gatewayd_dashboard_commands_total", "commands", "commands sent to the dashboard server"),
        LinkMetric(
            "gatewayd_dashboard_refused_total",
            "refused",
            "commands that were not sent, or that the robot refused, by what became of them",
            label="result",
        ),
    )

    def describe(self, plan: LinkPlan, cell: CellDefinition) -> Description:
        """Settings, address, and what the numbers of states mean."""
        # Words for people, which neither a check nor a start needs.
        from gatewayd.links.robot.dashboard.variables import VIA, meanings_of, name_of  # noqa: PLC0415

        assert isinstance(plan, DashboardPlan)
        where = address(plan.host, plan.port)
        programs = {number: file.rpartition("/")[2] for number, file in plan.programs}
        named = {"load": programs, "loaded": {0: "none of these", **programs}}
        own = {index: name_of(each.field) for index, each in enumerate(cell.variables) if each.via == VIA}
        words = {index: named.get(name) or meanings_of(name) for index, name in own.items()}
        return Description(
            settings={
                "host": plan.host,
                "port": str(plan.port),
                "poll": seconds(plan.period),
                "programs": Names(" ".join(f"{number}:{file!r}" for number, file in plan.programs)),
            },
            meanings={index: found for index, found in words.items() if found},
            address=where,
            fields={"address": where},
        )

    def fits(self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition) -> bool:
        """The connection goes on to the same server; what its numbers mean may differ."""
        assert isinstance(old, DashboardPlan)
        assert isinstance(new, DashboardPlan)
        return (old.host, old.port, old.period) == (new.host, new.port, new.period)


KIND = DashboardKind()
"""What everybody may know of this kind of link."""
