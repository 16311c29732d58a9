"""The link to one device, whatever its family: a writer of a cell that gets outputs, and goes on through reloads."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Collection, Mapping

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Value
from gatewayd.core.requester import Requester
from gatewayd.links.contract import Link
from gatewayd.links.devices.concerned import DeviceId
from gatewayd.links.devices.inflow import Inflow
from gatewayd.links.devices.outflow import Outflow
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.wording import names_and_more

PERIOD = 0.05
"""Seconds between two looks at what only time brings."""

log = logging.getLogger("gatewayd.devices")


class DeviceLink(Link):
    """Joins one device to a cell. The family says how values are got and sent, and whether the device is there."""

    title = "device"
    plan: DevicePlan

    def __init__(self, plan: DevicePlan, cell: Cell, peer: str) -> None:
        self._progress = 0
        self._stopping = False
        inputs = self._join(plan, cell)
        self._inflow = Inflow(cell, plan.writer, peer, inputs, plan.lost_after)
        self._outflow = Outflow(cell, plan.sendings, self._send)

    def _join(self, plan: DevicePlan, cell: Cell) -> Collection[int]:
        self.plan, self._cell = plan, cell
        inputs = self._bind(cell)
        cell.listeners.append(self._on_image)
        return inputs

    # -- what the family does ------------------------------------------------------------------------------------

    def _bind(self, cell: Cell) -> Collection[int]:
        """Work out from `plan` what a running link needs of the cell; the inputs that come from the device."""
        raise NotImplementedError

    def _renumber(self, indices: Mapping[int, int]) -> None:
        """Variables have other indices now: from each former one to its successor."""

    def _is_there(self) -> bool:
        """Whether the device answers: otherwise its values are lost with it."""
        raise NotImplementedError

    def _tick(self, now: float) -> None:
        """Look at what only time brings, and show how the device is."""
        raise NotImplementedError

    def _send(self, variable: int, value: Value) -> None:
        """Have an output sent to the device."""
        raise NotImplementedError

    # -- as a link ------------------------------------------------------------------------------------------------

    @property
    def device_id(self) -> DeviceId:
        """The device, for traces."""
        return DeviceId(self._cell.definition.name, self.plan.name)

    @property
    def progress(self) -> int:
        """Counts while the link's task goes on, whatever the device does."""
        return self._progress

    async def run(self) -> None:
        """Look at the time until cancelled; everything else is called by what has the connection."""
        while True:
            self._progress += 1
            self._tick(clock.now())
            await asyncio.sleep(PERIOD)

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`: what is read now may have waited."""
        self._inflow.gap(now - since)

    def departing(self, plan: LinkPlan | None, after: CellDefinition) -> Mapping[Requester, str]:
        """The device as a writer, where another link takes this one's place."""
        gone = plan is None and self._inflow.connected and self._inflow.requester.writer is not None
        return {self._inflow.requester: f"the device {self.plan.name} changes or ends"} if gone else {}

    def release(self, plan: LinkPlan | None, after: CellDefinition, now: float) -> None:
        """Another link takes the place of this one: what the device owns is released."""
        if plan is None:
            self._inflow.lose("the new mapping changes the device", now)
            self._outflow.lose()

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Go on, unnoticed by the device, with the cell that succeeded the present one."""
        assert isinstance(plan, DevicePlan)
        before = self._cell.definition
        places = {variable.name: index for index, variable in enumerate(cell.definition.variables)}
        indices = {
            index: places[variable.name]
            for index, variable in enumerate(before.variables)
            if variable.name in places
        }
        inputs = set(self._join(plan, cell))
        self._renumber(indices)
        self._inflow.rebind(cell, plan.writer, {old: new for old, new in indices.items() if new in inputs})
        self._outflow.rebind(cell, plan.sendings, indices)

    def flush(self, now: float) -> None:
        """Have what changed last ready to be sent."""
        self._outflow.update(now)

    def stop(self) -> None:
        """The gateway stops: that the device is asked no more is no loss to be reported."""
        self._stopping = True

    # -- for the family -------------------------------------------------------------------------------------------

    def _on_image(self, direction: Direction) -> None:
        if direction is Direction.OUTPUT:
            self.flush(clock.now())

    def _give_up_late(self, now: float) -> None:
        """Release what has not come for too long."""
        late = self._inflow.expire(now)
        if late and self._is_there():
            log.warning(
                "values of a device are lost", extra=fields(**self._device_names(), values=self._called(late))
            )

    def _report_loss(self, reason: str) -> None:
        if not self._stopping:
            log.warning("device lost", extra=fields(**self._device_names(), reason=reason))

    def _called(self, variables: Collection[int]) -> str:
        known = self._cell.definition.variables
        return names_and_more([known[index].name for index in variables])

    def _device_names(self) -> dict[str, object]:
        return {"cell": self._cell.definition.name, "device": self.plan.name}
