"""The link to one CANopen device: on one side a node that a manager cares for, on the other a writer and outputs."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Collection, Mapping
from typing import Final

from gatewayd.canopen.datatypes import Value as Raw
from gatewayd.canopen.describe import object_text
from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.manager.channel import SdoJob
from gatewayd.canopen.manager.emergency_text import EmergencyMessage
from gatewayd.canopen.manager.letters import BootError
from gatewayd.canopen.manager.node import NodeCondition
from gatewayd.canopen.sdo.client import SdoResult
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, Value, Variable
from gatewayd.links.access import AccessError, AccessProblem, PlaceAnswer, PlaceRequest
from gatewayd.links.canopen_values import fit, limits_of, meaning
from gatewayd.links.contract import Context, LinkHealth
from gatewayd.links.devices.canopen.asking import ask_object
from gatewayd.links.devices.canopen.buses import CanopenBuses
from gatewayd.links.devices.canopen.figures import figures_of, health_of, state_of
from gatewayd.links.devices.canopen.managed import ManagedDevice
from gatewayd.links.devices.canopen.plan import CanopenDevicePlan, ObjectPlace
from gatewayd.links.devices.family import FamilyRuntime
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.links.devices.status_words import DeviceState
from gatewayd.logs.records import fields
from gatewayd.loop import clock

LAST_SYNCHRONOUS = 240
"""Transmission types up to it are synchronous."""
_ASKED_LIMIT: Final = 10.0
"""Seconds for a transfer by hand, with its time in the queue of the device."""
CORE_TIME = 0.5
"""Seconds without a count of the core's heartbeat after which the core counts as stuck."""

log = logging.getLogger("gatewayd.devices")

Reading = Callable[[Raw], Value | None]


class CanopenDeviceLink(ManagedDevice):
    """Joins one device to a cell. `CanopenBuses` puts it into the care of its bus's manager."""

    plan: CanopenDevicePlan

    def __init__(self, plan: CanopenDevicePlan, cell: Cell) -> None:
        self.node, self.manager, self.clash = None, None, ""
        self.heard, self.emergency, self.losses = None, None, 0
        self.state_since = (DeviceState.STARTING, clock.now())
        self._beat = (-1, 0.0)
        self._latest: dict[int, Value | None] = {}
        """What PDOs have brought that come when a value changes, by variable."""
        self._unread: dict[tuple[int, int], str] = {}
        self._unwritten: dict[tuple[int, int], str] = {}
        self._written: set[tuple[int, int]] = set()
        """Objects that it took the last time."""
        super().__init__(plan, cell, f"{plan.name} ({plan.address})")

    def _bind(self, cell: Cell) -> Collection[int]:
        plan, variables = self.plan, cell.definition.variables
        inputs = [place for place in plan.places if variables[place.variable].direction is Direction.INPUT]
        self._outputs: dict[int, list[ObjectPlace]] = {}
        for place in plan.places:
            if variables[place.variable].direction is Direction.OUTPUT:
                self._outputs.setdefault(place.variable, []).append(place)
        self._by_pdo: dict[int, list[tuple[int, int, Reading]]] = {}
        self._by_object: dict[tuple[int, int], list[tuple[int, Reading, int | None]]] = {}
        for place in inputs:
            reading = reading_of(place, variables[place.variable])
            at = place.index, place.subindex
            self._by_object.setdefault(at, []).append((place.variable, reading, place.pdo))
            if place.pdo is not None:
                self._by_pdo.setdefault(place.pdo, []).append((place.item, place.variable, reading))
        self._on_change = {
            number
            for number, pdo in enumerate(plan.node.pdos)
            if pdo.transmission is None or pdo.transmission > LAST_SYNCHRONOUS
        }
        return [place.variable for place in inputs]

    def _renumber(self, indices: Mapping[int, int]) -> None:
        self._latest = {indices[index]: value for index, value in self._latest.items() if index in indices}

    def _is_there(self) -> bool:
        return self.node is not None and self.node.condition is NodeCondition.OPERATIONAL

    def flush(self, now: float) -> None:
        """Have what changed last sent."""
        super().flush(now)
        self._hand_over(now)

    async def ask(self, request: PlaceRequest) -> PlaceAnswer:
        """Read or write an object by hand, in the turn of the device's SDO channel."""
        return await ask_object(self.plan, self._cell.definition, request, self._transfer)

    async def _transfer(self, index: int, subindex: int, data: bytes | None) -> SdoResult:
        node, manager = self.node, self.manager
        if node is None or manager is None or not manager.bus.carries:
            raise AccessError(
                AccessProblem.NO_ANSWER, f"device {self.plan.name} is not asked: {state_of(self)[1]}"
            )
        ended: asyncio.Future[SdoResult] = asyncio.get_running_loop().create_future()

        def done(result: SdoResult, _now: float) -> None:
            if not ended.done():
                ended.set_result(result)

        now = clock.now()
        if not node.channel.put(SdoJob(index, subindex, data, done), now):
            raise AccessError(
                AccessProblem.NO_ANSWER,
                f"device {self.plan.name} is not asked: too much waits for it already",
            )
        manager.schedule(now)
        try:
            async with asyncio.timeout(_ASKED_LIMIT):
                return await ended
        except TimeoutError:  # a boot has dropped what waited
            return SdoResult(index, subindex, code=AbortCode.TIMED_OUT, silent=True)

    def health(self) -> LinkHealth:
        """Whether it is in operation, and gives and takes everything."""
        return health_of(self, clock.now())

    def core_lives(self, now: float) -> bool:
        """Whether the core of the cell goes on: the manager's heartbeat says so to the devices."""
        count, since = self._beat
        if self._cell.health.heartbeat != count:
            self._beat = (self._cell.health.heartbeat, now)
            return True
        return now - since <= CORE_TIME

    @property
    def troubles(self) -> tuple[str, ...]:
        """What of it does not work although it is in operation, in words."""
        return (*self._unread.values(), *self._unwritten.values())

    @property
    def refuses_everything(self) -> bool:
        """Whether nothing of what it was asked was of use, and no PDO brings or takes anything."""
        if self.plan.node.pdos or self._written or not self.troubles:
            return False
        return self._by_object.keys() <= self._unread.keys()

    # -- called by the manager ------------------------------------------------------------------------------------

    def node_started(self, now: float) -> None:
        """It is in operation."""
        log.info("device in operation", extra=fields(**self._device_names(), found=self._letter()))
        self._forget()
        self.heard = now
        self._inflow.connect(now)
        self._outflow.connect(now)
        self._hand_over(now)

    def node_ended(self, reason: str, now: float) -> None:
        """It is lost as a writer, and nothing is sent to it."""
        self._report_loss(reason)
        self.losses += 1
        self._forget()
        self._inflow.lose(reason, now)
        self._outflow.lose()

    def node_seen(self, now: float) -> None:
        """What PDOs have brought that it sends on change is still so: it would have sent another one.

        What comes with SYNC is good only while it comes.
        """
        self.heard = now
        if self._latest:
            self._inflow.receive(list(self._latest.items()), now)

    def pdo_received(self, pdo: int, values: list[Raw], now: float) -> None:
        """Values that changed."""
        self.heard = now
        found = [(variable, reading(values[item])) for item, variable, reading in self._by_pdo.get(pdo, ())]
        if found:
            if pdo in self._on_change:
                self._latest.update(found)
            self._inflow.receive(found, now)

    def object_read(self, index: int, subindex: int, value: Raw, now: float) -> None:
        """A value by SDO: of those in PDOs the first one."""
        self.heard = now
        if self._unread.pop((index, subindex), None) is not None:
            log.info(
                "device is read again",
                extra=fields(**self._device_names(), object=object_text(index, subindex)),
            )
        found = []
        for variable, reading, pdo in self._by_object.get((index, subindex), ()):
            found.append((variable, reading(value)))
            if pdo in self._on_change:
                self._latest[variable] = found[-1][1]
        if found:
            self._inflow.receive(found, now)

    def object_unread(self, index: int, subindex: int, reason: str, now: float) -> None:
        """A value could not be read; it is lost once that lasts."""
        found = self._by_object.get((index, subindex), ())
        if all(pdo is not None for _, _, pdo in found):
            return  # a PDO brings it
        names = self._called([variable for variable, _, _ in found])
        text = f"{names} cannot be read: {reason}"
        if self._unread.get((index, subindex)) != text:
            self._unread[index, subindex] = text
            log.warning(
                "device is not read", extra=fields(**self._device_names(), values=names, reason=reason)
            )

    def object_unwritten(self, index: int, subindex: int, reason: str, now: float) -> None:
        """The device did not take a value."""
        self._written.discard((index, subindex))
        at = object_text(index, subindex)
        text = f"{at} was not written: {reason}"
        if self._unwritten.get((index, subindex)) != text:
            self._unwritten[index, subindex] = text
            log.warning(
                "device did not take a value", extra=fields(**self._device_names(), object=at, reason=reason)
            )

    def object_written(self, index: int, subindex: int, now: float) -> None:
        """The device took a value."""
        self.heard = now
        self._unwritten.pop((index, subindex), None)
        self._written.add((index, subindex))

    def emergency_received(self, message: EmergencyMessage, now: float) -> None:
        """It reports an error, or that it has gone."""
        self.emergency = None if message.is_reset else message
        level = logging.INFO if message.is_reset else logging.WARNING
        log.log(level, "device reports", extra=fields(**self._device_names(), emergency=str(message)))

    def boot_failed(self, letter: BootError, detail: str, now: float) -> None:
        """It cannot be taken into operation; said once for each reason."""
        reason = f"{letter.value} {letter.words}: {detail}"
        if reason != self._failed:
            self._failed = reason
            log.warning("device is not in operation", extra=fields(**self._device_names(), reason=reason))

    # -- inside --------------------------------------------------------------------------------------------------

    _failed = ""

    def _forget(self) -> None:
        self._latest.clear()
        self._unread.clear()
        self._unwritten.clear()
        self._written.clear()
        self.emergency = None
        self._failed = ""

    def _letter(self) -> str:
        return "" if self.node is None or self.node.boot.letter is None else self.node.boot.letter.words

    def _tick(self, now: float) -> None:
        state = state_of(self)[0]
        if state is not self.state_since[0]:
            self.state_since = (state, now)
        self._give_up_late(now)
        self._outflow.tick(now)
        self._hand_over(now)
        self._cell.health.tables.setdefault("devices", {})[self.plan.number] = figures_of(self, now).words

    def _hand_over(self, now: float) -> None:
        """Have what was written together sent together."""
        if self.node is not None and self.manager is not None:
            self.node.flush(now)
            self.manager.schedule(now)

    def _send(self, variable: int, value: Value) -> None:
        if self.node is None:
            return
        now = clock.now()
        for place in self._outputs[variable]:
            raw = fit(value, place.type, place.linear)
            if place.pdo is not None:
                self.node.write_pdo(place.pdo, place.item, raw, now)
            else:
                self.node.write_object(place.index, place.subindex, place.type.pack(raw), now)


def reading_of(place: ObjectPlace, variable: Variable) -> Reading:
    """What makes a value of the cell of what an object holds; None: it is no value of the robot's type."""
    reader = limits_of(variable, place.type, place.linear)
    return reader.read if reader is not None else meaning(variable.kind, place.linear)


class CanopenDeviceRuntime(FamilyRuntime):
    """Makes links to CANopen devices."""

    def share(self) -> CanopenBuses:
        """All buses of a daemon that have a manager."""
        return CanopenBuses()

    def make(self, plan: DevicePlan, cell: Cell, context: Context) -> CanopenDeviceLink:
        """A link without a manager: `CanopenBuses.serve` finds it one."""
        assert isinstance(plan, CanopenDevicePlan)
        return CanopenDeviceLink(plan, cell)


FAMILY: Final = CanopenDeviceRuntime()
"""Makes links of this family."""
