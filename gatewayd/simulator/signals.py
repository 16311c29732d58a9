"""What the outputs of an undisturbed robot show: one pure function of the moment for every field that moves by itself,
and the first value of those that change only when they are set.

The values are consistent rather than exact: speeds are the derivatives of positions, forces and currents follow the
load, temperatures and voltages drift within what a real arm shows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache

from gatewayd.rtde.enums import JointMode, ProgramState, RobotMode, SafetyStatus, TimeScaleSource
from gatewayd.simulator.arm import (
    DRIVEN,
    OFF,
    ControllerMoment,
    JointMotion,
    actual,
    actual_frames,
    target,
    target_frames,
)
from gatewayd.simulator.kinematics import ELBOW, FLANGE, Frames, Vector, acceleration, pose, twist

Signal = Callable[[ControllerMoment], Vector]
"""The elements of a field's value at a moment; a scalar has one."""

CYCLE_FIELDS = frozenset({"timestamp", "control_step"})
"""Fields that follow the step counter exactly."""

_GRAVITY = 9.82
_PAYLOAD = 1.2  # kg
_ARM_MASS = 18.4  # kg, moved share of a UR5e
_LOADED = (0.0, 62.0, 24.0, 3.6, 0.4, 0.0)  # Nm of gravity at full reach
_INERTIA = (2.1, 2.6, 0.9, 0.12, 0.08, 0.02)  # kg m2 seen by each joint
_FRICTION = (4.0, 5.0, 3.5, 1.2, 1.0, 0.8)  # Nm s/rad
_TORQUE_CONSTANT = (13.26, 13.26, 13.26, 9.76, 9.76, 9.76)  # Nm/A at the joint's output
_WARMTH = (31.0, 33.5, 32.0, 35.0, 36.5, 37.0)  # degrees Celsius
_SENSOR_RIPPLE = 0.35  # N, Nm/10
_NONE: Vector = (0.0,) * 6
_Motion = Callable[[ControllerMoment], JointMotion]


def _ripple(moment: ControllerMoment, number: int) -> float:
    """Repeatable noise of amplitude 1, different for each `number`."""
    phase = moment.time * (41.0 + 7.3 * number) + number
    return 0.6 * math.sin(phase) + 0.4 * math.sin(2.7 * phase)


@lru_cache(4)
def _torques(moment: ControllerMoment) -> Vector:
    """Joint torques in Nm: gravity by the horizontal reach, inertia, friction; none while brakes hold the arm."""
    if moment.power != DRIVEN:
        return _NONE
    (_, lift, elbow, wrist, *_), qd, qdd = target(moment)
    lever = (0.0, math.cos(lift), math.cos(lift + elbow), math.cos(lift + elbow + wrist), 0.3, 0.0)
    parts = zip(_LOADED, lever, _INERTIA, qdd, _FRICTION, qd, strict=True)
    return tuple(g * c + i * a + f * v for g, c, i, a, f, v in parts)


def _target_current(moment: ControllerMoment) -> Vector:
    return tuple(torque / k for torque, k in zip(_torques(moment), _TORQUE_CONSTANT, strict=True))


def _actual_current(moment: ControllerMoment) -> Vector:
    if moment.power != DRIVEN:
        return _NONE
    return tuple(a + 0.02 * _ripple(moment, 12 + n) for n, a in enumerate(_target_current(moment)))


def _actual_current_as_torque(moment: ControllerMoment) -> Vector:
    return tuple(a * k for a, k in zip(_actual_current(moment), _TORQUE_CONSTANT, strict=True))


def _pose(frames: Callable[[ControllerMoment], Frames]) -> Signal:
    """The TCP of the target or of the actual joints."""
    return lambda moment: pose(frames(moment))


def _tcp_speed(frames: Callable[[ControllerMoment], Frames], motion: _Motion) -> Signal:
    """The change of that pose: its position's derivative, and its angular velocity."""
    return lambda moment: twist(frames(moment), motion(moment).qd)


def _tcp_acceleration(motion: _Motion) -> Signal:
    """The change of that speed."""
    return lambda moment: acceleration(moment.arm, *motion(moment))


@lru_cache(2)
def _thrust(moment: ControllerMoment) -> Vector:
    """What the joints' accelerations make of the flange's: near enough for a force, and cheap."""
    return twist(target_frames(moment), target(moment).qdd, FLANGE)


def _elbow_velocity(moment: ControllerMoment) -> Vector:
    return twist(actual_frames(moment), actual(moment).qd, ELBOW)[:3]


@lru_cache(2)
def _wrench(moment: ControllerMoment) -> Vector:
    """Force and torque at the tool beyond its payload: what the payload's inertia makes of the acceleration."""
    inertia = (-_PAYLOAD,) * 3 + (-0.02,) * 3
    ripple = (_SENSOR_RIPPLE,) * 3 + (_SENSOR_RIPPLE / 10,) * 3
    parts = zip(inertia, _thrust(moment), ripple, strict=True)
    return tuple(m * a + r * _ripple(moment, 24 + n) for n, (m, a, r) in enumerate(parts))


def _raw_wrench(moment: ControllerMoment) -> Vector:
    x, y, z, *torque = _wrench(moment)
    return (x, y, z - _PAYLOAD * _GRAVITY, *torque)


def _accelerometer(moment: ControllerMoment) -> Vector:
    """Acceleration plus gravity's reaction, turned into the flange's frame."""
    ax, ay, az, *_ = _thrust(moment)
    az += _GRAVITY
    return tuple(ax * x + ay * y + az * z for x, y, z in actual_frames(moment).rotation)


def _power(moment: ControllerMoment) -> float:
    """Electrical power of the arm in W: standby plus what the joints do."""
    if moment.power == OFF:
        return 0.0
    return 85.0 + sum(abs(t * v) for t, v in zip(_torques(moment), target(moment).qd, strict=True))


def _temperatures(moment: ControllerMoment) -> Vector:
    warm = 1 - math.exp(-moment.time / 1800)
    return tuple(24 + (w - 24) * warm + 0.05 * _ripple(moment, n) for n, w in enumerate(_WARMTH))


def _digital_inputs(moment: ControllerMoment) -> Vector:
    """A light running over the standard inputs, another over the configurable ones, tool input 0 blinking."""
    second = int(moment.path)
    return (1 << second % 8 | 1 << 8 + second // 2 % 8 | (second // 4 & 1) << 16,)


def _base_wrench(moment: ControllerMoment) -> Vector:
    """What the mounting carries: the arm's weight, and its inertia along the flange's acceleration."""
    x, y, z, *torque = _thrust(moment)
    share = 0.4 * _ARM_MASS
    return (share * x, share * y, share * z + _ARM_MASS * _GRAVITY, *(share * part for part in torque))


def _around(value: float, spread: float, number: int) -> Signal:
    """A scalar that stays within `spread` of `value`."""
    return lambda moment: (value + spread * _ripple(moment, number),)


def _while_powered(signal: Signal) -> Signal:
    """A voltage that the arm has only with power."""
    return lambda moment: signal(moment) if moment.power != OFF else (0.0,) * len(signal(moment))


def _encoder(counts_per_second: float) -> Signal:
    """A raw counter of an incremental encoder: INT32 that wraps."""
    return lambda moment: (
        (int(moment.path * counts_per_second) + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000,
    )


SIGNALS: Mapping[str, Signal] = {
    "timestamp": lambda moment: (moment.time,),
    "control_step": lambda moment: (moment.step,),
    "target_q": lambda moment: target(moment).q,
    "target_qd": lambda moment: target(moment).qd,
    "target_qdd": lambda moment: target(moment).qdd,
    "target_current": _target_current,
    "target_moment": _torques,
    "actual_q": lambda moment: actual(moment).q,
    "actual_qd": lambda moment: actual(moment).qd,
    "actual_qdd": lambda moment: actual(moment).qdd,
    "actual_current": _actual_current,
    "actual_current_as_torque": _actual_current_as_torque,
    "actual_moment": _actual_current_as_torque,
    "joint_control_output": _actual_current,
    "actual_TCP_pose": _pose(actual_frames),
    "target_TCP_pose": _pose(target_frames),
    "actual_TCP_speed": _tcp_speed(actual_frames, actual),
    "target_TCP_speed": _tcp_speed(target_frames, target),
    "actual_TCP_acceleration": _tcp_acceleration(actual),
    "target_TCP_acceleration": _tcp_acceleration(target),
    "actual_TCP_force": _wrench,
    "ft_raw_wrench": _raw_wrench,
    "wrench_calc_from_currents": _wrench,
    "tcp_force_scalar": lambda moment: (math.hypot(*_wrench(moment)[:3]),),
    "actual_tool_accelerometer": _accelerometer,
    "elbow_position": lambda moment: actual_frames(moment).origins[ELBOW],
    "elbow_velocity": _elbow_velocity,
    "actual_momentum": lambda moment: (0.4 * _ARM_MASS * math.hypot(*_elbow_velocity(moment)),),
    "target_base_wrench": _base_wrench,
    "actual_digital_input_bits": _digital_inputs,
    "actual_configurable_digital_input_bits": lambda moment: (int(_digital_inputs(moment)[0]) >> 8 & 0xFF,),
    "euromap67_input_bits": lambda moment: (1 << int(moment.path) % 16,),
    "joint_temperatures": _temperatures,
    "tool_temperature": lambda moment: (27 + 8 * (1 - math.exp(-moment.time / 2400)),),
    "actual_execution_time": _around(0.31, 0.04, 31),
    "actual_main_voltage": _around(48.1, 0.05, 32),
    "actual_robot_voltage": _while_powered(_around(48.0, 0.08, 33)),
    "actual_robot_current": lambda moment: (_power(moment) / 48,),
    "actual_joint_voltage": _while_powered(
        lambda moment: tuple(48 - 0.3 * abs(a) for a in _actual_current(moment))
    ),
    "io_current": _around(42.0, 1.5, 34),
    "tool_output_current": _around(61.0, 2.0, 35),
    "euromap67_24V_voltage": _around(24.0, 0.05, 36),
    "euromap67_24V_current": _around(38.0, 1.0, 37),
    "standard_analog_input0": _around(5.0, 1.5, 0),
    "standard_analog_input1": _around(12.0, 0.4, 1),
    "tool_analog_input0": _around(3.3, 0.2, 2),
    "tool_analog_input1": _around(1.1, 0.1, 3),
    "joint_position_deviation_ratio": _around(0.06, 0.03, 38),
    "collision_detection_ratio": _around(0.12, 0.06, 39),
    "actual_robot_energy_consumed": lambda moment: (moment.time * 95 / 3600,),
    "actual_robot_braking_energy_dissipated": lambda moment: (moment.path * 1.7 / 3600,),
    "encoder0_raw": _encoder(4096),
    "encoder1_raw": _encoder(-1024),
    "script_control_line": lambda moment: (12 + int(moment.path) % 8,),
}
"""Fields that change by themselves."""

INITIAL: Mapping[str, float | Vector] = {
    "robot_mode": RobotMode.RUNNING,
    "joint_mode": (JointMode.RUNNING,) * 6,
    "safety_mode": 1,
    "safety_status": SafetyStatus.NORMAL,
    "safety_status_bits": 0b1,
    "robot_status_bits": 0b11,
    "runtime_state": ProgramState.RUNNING,
    "speed_scaling": 1.0,
    "target_speed_fraction": 1.0,
    "time_scale_source": TimeScaleSource.NOT_SCALED,
    "target_execution_time": 2.0,
    "actual_current_window": (4.0, 4.0, 4.0, 2.0, 2.0, 2.0),
    "tcp_offset": (0.0, 0.0, 0.12, 0.0, 0.0, 0.0),
    "payload": _PAYLOAD,
    "payload_cog": (0.0, 0.0, 0.06),
    "payload_inertia": (0.003, 0.003, 0.002, 0.0, 0.0, 0.0),
    "target_gravity": (0.0, 0.0, _GRAVITY),
    "analog_io_types": 0b0001,
    "standard_analog_output0": 4.0,
    "standard_analog_output1": 4.0,
    "tool_mode": 253,
    "tool_analog_input_types": 0b11,
    "tool_output_voltage": 24,
    "tool_digital_output0_mode": 1,
    "tool_digital_output1_mode": 1,
}
"""First values of fields that change only when they are set; every other field starts at 0."""
