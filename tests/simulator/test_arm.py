"""The arm: speeds are the derivatives of positions."""

from __future__ import annotations

import math

import pytest

from gatewayd.simulator.arm import ELBOW, FLANGE, acceleration, frames, joints, pose, twist

STEP = 1e-5


@pytest.mark.parametrize("path", [0.0, 1.7, 123.4])
def test_joint_speeds_and_accelerations_are_derivatives(path: float) -> None:
    _, speeds, changes = joints(path)
    before, after = joints(path - STEP), joints(path + STEP)
    for joint in range(6):
        assert (after[0][joint] - before[0][joint]) / (2 * STEP) == pytest.approx(speeds[joint], abs=1e-6)
        assert (after[1][joint] - before[1][joint]) / (2 * STEP) == pytest.approx(changes[joint], abs=1e-6)


@pytest.mark.parametrize("point", [ELBOW, FLANGE])
def test_linear_speed_is_the_derivative_of_the_position(point: int) -> None:
    before, after = frames(3.0 - STEP).origins[point], frames(3.0 + STEP).origins[point]
    derived = [(b - a) / (2 * STEP) for a, b in zip(before, after, strict=True)]
    assert twist(3.0, 1.0, point)[:3] == pytest.approx(derived, abs=1e-6)


def test_acceleration_is_the_derivative_of_speed() -> None:
    derived = [
        (b - a) / (2 * STEP) for a, b in zip(twist(3.0 - STEP, 1.0), twist(3.0 + STEP, 1.0), strict=True)
    ]
    assert acceleration(3.0, 1.0) == pytest.approx(derived, abs=1e-5)


def test_half_speed_halves_velocities_and_quarters_accelerations() -> None:
    assert twist(3.0, 0.5) == pytest.approx([v / 2 for v in twist(3.0, 1.0)])
    assert acceleration(3.0, 0.5) == pytest.approx([a / 4 for a in acceleration(3.0, 1.0)])


@pytest.mark.parametrize("path", [0.5 * n for n in range(64)])
def test_the_pose_stays_within_reach_and_never_jumps(path: float) -> None:
    now, next_ = pose(path), pose(path + 0.002)
    assert math.hypot(*now[:3]) < 1.2
    assert math.hypot(*now[3:]) <= math.pi + 1e-9
    assert max(abs(a - b) for a, b in zip(now[:3], next_[:3], strict=True)) < 0.01


def test_the_rotation_is_a_rotation() -> None:
    x, y, z = frames(2.2).rotation
    for a, b, product in ((x, x, 1), (y, y, 1), (z, z, 1), (x, y, 0), (y, z, 0), (z, x, 0)):
        assert sum(p * q for p, q in zip(a, b, strict=True)) == pytest.approx(product, abs=1e-12)
