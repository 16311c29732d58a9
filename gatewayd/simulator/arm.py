"""The arm: a periodic joint trajectory, and what follows from it by forward kinematics.

Geometry is a UR5e's (Denavit-Hartenberg parameters as published by Universal Robots). The trajectory is a sum of one
sine per joint, so positions, speeds and accelerations agree exactly, and any moment can be computed without its past.
Lengths in metres, angles in radians, rotations as rotation vectors, all in the base frame.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

Vector = tuple[float, ...]
_Triple = tuple[float, float, float]
_Matrix = tuple[_Triple, _Triple, _Triple]

ELBOW = 2
"""Joint whose frame carries the elbow: the origin after the upper arm."""
FLANGE = 6
"""Index of the tool flange's frame."""


class ControllerMoment(NamedTuple):
    """A point in time of the simulated controller."""

    step: int
    """Control cycles since the controller was started."""
    time: float
    """Seconds since the controller was started."""
    path: float
    """Seconds of the trajectory that have been run."""
    rate: float
    """Seconds of trajectory run per second: 0 = standing, 1 = full speed."""


class Frames(NamedTuple):
    """Origins and z axes of the base and the six link frames, and the flange's rotation."""

    origins: tuple[_Triple, ...]
    axes: tuple[_Triple, ...]
    rotation: _Matrix


# (a, d, cos alpha, sin alpha) of each link
_LINKS = (
    (0.0, 0.1625, 0.0, 1.0),
    (-0.425, 0.0, 1.0, 0.0),
    (-0.3922, 0.0, 1.0, 0.0),
    (0.0, 0.1333, 0.0, 1.0),
    (0.0, 0.0997, 0.0, -1.0),
    (0.0, 0.0996, 1.0, 0.0),
)
# (centre, amplitude, angular frequency, phase) of each joint
_JOINTS = (
    (0.30, 0.60, 2 * math.pi / 8.0, 0.0),
    (-1.60, 0.25, 2 * math.pi / 8.0, 0.7),
    (1.75, 0.30, 2 * math.pi / 4.0, 1.1),
    (-1.70, 0.20, 2 * math.pi / 4.0, 0.3),
    (-1.55, 0.15, 2 * math.pi / 8.0, 2.0),
    (0.10, 0.50, 2 * math.pi / 16.0, 0.0),
)
_DIFFERENCE = 1e-4  # seconds either side for the numeric derivative of a twist
_REMEMBERED = 8  # moments: now and its neighbours, asked for by several fields of one package


@lru_cache(_REMEMBERED)
def joints(path: float) -> tuple[Vector, Vector, Vector]:
    """Positions, speeds and accelerations of the six joints at full speed."""
    angles = [(c, a, w, w * path + p) for c, a, w, p in _JOINTS]
    return (
        tuple(c + a * math.sin(x) for c, a, _, x in angles),
        tuple(a * w * math.cos(x) for _, a, w, x in angles),
        tuple(-a * w * w * math.sin(x) for _, a, w, x in angles),
    )


@lru_cache(_REMEMBERED)
def frames(path: float) -> Frames:
    """The link frames on the trajectory."""
    x, y, z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    origin = (0.0, 0.0, 0.0)
    origins, axes = [origin], [z]
    for angle, (a, d, ca, sa) in zip(joints(path)[0], _LINKS, strict=True):
        c, s = math.cos(angle), math.sin(angle)
        turned = _mix(c, x, s, y)
        across = _mix(-s, x, c, y)
        origin = (
            origin[0] + a * turned[0] + d * z[0],
            origin[1] + a * turned[1] + d * z[1],
            origin[2] + a * turned[2] + d * z[2],
        )
        x, y, z = turned, _mix(ca, across, sa, z), _mix(-sa, across, ca, z)
        origins.append(origin)
        axes.append(z)
    return Frames(tuple(origins), tuple(axes), (x, y, z))


def pose(path: float) -> Vector:
    """x, y, z, rx, ry, rz of the flange."""
    at = frames(path)
    return at.origins[FLANGE] + _rotation_vector(at.rotation)


def twist(path: float, rate: float, point: int = FLANGE) -> Vector:
    """Linear and angular velocity of the origin of frame `point`."""
    return tuple(part * rate for part in _jacobian(path, joints(path)[1], point))


def thrust(path: float, rate: float) -> Vector:
    """What the joints' accelerations make of the flange's: near enough for a force, and cheap."""
    return tuple(part * rate * rate for part in _jacobian(path, joints(path)[2], FLANGE))


def acceleration(path: float, rate: float) -> Vector:
    """Linear and angular acceleration of the flange: the change of its twist along the trajectory."""
    before, after = twist(path - _DIFFERENCE, rate), twist(path + _DIFFERENCE, rate)
    scale = rate / (2 * _DIFFERENCE)
    return tuple((b - a) * scale for a, b in zip(before, after, strict=True))


def _jacobian(path: float, rates: Vector, point: int) -> Vector:
    """The geometric Jacobian of the origin of frame `point`, times a rate for each joint before it."""
    at = frames(path)
    target = at.origins[point]
    vx = vy = vz = wx = wy = wz = 0.0
    for rate, origin, axis in zip(rates[:point], at.origins, at.axes, strict=False):
        ax, ay, az = axis[0] * rate, axis[1] * rate, axis[2] * rate
        rx, ry, rz = target[0] - origin[0], target[1] - origin[1], target[2] - origin[2]
        vx += ay * rz - az * ry
        vy += az * rx - ax * rz
        vz += ax * ry - ay * rx
        wx, wy, wz = wx + ax, wy + ay, wz + az
    return (vx, vy, vz, wx, wy, wz)


def _mix(p: float, u: _Triple, q: float, v: _Triple) -> _Triple:
    return (p * u[0] + q * v[0], p * u[1] + q * v[1], p * u[2] + q * v[2])


def _rotation_vector(columns: _Matrix) -> _Triple:
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = columns
    sx, sy, sz = yz - zy, zx - xz, xy - yx
    sine = math.sqrt(sx * sx + sy * sy + sz * sz) / 2
    angle = math.atan2(sine, (xx + yy + zz - 1) / 2)
    if sine < 1e-9:  # no axis to be read off: the trajectory never turns the flange by exactly 0 or pi
        return (0.0, 0.0, 0.0) if angle < 1 else (angle, 0.0, 0.0)
    scale = angle / (2 * sine)
    return (sx * scale, sy * scale, sz * scale)
