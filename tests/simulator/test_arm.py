"""The arm in motion: what the outputs show agrees, while it runs, brakes, stands and carries a tool."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from gatewayd.simulator.arm import ControllerMoment, JointMotion, actual, actual_frames, target, target_frames
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.kinematics import Vector, frames, geometry, pose
from gatewayd.simulator.store import Scalar

STEP = 1e-5
Motion = Callable[[ControllerMoment], JointMotion]


def at(path: float, rate: float = 1.0) -> ControllerMoment:
    return ControllerMoment(0, 0.0, path, rate)


@pytest.mark.parametrize("path", [0.0, 1.7, 123.4])
@pytest.mark.parametrize("motion", [target, actual])
def test_joint_speeds_and_accelerations_are_derivatives(motion: Motion, path: float) -> None:
    now, before, after = motion(at(path)), motion(at(path - STEP)), motion(at(path + STEP))
    for joint in range(6):
        assert (after.q[joint] - before.q[joint]) / (2 * STEP) == pytest.approx(now.qd[joint], abs=1e-6)
        assert (after.qd[joint] - before.qd[joint]) / (2 * STEP) == pytest.approx(now.qdd[joint], abs=1e-4)


def test_half_speed_halves_speeds_and_quarters_accelerations() -> None:
    assert target(at(3.0, 0.5)).qd == pytest.approx([v / 2 for v in target(at(3.0)).qd])
    assert target(at(3.0, 0.5)).qdd == pytest.approx([a / 4 for a in target(at(3.0)).qdd])


@pytest.mark.parametrize("path", [0.5 * n for n in range(64)])
def test_the_pose_stays_within_reach_and_never_jumps(path: float) -> None:
    now, next_ = (pose(target_frames(at(moment))) for moment in (path, path + 0.002))
    assert math.hypot(*now[:3]) < 1.2
    assert math.hypot(*now[3:]) <= math.pi + 1e-9
    assert max(abs(a - b) for a, b in zip(now[:3], next_[:3], strict=True)) < 0.01


def test_actual_joints_stay_near_their_target() -> None:
    moment = at(4.2)
    assert actual(moment).q == pytest.approx(target(moment).q, abs=1e-4)
    assert actual(moment).q != target(moment).q
    assert actual_frames(moment).tcp == pytest.approx(target_frames(moment).tcp, abs=1e-4)


def sampled(controller: Controller, name: str) -> Vector:
    return tuple(float(value) for value in controller.get(name))


def test_what_a_client_reads_agrees_in_every_cycle_also_while_the_robot_brakes() -> None:
    """Joint angles integrate the speeds, and the pose is the forward kinematics of the angles and the tool."""
    controller = Controller(model="ur10e")
    controller.set("tcp_offset", (0.01, 0.0, 0.2, 0.1, 0.0, 0.0))
    arm = geometry("ur10e", (0.01, 0.0, 0.2, 0.1, 0.0, 0.0))
    period = 1 / controller.rate
    controller.advance()
    stood = 0
    for cycle in range(600):
        if cycle == 200:
            controller.modes.set_safety("protective-stop")
        q, qd, speed = (sampled(controller, name) for name in ("actual_q", "actual_qd", "actual_TCP_speed"))
        position = sampled(controller, "actual_TCP_pose")
        assert position == pytest.approx(pose(frames(arm, q)), abs=1e-9)
        controller.advance()
        later, now = sampled(controller, "actual_qd"), sampled(controller, "actual_q")
        moved = [(a + b) / 2 * period for a, b in zip(qd, later, strict=True)]
        assert now == pytest.approx([a + b for a, b in zip(q, moved, strict=True)], abs=2e-6)
        moved = [
            (a + b) / 2 * period
            for a, b in zip(speed[:3], sampled(controller, "actual_TCP_speed")[:3], strict=True)
        ]
        expected = [a + b for a, b in zip(position[:3], moved, strict=True)]
        assert sampled(controller, "actual_TCP_pose")[:3] == pytest.approx(expected, abs=5e-6)
        stood += not any(later)
    assert stood > 200


@pytest.mark.parametrize("field", ["actual_q", "target_q"])
def test_joint_angles_that_are_set_take_the_arm_along(field: str) -> None:
    controller = Controller()
    posture: tuple[Scalar, ...] = (0.0, -1.0, 1.0, -1.0, -1.5, 0.2)
    controller.set(field, posture)
    controller.advance(500)
    assert controller.get("actual_q") == controller.get("target_q") == posture
    expected = pose(frames(geometry("ur5e", (0.0, 0.0, 0.12, 0.0, 0.0, 0.0)), tuple(map(float, posture))))
    assert controller.get("actual_TCP_pose") == pytest.approx(expected)
    assert not any(controller.get("actual_TCP_speed"))
    controller.restart()
    assert controller.get("actual_q") != posture


def test_an_impossible_tool_is_not_taken() -> None:
    controller = Controller()
    before = controller.get("actual_TCP_pose")
    controller.set("tcp_offset", (math.inf, math.nan, 0, 0, 0, 0))
    controller.advance()
    assert controller.get("actual_TCP_pose") == pytest.approx(before, abs=0.01)
