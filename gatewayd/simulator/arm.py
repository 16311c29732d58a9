"""The arm in motion: a periodic joint trajectory, run at the speed that the controller allows.

The trajectory is a sum of one sine per joint, so positions, speeds and accelerations agree exactly, and any moment can
be computed without its past. The actual joints follow the target ones with a small error that is a function of the
trajectory as well: `actual_qd` is the derivative of `actual_q`, and an arm that stands shows no speed at all.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

from gatewayd.simulator import kinematics
from gatewayd.simulator.kinematics import ARMS, ArmGeometry, Frames, Vector

DRIVEN, BRAKED, OFF = 2, 1, 0
"""Power of the arm: motors carry it; powered with the brakes applied; without power."""


class ControllerMoment(NamedTuple):
    """A point in time of the simulated controller, and all that its moving fields follow from."""

    step: int
    """Control cycles since the controller was started."""
    time: float
    """Seconds since the controller was started."""
    path: float
    """Seconds of the trajectory that have been run."""
    rate: float
    """Seconds of trajectory run per second: 0 = standing, 1 = full speed."""
    change: float = 0.0
    """Change of `rate` per second: the arm brakes or speeds up along its trajectory."""
    power: int = DRIVEN
    """`DRIVEN`, `BRAKED` or `OFF`."""
    arm: ArmGeometry = ARMS["ur5e"]
    posture: Vector | None = None
    """Joint angles at which the arm stands for good, in place of the trajectory."""


class JointMotion(NamedTuple):
    """Angles, speeds and accelerations of the six joints."""

    q: Vector
    qd: Vector
    qdd: Vector


# (centre, amplitude, angular frequency, phase) of each joint
_JOINTS = (
    (0.30, 0.60, 2 * math.pi / 8.0, 0.0),
    (-1.60, 0.25, 2 * math.pi / 8.0, 0.7),
    (1.75, 0.30, 2 * math.pi / 4.0, 1.1),
    (-1.70, 0.20, 2 * math.pi / 4.0, 0.3),
    (-1.55, 0.15, 2 * math.pi / 8.0, 2.0),
    (0.10, 0.50, 2 * math.pi / 16.0, 0.0),
)
# the same for what the actual joints deviate by
_DEVIATIONS = tuple((0.0, 2e-5, 41.0 + 7.3 * joint, float(joint)) for joint in range(6))
_STANDING: Vector = (0.0,) * 6
_REMEMBERED = 4  # moments: several fields of one package ask for the same


@lru_cache(_REMEMBERED)
def target(moment: ControllerMoment) -> JointMotion:
    """What the controller asks of the joints."""
    return _motion(moment, _waves(moment.path, _JOINTS))


@lru_cache(_REMEMBERED)
def actual(moment: ControllerMoment) -> JointMotion:
    """What the joints do."""
    wanted, off = _waves(moment.path, _JOINTS), _waves(moment.path, _DEVIATIONS)
    return _motion(moment, JointMotion(*(_sum(a, b) for a, b in zip(wanted, off, strict=True))))


@lru_cache(_REMEMBERED)
def target_frames(moment: ControllerMoment) -> Frames:
    """The frames at the target joints."""
    return kinematics.frames(moment.arm, target(moment).q)


@lru_cache(_REMEMBERED)
def actual_frames(moment: ControllerMoment) -> Frames:
    """The frames at the actual joints."""
    return kinematics.frames(moment.arm, actual(moment).q)


def _waves(path: float, joints: tuple[tuple[float, float, float, float], ...]) -> JointMotion:
    """The trajectory at full speed."""
    angles = [(c, a, w, w * path + p) for c, a, w, p in joints]
    return JointMotion(
        tuple(c + a * math.sin(x) for c, a, _, x in angles),
        tuple(a * w * math.cos(x) for _, a, w, x in angles),
        tuple(-a * w * w * math.sin(x) for _, a, w, x in angles),
    )


def _motion(moment: ControllerMoment, full: JointMotion) -> JointMotion:
    """The trajectory at the moment's rate."""
    if moment.posture is not None:
        return JointMotion(moment.posture, _STANDING, _STANDING)
    rate, change = moment.rate, moment.change
    return JointMotion(
        full.q,
        tuple(speed * rate for speed in full.qd),
        tuple(a * rate * rate + v * change for v, a in zip(full.qd, full.qdd, strict=True)),
    )


def _sum(a: Vector, b: Vector) -> Vector:
    return tuple(x + y for x, y in zip(a, b, strict=True))
