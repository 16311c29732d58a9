"""What the local operator does beside a running cell. None of it is a fault, and none of it may stay."""

from __future__ import annotations

import time
from collections.abc import Mapping
from random import Random
from typing import Any

from gatewayd.control.client import ControlError
from tests.e2e.processes import wait_for
from tests.soak.cell import FIELDS_OF, FIRST, MASTER_FIELDS
from tests.soak.faults.common import unjudged
from tests.soak.rig import PATIENCE, Rig

_FORCED = ("first_in", "master_in", "second_echo", "heard_echo", "doubles[3]")
_TAKEN = ("first_in", "second_in", "shared", "master_in", "heard_in")
_FIELDS = {"first_in": FIELDS_OF[FIRST][:1], "master_in": MASTER_FIELDS[:1]}
"""Of what is forced, what is an input of the robot."""
_VALUE = 40_000
"""No writer writes it of itself."""
_LONGEST = 3600
"""Seconds of what the operator ends himself."""


def _post(rig: Rig, path: str, body: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """As the gateway asks for: a command that waited while it stood still is repeated."""
    try:
        return rig.control.post(path, body)
    except ControlError as refused:
        if refused.code != "stood_still":
            raise
    return rig.control.post(path, body)


def force(rig: Rig, chance: Random) -> None:
    """It ends by its time or by the operator, whether or not the robot was there all the while."""
    name = chance.choice(_FORCED)
    path = f"/v1/variables/{name.replace('[', '%5B').replace(']', '%5D')}"
    seconds = chance.uniform(0.2, 1.5)
    by_time, robot_cut = chance.random() < 0.5, chance.random() < 0.3
    with unjudged(rig, _FIELDS.get(name, ()), _VALUE):
        _post(rig, f"{path}/force", {"value": _VALUE, "for": seconds if by_time else _LONGEST})
        assert name in rig.look.forced(), f"{name} is not forced"
        if robot_cut:
            rig.simulator.do("drop-clients")
        time.sleep(seconds)
        if not by_time:
            _post(rig, f"{path}/unforce")
        wait_for(lambda: not rig.look.forced(), f"the end of the force of {name}", PATIENCE)


def take_lock(rig: Rig, chance: Random) -> None:
    """It is back by its time or by the operator, and its writer was refused until then."""
    name = chance.choice(_TAKEN)
    seconds = chance.uniform(0.2, 1.5)
    by_time = chance.random() < 0.5
    taken = _post(rig, f"/v1/locks/{name}/take", {"for": seconds} if by_time else {})
    assert taken["owner"] == "operator", taken
    time.sleep(seconds)
    if not by_time:
        assert name in rig.look.locks_of("operator"), f"the operator has lost {name}"
        _post(rig, f"/v1/locks/{name}/release")
    wait_for(lambda: not rig.look.locks_of("operator"), f"{name} to be free of the operator", PATIENCE)
