"""Forward kinematics of Universal Robots arms: from joint angles to frames, pose, speed and acceleration.

Geometry is that of the Denavit-Hartenberg parameters that Universal Robots publishes for each size; a real arm's own
calibration differs from it by fractions of a millimetre. Lengths in metres, angles in radians, rotations as rotation
vectors, all in the base frame.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

Vector = tuple[float, ...]
Triple = tuple[float, float, float]
Matrix = tuple[Triple, Triple, Triple]
"""Columns: the x, y and z axis of a frame."""

ELBOW = 2
"""Index of the frame that carries the elbow: the origin after the upper arm."""
FLANGE = 6
"""Index of the tool flange's frame."""
_IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_NO_TOOL: Vector = (0.0,) * 6
_DIFFERENCE = 1e-4  # seconds either side for the numeric derivative of a twist
_TWISTS = ((0.0, 1.0), (1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, 0.0))  # cos and sin of alpha


class _Lengths(NamedTuple):
    """The lengths of one size."""

    d1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float


_SIZES: Mapping[str, _Lengths] = {
    "ur3": _Lengths(0.1519, -0.24365, -0.21325, 0.11235, 0.08535, 0.0819),
    "ur5": _Lengths(0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823),
    "ur10": _Lengths(0.1273, -0.612, -0.5723, 0.163941, 0.1157, 0.0922),
    "ur3e": _Lengths(0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921),
    "ur5e": _Lengths(0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996),
    "ur10e": _Lengths(0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655),
    "ur16e": _Lengths(0.1807, -0.4784, -0.36, 0.17415, 0.11985, 0.11655),
    "ur20": _Lengths(0.2363, -0.862, -0.7287, 0.201, 0.1593, 0.1543),
    "ur30": _Lengths(0.2363, -0.637, -0.5037, 0.201, 0.1593, 0.1543),
}


@dataclass(frozen=True, eq=False, slots=True)
class ArmGeometry:
    """A size of arm with its tool. Compared by identity, so that what is derived from it can be kept."""

    model: str
    links: tuple[tuple[float, float, float, float], ...]
    """(a, d, cos alpha, sin alpha) of each joint."""
    tool: Vector = _NO_TOOL
    """The TCP in the flange's frame, as `tcp_offset`: x, y, z, rx, ry, rz."""


def geometry(model: str, tool: Vector = _NO_TOOL) -> ArmGeometry:
    """The arm of that name, one of `MODELS`; KeyError for another."""
    d1, a2, a3, d4, d5, d6 = _SIZES[model]
    lengths = ((0.0, d1), (a2, 0.0), (a3, 0.0), (0.0, d4), (0.0, d5), (0.0, d6))
    links = tuple((a, d, *twist) for (a, d), twist in zip(lengths, _TWISTS, strict=True))
    return ArmGeometry(model, links, tool)


MODELS: tuple[str, ...] = tuple(_SIZES)
"""Sizes whose geometry is known."""
ARMS: Mapping[str, ArmGeometry] = MappingProxyType({model: geometry(model) for model in MODELS})
"""Each of them, without a tool."""


class Frames(NamedTuple):
    """Where everything is for one posture of the joints."""

    origins: tuple[Triple, ...]
    """Of the base, and of the frame after each of the six joints."""
    axes: tuple[Triple, ...]
    """The z axes of the same frames: joint n turns about axis n."""
    rotation: Matrix
    """Of the flange."""
    tcp: Triple
    """The tool centre point."""
    tool: Matrix
    """The tool's rotation."""


def frames(arm: ArmGeometry, q: Vector) -> Frames:
    """The frames at the six joint angles `q`."""
    (x, y, z), origin = _IDENTITY, (0.0, 0.0, 0.0)
    origins, axes = [origin], [z]
    for angle, (a, d, ca, sa) in zip(q, arm.links, strict=True):
        c, s = math.cos(angle), math.sin(angle)
        turned, across = _mix(c, x, s, y), _mix(-s, x, c, y)
        origin = _add(origin, _mix(a, turned, d, z))
        x, y, z = turned, _mix(ca, across, sa, z), _mix(-sa, across, ca, z)
        origins.append(origin)
        axes.append(z)
    flange: Matrix = (x, y, z)
    tx, ty, tz, rx, ry, rz = arm.tool
    tcp = _add(origin, _turn(flange, (tx, ty, tz)))
    first, second, third = rotation_matrix((rx, ry, rz))
    tool = (_turn(flange, first), _turn(flange, second), _turn(flange, third))
    return Frames(tuple(origins), tuple(axes), flange, tcp, tool)


def pose(at: Frames) -> Vector:
    """x, y, z, rx, ry, rz of the tool centre point."""
    return at.tcp + rotation_vector(at.tool)


def twist(at: Frames, rates: Vector, point: int | None = None) -> Vector:
    """Linear and angular part of the Jacobian times a rate for each joint: a velocity for joint velocities.

    Of the origin of frame `point`, moved by the joints before it; None: of the tool centre point.
    """
    target, moving = (at.tcp, FLANGE) if point is None else (at.origins[point], point)
    vx = vy = vz = wx = wy = wz = 0.0
    for rate, origin, axis in zip(rates[:moving], at.origins, at.axes, strict=False):
        ax, ay, az = axis[0] * rate, axis[1] * rate, axis[2] * rate
        rx, ry, rz = target[0] - origin[0], target[1] - origin[1], target[2] - origin[2]
        vx += ay * rz - az * ry
        vy += az * rx - ax * rz
        vz += ax * ry - ay * rx
        wx, wy, wz = wx + ax, wy + ay, wz + az
    return (vx, vy, vz, wx, wy, wz)


def acceleration(arm: ArmGeometry, q: Vector, qd: Vector, qdd: Vector) -> Vector:
    """Linear and angular acceleration of the tool centre point, of joint angles, speeds and accelerations."""

    def at(moment: float) -> Vector:
        return twist(frames(arm, _go(q, moment, qd)), _go(qd, moment, qdd))

    before, after = at(-_DIFFERENCE), at(_DIFFERENCE)
    return tuple((b - a) / (2 * _DIFFERENCE) for a, b in zip(before, after, strict=True))


def rotation_matrix(vector: Triple) -> Matrix:
    """The rotation about `vector` by its length (Rodrigues)."""
    angle = math.hypot(*vector)
    if angle == 0:
        return _IDENTITY
    x, y, z = (part / angle for part in vector)
    c, s = math.cos(angle), math.sin(angle)
    v = 1 - c
    return (
        (c + x * x * v, y * x * v + z * s, z * x * v - y * s),
        (x * y * v - z * s, c + y * y * v, z * y * v + x * s),
        (x * z * v + y * s, y * z * v - x * s, c + z * z * v),
    )


def rotation_vector(columns: Matrix) -> Triple:
    """Axis times angle of a rotation, the angle from 0 to pi."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = columns
    sx, sy, sz = yz - zy, zx - xz, xy - yx
    sine, cosine = math.hypot(sx, sy, sz) / 2, (xx + yy + zz - 1) / 2
    angle = math.atan2(sine, cosine)
    if sine > 1e-6:
        scale = angle / (2 * sine)
        return (sx * scale, sy * scale, sz * scale)
    if cosine > 0:
        return (sx / 2, sy / 2, sz / 2)
    # Half a turn: the axis is the longest column of R + 1, of either sign.
    columns_plus = ((xx + 1, xy, xz), (yx, yy + 1, yz), (zx, zy, zz + 1))
    axis = max(columns_plus, key=lambda column: math.hypot(*column))
    length = math.hypot(*axis)
    return (axis[0] / length * angle, axis[1] / length * angle, axis[2] / length * angle)


def _go(values: Vector, time: float, rates: Vector) -> Vector:
    return tuple(value + time * rate for value, rate in zip(values, rates, strict=True))


def _add(u: Triple, v: Triple) -> Triple:
    return (u[0] + v[0], u[1] + v[1], u[2] + v[2])


def _mix(p: float, u: Triple, q: float, v: Triple) -> Triple:
    return (p * u[0] + q * v[0], p * u[1] + q * v[1], p * u[2] + q * v[2])


def _turn(columns: Matrix, v: Triple) -> Triple:
    x, y, z = columns
    return _add(_mix(v[0], x, v[1], y), (v[2] * z[0], v[2] * z[1], v[2] * z[2]))
