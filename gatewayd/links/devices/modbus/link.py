"""The link to one Modbus device: a station of a line on one side, a writer and outputs of a cell on the other."""

from __future__ import annotations

import logging
from collections.abc import Collection, Hashable
from typing import Final

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Value
from gatewayd.links.access import AccessError, AccessProblem, PlaceAnswer, PlaceRequest
from gatewayd.links.contract import Context, LinkHealth
from gatewayd.links.devices.family import FamilyRuntime
from gatewayd.links.devices.link import DeviceLink
from gatewayd.links.devices.modbus.asking import ask_place, exchange
from gatewayd.links.devices.modbus.lines import ModbusLines
from gatewayd.links.devices.modbus.orders import OrderMaker
from gatewayd.links.devices.modbus.plan import ModbusDevicePlan
from gatewayd.links.devices.modbus.polls import AnswerReader, polls_of
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.links.devices.status_words import DeviceFigures, DeviceState
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.mapping.plan import LinkPlan
from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.breaker import BreakerSettings
from gatewayd.modbus.client.grouping import ReadGroup, WantedItem
from gatewayd.modbus.client.identity import UnitIdentity
from gatewayd.modbus.client.requests import ExceptionAnswer, Failure
from gatewayd.modbus.client.station import Station
from gatewayd.modbus.client.unit import StationSettings, UnitState

_ASKED_LIMIT: Final = 5.0
"""Seconds for a request by hand, with its time in the queue of the line."""

log = logging.getLogger("gatewayd.devices")


class ModbusDeviceLink(DeviceLink):
    """Joins one device to a cell. Its line has the connection, and calls it as the listener of its station."""

    plan: ModbusDevicePlan

    def __init__(self, plan: ModbusDevicePlan, cell: Cell) -> None:
        self._answers = 0
        self._heard: float | None = None
        self._state_since = (DeviceState.STARTING, clock.now())
        super().__init__(plan, cell, f"{plan.name} ({plan.line.text} unit {plan.unit})")
        self._unread: dict[tuple[Area, int], str] = {}
        """Groups that the device refuses to be read, or that cannot be read, by area and address; and why."""
        self._unwritten: dict[Hashable, str] = {}
        """Writes that the device did not take, and why."""
        self._written: set[Hashable] = set()
        """Writes that it took the last time."""
        self._ended = False
        self.station = self._new_station()

    def begin_anew(self) -> None:
        """Its station was on a line that is no more: another one takes its place."""
        if self.station.state is not UnitState.CONNECTING:
            self.station = self._new_station()

    def _new_station(self) -> Station:
        return Station(settings_of(self.plan, self._cell.definition), self)

    def _bind(self, cell: Cell) -> Collection[int]:
        inputs = self.plan.inputs(cell.definition)
        self._reader = AnswerReader(inputs)
        self._orders = OrderMaker(self.plan.outputs(cell.definition), self.plan.write)
        return [placed.variable for placed in inputs]

    def _is_there(self) -> bool:
        return self.station.state is UnitState.ONLINE

    @property
    def reachable(self) -> bool | None:
        """While the device answers, if it is a writer."""
        return None if self.plan.writer is None else self.station.state is UnitState.ONLINE

    def release(self, plan: LinkPlan | None, after: CellDefinition, now: float) -> None:
        """Another link takes the place of this one, and what the line still says is of no interest."""
        self._ended = self._ended or plan is None
        super().release(plan, after, now)

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Go on with the cell that succeeded the present one."""
        super().rebind(plan, cell, now)
        self._publish(now)

    def health(self) -> LinkHealth:
        """Whether it answers, and to everything."""
        now = clock.now()
        figures = {
            "family": self.plan.family,
            "address": self.plan.line.text,
            "unit": self.plan.unit,
            "since": round(max(0.0, now - self._state_since[1]), 3),
        }
        return self._figures(now).health(self.plan.name, figures)

    async def ask(self, request: PlaceRequest) -> PlaceAnswer:
        """Read or write a place by hand, between the polls."""
        if self.station.state is not UnitState.ONLINE:
            raise AccessError(
                AccessProblem.NO_ANSWER, f"device {self.plan.name} is not asked: {self._state()[1]}"
            )
        station = self.station
        return await ask_place(
            self.plan,
            self._cell.definition,
            request,
            lambda each: exchange(station, each, _ASKED_LIMIT),
        )

    def _figures(self, now: float) -> DeviceFigures:
        state, reason = self._state()
        counters = self.station.counters
        return DeviceFigures(
            state=state,
            reason=reason,
            round_trip=counters.round_trip.last if counters.round_trip.count else None,
            age=None if self._heard is None else now - self._heard,
            answers=counters.answers + counters.exceptions.total(),
            timeouts=counters.time_outs,
            errors=counters.bad_answers + counters.lost_requests,
            refused=counters.exceptions,
            losses=counters.losses,
        )

    def _state(self) -> tuple[DeviceState, str]:
        station = self.station
        if station.state is UnitState.CONNECTING:
            return DeviceState.STARTING, "it has not answered yet"
        if station.state is UnitState.LOST:
            return DeviceState.LOST, station.reason
        reason = next(iter((*self._unread.values(), *self._unwritten.values())), "")
        if not reason:
            return DeviceState.GOOD, ""
        return (DeviceState.REFUSING if self._refuses_everything else DeviceState.PARTIAL), reason

    @property
    def _refuses_everything(self) -> bool:
        """Whether nothing of what it was asked was of use: most likely it is another device, or another unit of it."""
        polls = self.station.settings.polls
        wanted = {(group.area, group.address) for poll in polls for group in poll.groups}
        return wanted <= self._unread.keys() and not self._written

    # -- called by the station ------------------------------------------------------------------------------------

    def values_read(self, group: ReadGroup, data: bytes, now: float) -> None:
        """An answer has come."""
        if self._unread.pop((group.area, group.address), None) is not None:
            log.info(
                "device is read again", extra=fields(**self._device_names(), values=self._variables(group))
            )
        self._inflow.receive(self._reader.values(group, data), now)

    def read_failed(self, group: ReadGroup, failure: Failure, now: float) -> None:
        """Some values were not read this time; they are lost once that lasts."""
        key, reason = (group.area, group.address), f"{self._variables(group)} cannot be read: {failure.text}"
        if self.station.state is UnitState.ONLINE and self._unread.get(key) != reason:
            self._unread[key] = reason
            values = self._variables(group)
            log.warning(
                "device is not read", extra=fields(**self._device_names(), values=values, reason=failure.text)
            )

    def write_done(self, key: Hashable, failure: Failure | None, now: float) -> None:
        """A write was confirmed or given up."""
        if failure is None:
            self._unwritten.pop(key, None)
            self._written.add(key)
            return
        self._written.discard(key)
        variable = self._orders.variable_of(key)
        name = "" if variable is None else self._cell.definition.variables[variable].name
        if variable is not None and not (isinstance(failure, ExceptionAnswer) and failure.is_refusal):
            self._outflow.unanswered(variable, now)
        reason = f"`{name}` was not written: {failure.text}"
        if self._unwritten.get(key) != reason:
            self._unwritten[key] = reason
            log.warning(
                "device did not take a value",
                extra=fields(**self._device_names(), variable=name, reason=failure.text),
            )

    def state_changed(self, state: UnitState, reason: str, now: float) -> None:
        """The device is there, or lost."""
        if self._ended:
            return
        self._unread.clear()
        self._unwritten.clear()
        self._written.clear()
        if state is UnitState.ONLINE:
            log.info("device answers", extra=fields(**self._device_names()))
            self._outflow.connect(now)
        else:
            self._report_loss(reason)
            self._inflow.lose(reason, now)
            self._outflow.lose()
        self._publish(now)

    def connection_renewed(self, now: float) -> None:
        """It was not lost, but may have begun anew."""
        self._outflow.renew(now)

    def identified(self, identity: UnitIdentity, former: UnitIdentity | None, now: float) -> None:
        """It has said which device it is."""
        changes = [] if former is None else identity.changes(former)
        if changes:
            log.warning(
                "another device has taken its place",
                extra=fields(**self._device_names(), detail=", ".join(changes)),
            )

    # -- inside --------------------------------------------------------------------------------------------------

    def _tick(self, now: float) -> None:
        state = self._state()[0]
        if state is not self._state_since[0]:
            self._state_since = (state, now)
        # Timers come after sockets: whatever waited there has been read by now.
        self._inflow.caught_up()
        self._give_up_late(now)
        self._outflow.tick(now)
        heard = self.station.counters.answers + self.station.counters.exceptions.total()
        if heard != self._answers:
            self._answers, self._heard = heard, now
        self._publish(now)

    def _publish(self, now: float) -> None:
        """Put what the status block has of the device where it takes it from."""
        self._cell.health.tables.setdefault("devices", {})[self.plan.number] = self._figures(now).words

    def _send(self, variable: int, _value: Value) -> None:
        now = clock.now()
        for key, order in self._orders.orders(variable, self._cell.image.values):
            self.station.write(key, order, now)

    def _variables(self, group: ReadGroup) -> str:
        return self._called(self._reader.variables(group))


def settings_of(plan: ModbusDevicePlan, cell: CellDefinition) -> StationSettings:
    """What its station is."""
    serial = None
    if plan.serial_number is not None:
        serial = WantedItem(Area.HOLDING, *plan.serial_number)
    return StationSettings(
        unit=plan.unit,
        polls=polls_of(plan.inputs(cell), plan.gap, single=plan.single),
        timeout=plan.timeout,
        breaker=BreakerSettings(failures=plan.failures, lost_after=plan.lost_after),
        in_flight=plan.in_flight,
        has_mask_write=plan.mask_write,
        is_identified=plan.identify,
        serial=serial,
        keepalive=plan.poll,
    )


class ModbusDeviceRuntime(FamilyRuntime):
    """Makes links to Modbus devices."""

    def share(self) -> ModbusLines:
        """All lines of a daemon."""
        return ModbusLines()

    def make(self, plan: DevicePlan, cell: Cell, context: Context) -> ModbusDeviceLink:
        """A link without a connection: `ModbusLines.serve` puts its station on a line."""
        assert isinstance(plan, ModbusDevicePlan)
        return ModbusDeviceLink(plan, cell)


FAMILY: Final = ModbusDeviceRuntime()
"""Makes links of this family."""
