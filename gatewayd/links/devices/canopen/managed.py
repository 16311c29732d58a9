"""A device as its bus and its figures see it: what is known of it, and who is told what it says."""

from __future__ import annotations

from gatewayd.canopen.manager.emergency_text import EmergencyMessage
from gatewayd.canopen.manager.node import ManagedNode, NodeObserver
from gatewayd.canopen.manager.runtime import Manager
from gatewayd.links.devices.canopen.plan import CanopenDevicePlan
from gatewayd.links.devices.link import DeviceLink
from gatewayd.links.devices.status_words import DeviceState


class ManagedDevice(DeviceLink, NodeObserver):
    """The link to one device of one cell."""

    plan: CanopenDevicePlan
    node: ManagedNode | None
    """In its manager's care; None while no manager has it."""
    manager: Manager | None
    clash: str
    """Why no manager can have it; empty: one can."""
    heard: float | None
    """When it was heard last, in operation."""
    state_since: tuple[DeviceState, float]
    """Its state (`figures.state_of`) as of the last look, and since when."""
    emergency: EmergencyMessage | None
    """The error that it reports; None where it reports none."""

    losses: int
    """How often it was lost."""

    @property
    def troubles(self) -> tuple[str, ...]:
        """What of it does not work although it is in operation, in words."""
        raise NotImplementedError

    @property
    def refuses_everything(self) -> bool:
        """Whether nothing of what it was asked was of use, and no PDO brings or takes anything."""
        raise NotImplementedError

    def core_lives(self, now: float) -> bool:
        """Whether the core of its cell goes on: the manager's heartbeat says so to the devices."""
        raise NotImplementedError
