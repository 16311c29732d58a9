"""The plan of a device in words: what its family says, and what all devices have in common."""

from __future__ import annotations

from dataclasses import replace

from gatewayd.core.definition import CellDefinition
from gatewayd.links.contract import Description
from gatewayd.links.devices.families import description_of_family
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.report.format import seconds


def description(plan: DevicePlan, cell: CellDefinition) -> Description:
    """Settings, places, and the writer that the device is."""
    found = description_of_family(plan.family)(plan, cell)
    common = {
        "lost_after": seconds(plan.lost_after),
        "watchdog": seconds(plan.watchdog) or "none",
    }
    writers = {} if plan.writer is None else {plan.writer: f"device {plan.name}"}
    return replace(
        found,
        settings={**found.settings, **common},
        writers=writers,
        fields={**found.fields, "family": plan.family},
    )
