"""What `gatewayd doctor` looks at of a device: what its family does."""

from __future__ import annotations

from collections.abc import AsyncIterator

from gatewayd.core.definition import CellDefinition
from gatewayd.links.devices.families import examination_of_family
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.links.examination import Examination, Observation, Surroundings
from gatewayd.mapping.plan import LinkPlan


class DeviceExamination(Examination):
    """See the module."""

    async def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        """See Examination."""
        assert isinstance(plan, DevicePlan)
        async for found in examination_of_family(plan.family).examine(plan, cell, around):
            yield found


EXAMINATION = DeviceExamination()
"""Looks at what this kind of link needs."""
