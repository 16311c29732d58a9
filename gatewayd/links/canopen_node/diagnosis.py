"""What a look at a CAN interface, and at the frames on it, means. Pure; the looks are in `doctor`."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.interface import ControllerState, Interface
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.examination import Observation, Outcome
from gatewayd.report.format import counted

INTERFACE, STATE, BIT_RATE, RESTART, TRAFFIC, NODE = (
    "interface", "bus state", "bit rate", "restart", "traffic", "node-ID",
)  # fmt: skip
_WIRING = "another bit rate than the other nodes have, no other node that is on, a missing terminator, H and L swapped"
_STATES = {
    ControllerState.WARNING: (Outcome.WARNING, "error warning"),
    ControllerState.PASSIVE: (Outcome.PROBLEM, "error-passive"),
    ControllerState.BUS_OFF: (Outcome.PROBLEM, "bus-off"),
    ControllerState.STOPPED: (Outcome.PROBLEM, "stopped"),
    ControllerState.SLEEPING: (Outcome.PROBLEM, "sleeping"),
}
_SET_UP = "docs/howto/can-interface.md"


@dataclass(frozen=True, slots=True)
class Heard:
    """What came on the bus in a while."""

    seconds: float
    frames: int
    identifiers: Collection[int]
    """Of data frames with 11 bits."""


def absent(channel: str) -> Observation:
    """There is no interface of that name."""
    return Observation(
        INTERFACE,
        Outcome.PROBLEM,
        f"there is no interface {channel}",
        "its adapter is not plugged in or has no driver, or it has another name",
        "plug in the adapter, or correct `canopen: channel:`; `ip link show type can` lists what there is",
    )


def looked_at(found: Interface, plan: CanopenPlan) -> Iterator[Observation]:
    """The interface as the kernel has it."""
    channel = plan.channel
    if not found.is_can:
        remedy = "correct `canopen: channel:`; `ip link show type can` lists what there is"
        text = f"{channel} is not a CAN interface"
        yield Observation(INTERFACE, Outcome.PROBLEM, text, "it is one of another kind", remedy)
        return
    yield Observation.well(INTERFACE, f"{channel} is there")
    if found.controller is not None and found.bitrate is None:
        yield _never_set_up(plan)
        return
    if not found.up:
        cause, remedy = (
            "nobody has brought it up since the start of this machine",
            f"`ip link set {channel} up`; {_SET_UP} makes it permanent",
        )
        yield Observation(STATE, Outcome.PROBLEM, f"{channel} is down", cause, remedy)
    else:
        yield _state(found, channel)
    yield _bit_rate(found, plan)
    if found.restart_ms == 0:
        yield Observation(
            RESTART,
            Outcome.WARNING,
            f"{channel} stays off the bus after a bus-off",
            "restart-ms is not set, and the gateway may not restart it",
            f"`ip link set {channel} type can restart-ms 100` (while it is down; {_SET_UP})",
        )


def _never_set_up(plan: CanopenPlan) -> Observation:
    """A controller without a bit rate cannot be brought up: the kernel refuses (drivers/net/can/dev)."""
    return Observation(
        STATE,
        Outcome.PROBLEM,
        f"{plan.channel} is down, and no bit rate is set",
        "nobody has set it up since the start of this machine, or since the adapter was plugged in",
        f"`ip link set {plan.channel} up type can bitrate {plan.bitrate} restart-ms 100`; {_SET_UP} makes it permanent",
    )


def _state(found: Interface, channel: str) -> Observation:
    errors = ""
    if found.tx_errors is not None:
        errors = f" (transmit errors: {found.tx_errors}, receive errors: {found.rx_errors})"
    state = ControllerState.BUS_OFF if not found.carrier else found.controller
    outcome, words = _STATES.get(state, (Outcome.OK, "up")) if state is not None else (Outcome.OK, "up")
    text = f"{channel} is {words}{errors}"
    if not outcome.is_finding:
        return Observation.well(STATE, text)
    remedy = "compare bit rates, then check wiring and terminators (60 ohms between H and L); see " + _SET_UP
    return Observation(STATE, outcome, text, _WIRING, remedy)


def _bit_rate(found: Interface, plan: CanopenPlan) -> Observation:
    if found.bitrate is None:
        text = f"{plan.channel} reports none: a virtual bus, or an adapter at a serial line, where slcand sets it"
        return Observation(BIT_RATE, Outcome.NOTE, text)
    if found.bitrate == plan.bitrate:
        return Observation.well(BIT_RATE, f"{found.bitrate} bit/s, as the mapping says")
    return Observation(
        BIT_RATE,
        Outcome.PROBLEM,
        f"{plan.channel} runs at {found.bitrate} bit/s, the mapping says {plan.bitrate}",
        "the interface was set up for another bus, or the mapping was copied",
        f"`ip link set {plan.channel} down`, then `ip link set {plan.channel} up type can bitrate {plan.bitrate}`, "
        "or correct `canopen: bitrate:`",
    )


def traffic(heard: Heard, plan: CanopenPlan, *, served: bool) -> Iterator[Observation]:
    """What was heard; `served`: a gateway of this machine is on the bus, whose own frames are among it."""
    if not heard.frames:
        text = f"nothing in {heard.seconds:g} s: no other node sends, or none is on"
        yield Observation(TRAFFIC, Outcome.NOTE, text)
    else:
        ids = counted(len(heard.identifiers), "identifier")
        yield Observation.well(TRAFFIC, f"{counted(heard.frames, 'frame')} in {heard.seconds:g} s, {ids}")
    ours = {Function.ERROR_CONTROL + plan.node, Function.SDO_RESPONSE + plan.node, Function.EMCY + plan.node}
    if not served and ours.intersection(heard.identifiers):
        yield Observation(
            NODE,
            Outcome.PROBLEM,
            f"a node with node-ID {plan.node} is on the bus already",
            "another device has the node-ID of the mapping, or another gateway serves it",
            "give one of them another node-ID (`canopen: node:`)",
        )
