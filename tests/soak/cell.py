"""The cell of the soak run: its mapping, and who writes and reads what there."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from tests.e2e.plant import HEAD
from tests.e2e.plc import HMI, LINE, PLC
from tests.e2e.processes import HOST
from tests.soak.client import SHARED, SHARED_FIELD

NAME = "cell"
FIRST, SECOND, MASTER = "first", "second", "master"
"""The writers: two PLCs, and a CANopen master."""
ECHOES = 4
"""Variables that show what a writer wrote, as it came back from the robot."""
HELD = "input_int_register_3"
"""Field that a robot program may hold for itself."""
FIRST_FIELD, SECOND_FIELD = "input_int_register_0", "input_int_register_1"
MASTER_FIELDS = "input_int_register_4", "input_int_register_5"
FIELDS_OF = {
    FIRST: (FIRST_FIELD, SHARED_FIELD),
    SECOND: (SECOND_FIELD, SHARED_FIELD),
    MASTER: MASTER_FIELDS,
}
"""Whose fields are whose."""
FIELDS = tuple(dict.fromkeys([*(field for fields in FIELDS_OF.values() for field in fields), HELD]))
MOMENT = 20
"""Register of the controller's clock; -1 while it is not good."""
STALE_AFTER = 0.3

NODE = 16
_CELL = f"""\
canopen:
  interface: slcan
  channel: 'socket://{HOST}:{{can}}'
  bitrate: 1000000
  node: {NODE}
  heartbeat: 100ms
writers:
  {FIRST}:  {{{{modbus: {PLC}, timeout: 1s}}}}
  {SECOND}: {{{{modbus: {HMI}, timeout: 1s}}}}
  {MASTER}: {{{{canopen: any, node: 1, heartbeat: 500ms}}}}
variables:
  first_in:    {{{{robot: {FIRST_FIELD}, modbus: 0, owner: {FIRST}}}}}
  second_in:   {{{{robot: {SECOND_FIELD}, modbus: 2, owner: {SECOND}, lease: 500ms}}}}
  shared:      {{{{robot: {SHARED_FIELD}, modbus: {SHARED}, owner: [{FIRST}, {SECOND}], lease: 300ms}}}}
  held:        {{{{robot: {HELD}, modbus: 12}}}}
  master_in:   {{{{robot: {MASTER_FIELDS[0]}, canopen: auto, owner: {MASTER}}}}}
  heard_in:    {{{{robot: {MASTER_FIELDS[1]}, canopen: auto, owner: {MASTER}}}}}
  first_echo:  {{{{robot: output_int_register_0, modbus: 100}}}}
  second_echo: {{{{robot: output_int_register_1, modbus: 102}}}}
  master_echo: {{{{robot: output_int_register_4, canopen: auto}}}}
  heard_echo:  {{{{robot: output_int_register_5, canopen: auto}}}}
  moment:      {{{{robot: timestamp, modbus: {{{{holding: {MOMENT}, type: float64}}}}, on_stale: -1}}}}
  doubles:     {{{{robot: 'output_double_register_0..23', modbus: 200}}}}
"""
VARIANTS = {
    "plain": "",
    "another place": "  extra: {robot: output_int_register_0, modbus: 110}\n",
    "another field": "  fresh: {robot: output_int_register_7, modbus: 112}\n",
}
"""Mappings that reloads change between: the same recipe or another one."""


def mapping(variant: str, robot: int, modbus: int, can: int) -> str:
    """The mapping file, for these ports of `HOST`."""
    head = HEAD.format(
        name=NAME,
        host=HOST,
        robot=robot,
        frequency="0",
        stale_after=f"{STALE_AFTER * 1000:g}ms",
        robot_options="",
        modbus=modbus,
        unit=1,
        modbus_options=", idle_timeout: 3s",
    )
    return head + _CELL.format(can=can) + VARIANTS[variant]


def journal(directory: Path, name: str) -> Path:
    """Where the client of this name notes what it writes."""
    return directory / f"{name}.journal"


def command(name: str, directory: Path, modbus: int, can: int, status: int) -> Sequence[str]:
    """How the client of this name is started: one of the writers, `poller` or `browser`."""
    noted = journal(directory, name)
    module, *arguments = {
        FIRST: ("client", HOST, PLC, modbus, 0, 100, 0.05, FIRST_FIELD, noted),
        SECOND: ("client", HOST, HMI, modbus, 2, 102, 0.08, SECOND_FIELD, noted),
        MASTER: ("master", f"socket://{HOST}:{can}", NODE, 0.05, *MASTER_FIELDS, noted),
        "poller": ("client", HOST, LINE, modbus, -1, 0, 1.0, "", noted),
        "browser": ("browser", HOST, status, NAME, 0.5),
    }[name]
    return [sys.executable, "-m", f"tests.soak.{module}", *map(str, arguments)]
