"""The full image that the benchmarks serve: all reserved registers both ways and 20 fields of the robot's state."""

from __future__ import annotations

INTEGERS_IN = 10
"""Address of `input_int_register_0`; the 24 integers take 48 registers, the 24 doubles after them 96."""
WRITABLE = 48 + 72
"""Registers from INTEGERS_IN that one request can write without splitting a double: 24 integers and 18 doubles."""
DOUBLES_OUT = 300
"""Address of `output_double_register_0`; 96 registers, the state follows without a gap."""

STATE = (
    "actual_q",
    "actual_qd",
    "actual_current",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "target_q",
    "target_TCP_pose",
    "joint_temperatures",
    "actual_execution_time",
    "actual_main_voltage",
    "actual_robot_voltage",
    "actual_robot_current",
    "actual_momentum",
    "actual_digital_input_bits",
    "actual_digital_output_bits",
    "robot_mode",
    "safety_mode",
    "runtime_state",
    "speed_scaling",
)

VECTORS = 9
"""The first fields of STATE have six elements."""


def full_image(robot: int, modbus: int, frequency: float = 500, writer: str = "127.0.0.1") -> str:
    """The text of the mapping file for a controller and a listener on these ports of the loopback interface."""
    lines = [
        "gatewayd: 1",
        "cell: benchmark",
        f"robot: {{host: 127.0.0.1, port: {robot}, series: e, version: 5.23, frequency: {frequency:g}}}",
        f"modbus: {{listen: '127.0.0.1:{modbus}', gaps: zero}}",
        f"writers: {{plc: {{modbus: {writer}}}}}",
        "variables:",
        "  bits_in: {robot: input_bit_register_0..63, modbus: 0.0}",
        f"  integers_in: {{robot: input_int_register_0..23, modbus: {INTEGERS_IN}}}",
        f"  doubles_in: {{robot: input_double_register_0..23, modbus: {INTEGERS_IN + 48}}}",
        "  bits_out: {robot: output_bit_register_0..63, modbus: 200.0}",
        "  integers_out: {robot: output_int_register_0..23, modbus: 210}",
        f"  doubles_out: {{robot: output_double_register_0..23, modbus: {DOUBLES_OUT}}}",
    ]
    address = DOUBLES_OUT + 96
    for number, field in enumerate(STATE):
        lines.append(f"  {field.lower()}: {{robot: {field}, modbus: {address}}}")
        address += 24 if number < VECTORS else 4
    return "\n".join(lines) + "\n"
