"""The faults of a soak run: each brings one kind of trouble and takes it away. What comes then is up to the daemon.

Whatever a fault chooses comes from the `Random` it is given, so that a seed makes the same faults again.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from random import Random

from tests.soak.faults import can, daemon, http, modbus, operator, robot
from tests.soak.rig import Rig

STILL = "gateway stands still"
_OFTEN = {STILL: 3}
"""How often in a round, where not once."""
Fault = Callable[[Rig, Random], None]
BOUND = 5.0
"""Seconds after a fault in which all must be well."""
_BOUNDS = {"simulator killed": 10.0, "register held": 10.0, "CAN bus gone": 10.0, "CAN flood": 10.0}
"""Those that need longer: a robot or a bus that was away is tried again at growing intervals."""


def bound(kind: str) -> float:
    """Seconds in which this kind must be over; GATEWAYD_SOAK_PATIENCE multiplies them, for machines that are shared."""
    return _BOUNDS.get(kind, BOUND) * float(os.environ.get("GATEWAYD_SOAK_PATIENCE", "1"))


FAULTS: dict[str, Fault] = {
    "clients dropped": robot.drop_clients,
    "robot silent": robot.silence,
    "robot frozen": robot.freeze,
    "simulator killed": robot.kill_simulator,
    "register held": robot.hold_register,
    "PLC killed": modbus.kill_plc,
    "PLC half-open": modbus.half_open_plc,
    "garbage": modbus.garbage,
    "peer never reads": modbus.never_reads,
    "half a request": modbus.half_request,
    "connection burst": modbus.burst,
    "master killed": can.kill_master,
    "CAN bus gone": can.cut_bus,
    "NMT command": can.command_node,
    "CAN flood": can.flood,
    "browser never reads": http.never_reads,
    "browsers half-open": http.half_requests,
    STILL: daemon.stand_still,
    "reload": daemon.reload,
    "broken reload": daemon.broken_reload,
    "audit unwritable": daemon.unwritable_audit,
    "audit full": daemon.full_audit,
    "operator forces": operator.force,
    "operator takes a lock": operator.take_lock,
}
"""Kind -> what does it."""
ROUND = [kind for kind in sorted(FAULTS) for _ in range(_OFTEN.get(kind, 1))]
"""What is brought before any kind comes again."""
