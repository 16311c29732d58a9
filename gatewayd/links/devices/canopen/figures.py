"""How a CANopen device is, for people, status and metrics."""

from __future__ import annotations

from gatewayd.canopen.manager.channel import SdoCounters
from gatewayd.canopen.manager.node import ManagedCounters, NodeCondition
from gatewayd.links.contract import LinkHealth
from gatewayd.links.devices.canopen.managed import ManagedDevice
from gatewayd.links.devices.status_words import DeviceFigures, DeviceState


def state_of(link: ManagedDevice) -> tuple[DeviceState, str]:
    """Its state, and why it is not good."""
    node, manager = link.node, link.manager
    if link.clash:
        return DeviceState.LOST, link.clash
    if node is None or manager is None:
        return DeviceState.STARTING, "it is in no manager's care yet"
    condition = node.condition
    if condition is NodeCondition.OFFLINE:
        return DeviceState.LOST, f"the CAN bus is away: {manager.reason or 'it is not open yet'}"
    if condition is NodeCondition.READY:
        missing = ", ".join(map(str, manager.bus_manager.missing))
        return DeviceState.STARTING, f"it waits for mandatory nodes that are missing: {missing}"
    if condition in (NodeCondition.ABSENT, NodeCondition.FAILED):
        return DeviceState.LOST, node.problem
    if condition is NodeCondition.BOOTING:
        return DeviceState.STARTING, f"the manager {node.boot.step.value}"
    reports = () if link.emergency is None else (f"it reports {link.emergency}",)
    reason = next(iter((*link.troubles, *reports)), "")
    if not reason:
        return DeviceState.GOOD, ""
    return (DeviceState.REFUSING if link.refuses_everything else DeviceState.PARTIAL), reason


def figures_of(link: ManagedDevice, now: float) -> DeviceFigures:
    """What all devices have."""
    state, reason = state_of(link)
    node = link.node
    transfers = node.channel.counters if node is not None else SdoCounters()
    return DeviceFigures(
        state=state,
        reason=reason,
        round_trip=node.channel.round_trip if node is not None else None,
        age=None if link.heard is None else now - link.heard,
        answers=transfers.transfers - transfers.timeouts,
        timeouts=transfers.timeouts,
        errors=node.counters.pdos_short if node is not None else 0,
        refused=transfers.codes,
        losses=link.losses,
    )


def health_of(link: ManagedDevice, now: float) -> LinkHealth:
    """What all devices have, and what only CANopen devices have."""
    node, plan = link.node, link.plan
    counters = node.counters if node is not None else ManagedCounters()
    letter = node.boot.letter if node is not None else None
    emergency = node.last_emergency if node is not None else None
    own = {
        "family": plan.family,
        "address": plan.bus.address,
        "unit": plan.node.node,
        "since": round(max(0.0, now - link.state_since[1]), 3),
        "letter": letter.value if letter is not None else "",
        "nmt_state": node.nmt.name.lower().replace("_", "-")
        if node is not None and node.nmt is not None
        else "",
        "identity": identity_text(node.identity) if node is not None else "",
        "boots": counters.boots,
        "heartbeat_misses": counters.heartbeat_misses,
        "emergencies": counters.emergencies,
        "emergency": str(emergency) if emergency is not None else "",
        "pdos_received": counters.pdos_received,
        "pdos_sent": counters.pdos_sent,
    }
    return figures_of(link, now).health(plan.name, own)


def identity_text(identity: dict[int, int]) -> str:
    """`type 00020196h, vendor 000001F0h, product 00000401h, revision 00010002h, serial 0000004Dh`."""
    words = ("type", "vendor", "product", "revision", "serial")
    return ", ".join(f"{words[part]} {number:08X}h" for part, number in sorted(identity.items()))
