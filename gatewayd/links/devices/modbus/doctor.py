"""What is looked at of a Modbus device: the way to it and its port, or the serial port. Nothing is asked of it."""

from __future__ import annotations

import asyncio
import os
import stat
from collections.abc import AsyncIterator
from ipaddress import ip_address
from pathlib import Path

from gatewayd.core.definition import CellDefinition
from gatewayd.links.devices.modbus.plan import LineAddress, ModbusDevicePlan
from gatewayd.links.devices.served import served_device
from gatewayd.links.examination import Examination, Observation, Outcome, Surroundings
from gatewayd.links.route import look_up_route
from gatewayd.loop.retry import reason_of
from gatewayd.mapping.plan import LinkPlan

_PATIENCE = 3.0
"""Seconds for a connection."""
_REMEDY = "look at its power, its cable and its unit id; `gatewayd trace` shows what is sent"


class ModbusDeviceExamination(Examination):
    """See the module."""

    async def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        """See Examination."""
        assert isinstance(plan, ModbusDevicePlan)
        served = served_device(plan, cell, around, plan.line.text, _REMEDY)
        if served is not None:
            yield served
            return
        if plan.line.is_serial:
            yield serial_port(plan.line)
            return
        if _is_literal(plan.line.path):
            for found in look_up_route(plan.line.path, plan.name):
                yield found
                if found.outcome is Outcome.PROBLEM:
                    return
        yield await _connection(plan.line)


def serial_port(line: LineAddress) -> Observation:
    """Whether the port is there, and this user may open it; it is not opened."""
    check = "serial port"
    try:
        found = Path(line.path).stat()
    except OSError as error:
        text = f"{line.path}: {reason_of(error)}"
        cause = "the adapter is not plugged in, or has another name now"
        return Observation(
            check, Outcome.PROBLEM, text, cause, "name it by /dev/serial/by-id/, where it stays the same"
        )
    if not stat.S_ISCHR(found.st_mode):
        remedy = "name the port itself (`ls /dev/serial/by-id/`)"
        return Observation(check, Outcome.PROBLEM, f"{line.path} is no device", "a wrong path", remedy)
    if not os.access(line.path, os.R_OK | os.W_OK):
        text = f"{line.path} may not be opened by user {os.geteuid()}"
        remedy = "add the user to the group of the port, mostly `dialout`; the service needs its drop-in"
        return Observation(check, Outcome.WARNING, text, "serial ports belong to a group", remedy)
    return Observation.well(check, f"{line.path} is there")


async def _connection(line: LineAddress) -> Observation:
    """Open a connection and close it again: the peer is asked nothing."""
    check = "connection"
    try:
        async with asyncio.timeout(_PATIENCE):
            _, writer = await asyncio.open_connection(line.path, line.port)
    except (OSError, TimeoutError) as error:
        reason = "no answer" if isinstance(error, TimeoutError) else reason_of(error)
        remedy = "look at its power, its cable and its address; some devices take few connections only"
        return Observation(
            check, Outcome.PROBLEM, f"{line.text}: {reason}", "it is off, elsewhere or taken", remedy
        )
    writer.close()
    return Observation.well(check, f"connections are taken at {line.text}")


def _is_literal(host: str) -> bool:
    try:
        ip_address(host)
    except ValueError:
        return False
    return True


EXAMINATION = ModbusDeviceExamination()
"""Looks at what this family needs."""
