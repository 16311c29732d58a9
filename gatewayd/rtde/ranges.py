"""What fields hold in truth, where that is much less than their type has: modes and bits, and physical quantities.

For checks of what carries a value on: whatever cannot show this much, sign included, never shows what the field holds.
Physical ranges are what every robot reaches in ordinary use. They are no limits of it, and no promise: a larger arm
goes further. Fields that a program gives their meaning (registers) have none.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Mapping

Range: TypeAlias = tuple[float, float]

_TURN: Final = 6.283
"""A joint goes a full turn to both sides."""
_HALF_TURN: Final = 3.1416
"""Longest rotation vector."""


def usual_range(field: str, element: int | None = None) -> Range | None:
    """What the field, or an element of it, holds in ordinary use, in its own unit; None: all that its type has."""
    ranges = RANGES.get(field)
    if ranges is None:
        return None
    return ranges[0] if len(ranges) == 1 or element is None else ranges[element]


def _even(end: float) -> tuple[Range, ...]:
    return ((-end, end),)


def _linear_and_angular(linear: float, angular: float) -> tuple[Range, ...]:
    return ((-linear, linear),) * 3 + ((-angular, angular),) * 3


_POSE: Final = _linear_and_angular(0.5, _HALF_TURN)
_SPEED: Final = _linear_and_angular(1.0, 3.0)
_ACCELERATION: Final = _linear_and_angular(2.0, 5.0)
_WRENCH: Final = _linear_and_angular(50.0, 5.0)
_RATIO: Final = ((0.0, 1.0),)
_BYTE: Final = ((0, 255),)
_IN_V_OR_MA: Final = ((0.0, 10.0),)

RANGES: Final[Mapping[str, tuple[Range, ...]]] = {
    # -- modes and bits --
    "robot_mode": ((-1, 255),),
    "joint_mode": _BYTE,
    "safety_mode": _BYTE,
    "safety_status": _BYTE,
    "runtime_state": _BYTE,
    "tool_mode": _BYTE,
    "time_scale_source": ((-1, 255),),
    "robot_status_bits": ((0, 0xF),),
    "safety_status_bits": ((0, 0xFFF),),
    "analog_io_types": ((0, 0xF),),
    "tool_analog_input_types": ((0, 0xF),),
    "tool_output_voltage": ((0, 24),),
    "actual_digital_input_bits": ((0, 0x3FFFF),),
    "actual_digital_output_bits": ((0, 0x3FFFF),),
    "actual_configurable_digital_input_bits": _BYTE,
    "actual_configurable_digital_output_bits": _BYTE,
    # -- joints: rad, rad/s, rad/s2, A, Nm, degrees Celsius, V --
    "target_q": _even(_TURN),
    "actual_q": _even(_TURN),
    "target_qd": _even(3.0),
    "actual_qd": _even(3.0),
    "target_qdd": _even(10.0),
    "actual_qdd": _even(10.0),
    "target_current": _even(3.0),
    "actual_current": _even(3.0),
    "joint_control_output": _even(3.0),
    "target_moment": _even(20.0),
    "actual_moment": _even(20.0),
    "actual_current_as_torque": _even(20.0),
    "joint_temperatures": ((0.0, 80.0),),
    "actual_joint_voltage": ((0.0, 50.0),),
    # -- tool: m, rad, m/s, N, Nm, kg, m/s2 --
    "actual_TCP_pose": _POSE,
    "target_TCP_pose": _POSE,
    "actual_TCP_speed": _SPEED,
    "target_TCP_speed": _SPEED,
    "actual_TCP_acceleration": _ACCELERATION,
    "target_TCP_acceleration": _ACCELERATION,
    "actual_TCP_force": _WRENCH,
    "ft_raw_wrench": _WRENCH,
    "wrench_calc_from_currents": _WRENCH,
    "target_base_wrench": _WRENCH,
    "external_force_torque": _WRENCH,
    "tcp_force_scalar": ((0.0, 100.0),),
    "tcp_offset": _linear_and_angular(0.2, _HALF_TURN),
    "actual_tool_accelerometer": _even(9.9),
    "target_gravity": _even(9.9),
    "elbow_position": _even(0.4),
    "elbow_velocity": _even(1.0),
    "payload": ((0.0, 3.0),),
    "payload_cog": _even(0.1),
    # -- electrics: V, A, mA; degrees Celsius --
    "actual_main_voltage": ((0.0, 50.0),),
    "actual_robot_voltage": ((0.0, 50.0),),
    "actual_robot_current": ((0.0, 3.0),),
    "io_current": ((0.0, 500.0),),
    "standard_analog_input0": _IN_V_OR_MA,
    "standard_analog_input1": _IN_V_OR_MA,
    "standard_analog_output0": _IN_V_OR_MA,
    "standard_analog_output1": _IN_V_OR_MA,
    "tool_analog_input0": _IN_V_OR_MA,
    "tool_analog_input1": _IN_V_OR_MA,
    "tool_output_current": ((0.0, 500.0),),
    "tool_temperature": ((0.0, 60.0),),
    "euromap67_24V_voltage": ((0.0, 25.0),),
    "euromap67_24V_current": ((0.0, 500.0),),
    # -- shares --
    "speed_scaling": _RATIO,
    "target_speed_fraction": _RATIO,
    "speed_slider_fraction": _RATIO,
    "standard_analog_output_0": _RATIO,
    "standard_analog_output_1": _RATIO,
    "joint_position_deviation_ratio": _RATIO,
    "collision_detection_ratio": _RATIO,
    # -- what grows: half a year in seconds, some megawatt-seconds in Wh --
    "timestamp": ((0.0, 15e6),),
    "actual_robot_energy_consumed": ((0.0, 1000.0),),
}
"""By field; one range for all elements, or one for each."""
