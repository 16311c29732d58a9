"""The CAN buses that this gateway manages: one manager for each, whatever cells its devices belong to.

A device comes and goes without the others on its bus noticing. Only where what they share changes (the manager's own
node-ID and heartbeat, SYNC, the bit-rate), the bus begins anew with all of them.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from gatewayd.canopen.cob_ids import node_of
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.manager.bus_manager import ManagerError
from gatewayd.canopen.manager.plan import ManagerPlan
from gatewayd.canopen.manager.runtime import Manager
from gatewayd.core.cell import Cell
from gatewayd.links.can_frames import packed
from gatewayd.links.contract import Link, Passage, Prepared, SharedPart, Tap
from gatewayd.links.devices.at_work import NothingPrepared, Work, WorkGroup, end_all
from gatewayd.links.devices.canopen.managed import ManagedDevice
from gatewayd.links.devices.concerned import Concerned, concerned_by
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.mapping.plan import Plan

log = logging.getLogger("gatewayd.devices")


@dataclass(eq=False, slots=True)
class _BusAtWork:
    """One bus with its devices, by node-ID."""

    manager: Manager
    links: dict[int, ManagedDevice] = field(default_factory=dict)
    work: Work = field(init=False)

    def __post_init__(self) -> None:
        """The manager at work."""
        self.work = Work(f"CAN manager {self.manager.plan.channel}", self.manager.run)

    def concerned(self, frame: Frame) -> Concerned:
        """The device whose frame it is, by its PDOs or the predefined connection set; otherwise all of them."""
        number = node_of(frame.can_id)
        found = [
            link
            for link in self.links.values()
            if any(pdo.cob_id == frame.can_id for pdo in link.plan.node.pdos)
        ] or [link for node, link in self.links.items() if node == number]
        return concerned_by([link.device_id for link in found or self.links.values()])


class CanopenBuses(SharedPart):
    """All managed buses of the daemon."""

    def __init__(self) -> None:
        self.buses: dict[ManagerPlan, _BusAtWork] = {}
        self._group = WorkGroup()
        self._tap: Tap | None = None

    async def run(self) -> None:
        """Keep all managers at work until cancelled."""
        await self._group.run(lambda: [bus.work for bus in self.buses.values()])

    def progress(self) -> Mapping[str, int]:
        """Of each manager, whatever its bus does."""
        return {
            f"CAN manager {plan.channel}": bus.manager.progress + bus.work.rests
            for plan, bus in self.buses.items()
        }

    def troubles(self) -> Sequence[str]:
        """Buses that carry no frames."""
        return [
            f"CAN {plan.channel}: {bus.manager.reason}"
            for plan, bus in self.buses.items()
            if bus.manager.reason
        ]

    def gap(self, since: float, now: float) -> None:
        """No device is blamed for what could not be heard."""
        for bus in self.buses.values():
            bus.manager.gap(since, now)

    def trace(self, tap: Tap | None) -> None:
        """All frames of all buses."""
        self._tap = tap
        for bus in self.buses.values():
            self._put_tap(bus)

    async def prepare(self, plans: Sequence[Plan]) -> Prepared:
        """Nothing: a bus that cannot be used keeps no mapping from being served."""
        return NothingPrepared()

    def serve(self, links: Sequence[Link], successors: Mapping[Cell, Cell]) -> None:
        """Have a manager for every bus of these devices, and no other; each with its devices and no others."""
        wanted: dict[ManagerPlan, list[ManagedDevice]] = {}
        for link in links:
            assert isinstance(link, ManagedDevice)
            wanted.setdefault(link.plan.bus, []).append(link)
        for plan, bus in list(self.buses.items()):
            for number, link in list(bus.links.items()):
                if link not in wanted.get(plan, ()):
                    self._detach(bus, number)
            if plan not in wanted:
                self._detach_all(bus)
                bus.work.end()
                del self.buses[plan]
        for plan, devices in wanted.items():
            if plan not in self.buses:
                self.buses[plan] = self._bus(plan)
                self._group.begin(self.buses[plan].work)
            for link in devices:
                if link not in self.buses[plan].links.values():
                    self._attach(self.buses[plan], link)

    async def close(self) -> None:
        """Manage nothing any more; the devices are left as they are, and miss the manager's heartbeat."""
        buses = list(self.buses.values())
        self.buses.clear()
        for bus in buses:
            for link in bus.links.values():
                link.stop()
            self._detach_all(bus)
        await end_all(bus.work for bus in buses)

    def _bus(self, plan: ManagerPlan) -> _BusAtWork:
        def report(text: str) -> None:
            log.info("%s", text, extra=fields(bus=plan.address))

        def alive(now: float) -> bool:
            return all(link.core_lives(now) for link in bus.links.values())

        bus = _BusAtWork(Manager(plan, alive=alive, report=report))
        self._put_tap(bus)
        return bus

    def _put_tap(self, bus: _BusAtWork) -> None:
        tap, peer = self._tap, f"CAN {bus.manager.plan.channel}"

        def passing(frame: Frame, outgoing: bool) -> None:
            if tap is not None:
                cell, links = bus.concerned(frame)
                tap(Passage(clock.now(), packed(frame), outgoing, peer=peer, cell=cell, links=links))

        bus.manager.tap = passing if tap is not None else None

    def _detach_all(self, bus: _BusAtWork) -> None:
        for number in list(bus.links):
            self._detach(bus, number)

    @staticmethod
    def _attach(bus: _BusAtWork, link: ManagedDevice) -> None:
        link.manager = bus.manager
        try:
            link.node = bus.manager.attach(link.plan.node, link)
        except (ManagerError, ValueError) as error:  # what `check` refuses
            link.clash = str(error)
            log.warning("device cannot be managed", extra=fields(device=link.plan.name, reason=link.clash))
            return
        link.clash = ""
        bus.links[link.plan.node.node] = link

    @staticmethod
    def _detach(bus: _BusAtWork, number: int) -> None:
        link = bus.links.pop(number)
        bus.manager.detach(number, "the device is not declared any more")
        link.node = link.manager = None
