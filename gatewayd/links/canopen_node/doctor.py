"""What is looked at of a CAN bus: the interface and its state, its bit rate, and for a moment the frames on it.

Nothing is sent, and nothing configured.
"""

from __future__ import annotations

import asyncio
import errno
import os
import socket
import struct
from collections.abc import AsyncIterator
from contextlib import suppress

from gatewayd.canopen.bus import BusError
from gatewayd.canopen.cob_ids import BASIC_FRAME
from gatewayd.canopen.interface import Interface, InterfaceReader
from gatewayd.canopen.socketcan import no_socketcan
from gatewayd.core.definition import CellDefinition
from gatewayd.links.canopen_node import diagnosis
from gatewayd.links.canopen_node.declaration import KIND
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.examination import Examination, Observation, Outcome, Surroundings
from gatewayd.mapping.plan import LinkPlan

LISTEN = 1.5
"""Seconds for which frames are heard: longer than the usual heartbeat."""
_FRAME = struct.Struct("=I12x")
"""The identifier of a struct can_frame."""


class CanopenExamination(Examination):
    """See the module."""

    async def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        """See Examination."""
        assert isinstance(plan, CanopenPlan)
        if plan.interface != "socketcan":
            text = f"{plan.interface}:{plan.channel} is python-can's: only opening shows it, which `gatewayd run` does"
            yield Observation(diagnosis.INTERFACE, Outcome.SKIPPED, text)
            return
        try:
            found = _look(plan.channel)
        except BusError as error:
            yield _unusable(str(error))
            return
        except OSError as error:
            yield _unusable(no_socketcan(error))
            return
        if found is None:
            yield diagnosis.absent(plan.channel)
            return
        for observation in diagnosis.looked_at(found, plan):
            yield observation
        if not (found.is_can and found.up and found.carrier):
            return
        served = any(
            _is_ours(link.get("channel"), plan)
            for known in around.running
            for link in known.links(KIND.title)
        )
        try:
            heard = await listen(plan.channel, LISTEN)
        except OSError as error:
            yield Observation(diagnosis.TRAFFIC, Outcome.SKIPPED, f"{plan.channel}: {error.strerror}")
            return
        for observation in diagnosis.traffic(heard, plan, served=served):
            yield observation


async def listen(channel: str, seconds: float) -> diagnosis.Heard:
    """Hear what comes on the bus. OSError if that cannot be."""
    loop = asyncio.get_running_loop()
    frames, identifiers = 0, set[int]()
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
        bus.setblocking(False)
        bus.bind((channel,))
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                while True:
                    (identifier,) = _FRAME.unpack(await loop.sock_recv(bus, _FRAME.size))
                    frames += 1
                    if identifier <= BASIC_FRAME:
                        identifiers.add(identifier)
    return diagnosis.Heard(seconds, frames, identifiers)


def _look(channel: str) -> Interface | None:
    """The interface; None if there is none of that name. OSError without SocketCAN, BusError if the kernel refuses."""
    socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    reader = InterfaceReader()
    try:
        return reader.read(channel)
    except OSError as error:
        if error.errno in (errno.ERANGE, errno.EINVAL):
            return None  # no interface can have such a name
        raise BusError(f"cannot look at {channel}: {os.strerror(error.errno or 0)}") from error
    finally:
        reader.close()


def _unusable(text: str) -> Observation:
    what, _, remedy = text.partition("; ")
    cause = "the kernel lacks it, or a sandbox forbids it"
    return Observation(diagnosis.INTERFACE, Outcome.PROBLEM, what, cause, remedy)


def _is_ours(channel: object, plan: CanopenPlan) -> bool:
    return channel == f"{plan.interface}:{plan.channel}"


EXAMINATION = CanopenExamination()
"""Looks at what this kind of link needs."""
