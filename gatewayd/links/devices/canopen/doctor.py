"""What is looked at of a CANopen device: its bus, and what the running gateway knows of it. Nothing is asked of it."""

from __future__ import annotations

from collections.abc import AsyncIterator

from gatewayd.canopen.bus import BusError
from gatewayd.canopen.interface import InterfaceReader
from gatewayd.core.definition import CellDefinition
from gatewayd.links.devices.canopen.plan import CanopenDevicePlan
from gatewayd.links.devices.served import served_device
from gatewayd.links.examination import Examination, Observation, Outcome, Surroundings
from gatewayd.mapping.plan import LinkPlan

_REMEDY = "look at its power, its cable, its node-ID and the bit-rate of the bus"


class CanopenDeviceExamination(Examination):
    """See the module."""

    async def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        """See Examination."""
        assert isinstance(plan, CanopenDevicePlan)
        served = served_device(plan, cell, around, plan.bus.address, _REMEDY)
        if served is not None:
            yield served
            return
        if plan.bus.interface == "socketcan":
            yield interface(plan.bus.channel, plan.bus.bitrate)


def interface(name: str, bitrate: int) -> Observation:
    """Whether the kernel has the interface, up, and with the bit-rate that the mapping says."""
    check = "CAN interface"
    try:
        reader = InterfaceReader()
    except BusError as error:
        return Observation(check, Outcome.WARNING, str(error), "the sandbox", "run it as another user")
    try:
        found = reader.read(name)
    finally:
        reader.close()
    if found is None or not found.is_can:
        text = f"there is no CAN interface {name}"
        return Observation(
            check, Outcome.PROBLEM, text, "no adapter, or another name", "`ip link` lists them"
        )
    if not found.up:
        remedy = f"`ip link set {name} up type can bitrate {bitrate}`"
        return Observation(check, Outcome.PROBLEM, f"{name} is down", "nobody has set it up", remedy)
    if found.bitrate not in (None, bitrate):
        text = f"{name} runs at {found.bitrate} bit/s, the mapping says {bitrate}"
        return Observation(
            check, Outcome.PROBLEM, text, "one of both is wrong", "correct the one that is wrong"
        )
    return Observation.well(check, f"{name} is up")


EXAMINATION = CanopenDeviceExamination()
"""Looks at what this family needs."""
