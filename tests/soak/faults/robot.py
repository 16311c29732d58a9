"""Faults of the robot and of the way to it."""

from __future__ import annotations

import time
from random import Random

from tests.e2e.processes import wait_for
from tests.soak.cell import HELD
from tests.soak.rig import PATIENCE, Rig


def drop_clients(rig: Rig, _chance: Random) -> None:
    rig.simulator.do("drop-clients")


def silence(rig: Rig, chance: Random) -> None:
    _switched(rig, "silence", chance)


def freeze(rig: Rig, chance: Random) -> None:
    _switched(rig, "freeze", chance)


def _switched(rig: Rig, switch: str, chance: Random) -> None:
    rig.simulator.do(f"{switch} on")
    wait_for(lambda: bool(rig.look.ills()), f"{switch} to be noticed", PATIENCE)
    time.sleep(chance.uniform(0, 1))
    rig.simulator.do(f"{switch} off")


def kill_simulator(rig: Rig, chance: Random) -> None:
    rig.end_simulator()
    wait_for(lambda: bool(rig.look.ills()), "the robot to be missed", PATIENCE)
    time.sleep(chance.uniform(0, 2))
    rig.start_simulator()


def hold_register(rig: Rig, chance: Random) -> None:
    """A robot program that has the register for itself when the gateway connects, and gives it up later."""
    rig.end_simulator()
    rig.start_simulator("--hold", HELD)
    wait_for(lambda: any("unavailable" in ill for ill in rig.look.ills()), "the held register", PATIENCE)
    time.sleep(chance.uniform(0, 1))
    rig.simulator.do(f"free {HELD}")
