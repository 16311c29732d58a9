"""Data, then toggle, then acknowledge: the PLC's half of a handshake with the robot program, on one tag.

A routine has no instances: a second handshake takes a second tag of the data type, and a copy of the routine.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.plc.logix.l5x import LogixMember

MEMBERS: Final = (
    LogixMember("send", "BOOL", 0, "rises when the data stand in the inputs"),
    LogixMember("acknowledge", "BOOL", 0, "bit of the robot: it repeats the toggle when it has the data"),
    LogixMember("toggle", "BOOL", 0, "bit for the robot: changes when the data are there"),
    LogixMember("busy", "BOOL"),
    LogixMember("done", "BOOL", 0, "acknowledged; until the next begins"),
    LogixMember("failed", "BOOL", 0, "not acknowledged in time, or not trusted any more"),
    LogixMember("sent", "BOOL"),
    LogixMember("state", "DINT", 0, "0 idle, 1 data on their way, 2 waiting for the robot"),
    LogixMember("since", "DINT"),
    LogixMember("time_out", "DINT", 0, "milliseconds for the whole handshake; 0: 5000"),
    LogixMember("expiry", "FBD_TIMER"),
)
_TIME_OUT: Final = 5000
_ROUNDS: Final = 3
"""A request that was on its way when the data came may end the first round and begin the second: the third is after."""


def handshake(model: PlcModel) -> Iterator[str]:
    """The routine."""
    name = f"{model.prefix}_Handshake"
    written = f"{model.prefix}_Written"
    trusted = f"{model.prefix}_Status.trusted"
    yield f"{name}.expiry.PRE := {name}.time_out;"
    yield f"IF {name}.time_out <= 0 THEN"
    yield f"  {name}.expiry.PRE := {_TIME_OUT};"
    yield "END_IF;"
    yield f"{name}.expiry.TimerEnable := {name}.state > 0;"
    yield f"TONR({name}.expiry);"
    yield f"IF {name}.state > 0 THEN"
    yield f"  IF {name}.expiry.DN OR NOT {trusted} THEN"
    yield f"    {name}.state := 0;"
    yield f"    {name}.failed := 1;"
    yield f"  ELSIF ({name}.state = 1) AND ({written} - {name}.since >= {_ROUNDS}) THEN"
    yield f"    {name}.toggle := NOT {name}.toggle;"
    yield f"    {name}.state := 2;"
    yield f"  ELSIF ({name}.state = 2) AND ({name}.acknowledge = {name}.toggle) THEN"
    yield f"    {name}.state := 0;"
    yield f"    {name}.done := 1;"
    yield "  END_IF;"
    yield f"ELSIF {name}.send AND NOT {name}.sent AND {trusted} THEN"
    yield f"  {name}.toggle := {name}.acknowledge;"
    yield f"  {name}.since := {written};"
    yield f"  {name}.state := 1;"
    yield f"  {name}.done := 0;"
    yield f"  {name}.failed := 0;"
    yield "END_IF;"
    yield f"{name}.sent := {name}.send;"
    yield f"{name}.busy := {name}.state > 0;"
