"""How a CANopen link is, in words: its bus, and what the node on it is up to. Pure."""

from __future__ import annotations

from dataclasses import asdict

from gatewayd.canopen.bus import BusState
from gatewayd.links.canopen_node.declaration import BUS_STATES, NMT_STATES
from gatewayd.links.canopen_node.node import Node
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.contract import Level, LinkHealth

_BUS_WORDS = {
    BusState.ABSENT: (Level.BAD, "absent: no such interface"),
    BusState.DOWN: (Level.BAD, "down: the interface is not configured"),
    BusState.BUS_OFF: (Level.BAD, "bus-off: cut off after too many errors"),
    BusState.PASSIVE: (Level.WARN, "error-passive: look at cable, termination and bit rate"),
    BusState.WARNING: (Level.WARN, "many errors: look at cable, termination and bit rate"),
    BusState.ACTIVE: (Level.GOOD, "active"),
}
_MAX_NODE = 127
"""Above is no node-ID, but that of a node to which LSS has given none."""


def health_of(node: Node, plan: CanopenPlan, reason: str) -> LinkHealth:
    """An active bus alone is not well: before NMT start no PDO goes either way.

    `reason`: why the bus is not as it should be, with a remedy; empty where it is.
    """
    bus, nmt = node.bus, NMT_STATES[node.nmt.state]
    level, words = _BUS_WORDS[bus]
    problems = [] if bus is BusState.ACTIVE else [f"CAN bus {BUS_STATES[bus + 1]}"]
    if reason:
        problems = [f"{problem}: {reason}" for problem in problems] or [reason]
        words = f"{BUS_STATES[bus + 1]}: {reason}"
    if node.errors.is_doubled:
        problems.append(f"another node on the bus has node-ID {node.node_id} too: give one of them another")
    if problems and level is Level.GOOD:
        level = Level.WARN
    elif level is Level.GOOD and nmt != "operational":
        level, words = Level.WARN, f"{words}, but {nmt}: no PDOs until a master starts the node"
    return LinkHealth(
        f"CAN {plan.channel}",
        level,
        words,
        f"node {node.node_id if node.node_id <= _MAX_NODE else 'without id'}, {nmt}",
        tuple(problems),
        {
            "channel": f"{plan.interface}:{plan.channel}",
            "node": plan.node,
            "bus": BUS_STATES[bus + 1],
            "bus_state": bus + 1,
            "reason": reason,
            "nmt_state": nmt,
            "counters": asdict(node.counters),
        },
    )


def other_bit_rate(plan: CanopenPlan, actual: int | None) -> str:
    """What to do about an interface that runs at another bit rate than the mapping says; empty if it does not."""
    if actual in (None, plan.bitrate):
        return ""
    return (
        f"{plan.channel} runs at {actual} bit/s, but the mapping says {plan.bitrate}: "
        "set up the interface again, or correct the mapping"
    )
