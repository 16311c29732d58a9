"""The full image that the benchmarks serve: all reserved registers both ways and 20 fields of the robot's state."""

from __future__ import annotations

import struct

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


MANY_CONNECTIONS = "connections: 1024, connections_per_peer: 1024"
INPUTS = """\
  bits_in: {robot: input_bit_register_0..63, modbus: 0.0}
  integers_in: {robot: input_int_register_0..23, modbus: 10}
  doubles_in: {robot: input_double_register_0..23, modbus: 58}
"""
EVERYTHING = """\
  bits_in: {robot: input_bit_register_0..63, modbus: [0.0, {coil: 0}], owner: [plc, hmi], lease: 5s}
  integers_in: {robot: input_int_register_0..23, group: motion, limits: [-1000000, 1000000],
                modbus: {holding: 10, type: int32, scale: 2}}
  doubles_in: {robot: input_double_register_0..23, group: motion, limits: [-1000, 1000], clamp: true,
               modbus: {holding: 58, type: float64, scale: 0.001}}
"""


def full_image(robot: int, modbus: int, frequency: float = 500) -> str:
    """The text of the mapping file for a controller and a listener on these ports of the loopback interface."""
    return _image(robot, modbus, frequency, "writers: {plc: {modbus: 127.0.0.1}}\n", INPUTS)


def one_of_many(number: int, host: str, robot: int, modbus: int, frequency: float) -> str:
    """As full_image, for a cell that has its robot at an address of its own and shares its listener."""
    text = full_image(robot, modbus, frequency)
    return (
        text.replace("cell: benchmark", f"cell: benchmark-{number}")
        .replace("host: 127.0.0.1", f"host: {host}")
        .replace("gaps: zero", f"gaps: zero, unit: {number + 1}, {MANY_CONNECTIONS}")
    )


def doubles(count: int, robot: int, modbus: int, frequency: float) -> str:
    """A mapping with so many variables, a multiple of 16: doubles of the robot, over and over."""
    lines = [
        "gatewayd: 1",
        "cell: benchmark",
        f"robot: {{host: 127.0.0.1, port: {robot}, series: e, version: 5.23, frequency: {frequency:g}}}",
        f"modbus: {{listen: '127.0.0.1:{modbus}', gaps: zero}}",
        "variables:",
    ]
    lines += [
        f"  part_{part}: {{robot: output_double_register_0..15, modbus: {64 * part}}}"
        for part in range(count // 16)
    ]
    return "\n".join(lines) + "\n"


def everything_on(robot: int, modbus: int, frequency: float = 500) -> str:
    """As full_image, at the same addresses; inputs with scale, limits, leases, and a group that several may own."""
    writers = (
        "writers: {plc: {modbus: 127.0.0.1, timeout: 5s}, hmi: {modbus: 127.0.0.2, timeout: 5s}}\n"
        "groups: {motion: {owner: [plc, hmi], lease: 5s}}\n"
    )
    return _image(robot, modbus, frequency, writers, EVERYTHING)


def numbers(registers: int, number: int) -> bytes:
    """Content of so many registers from INTEGERS_IN on, each value another one than with `number` - 1."""
    integers = [2 * (number + place) for place in range(24)]
    doubles = [0.5 * number + place for place in range(18)]
    return struct.pack(">24i18d", *integers, *doubles)[: 2 * registers]


def _image(robot: int, modbus: int, frequency: float, writers: str, inputs: str) -> str:
    lines = [
        "gatewayd: 1",
        "cell: benchmark",
        f"robot: {{host: 127.0.0.1, port: {robot}, series: e, version: 5.23, frequency: {frequency:g}}}",
        f"modbus: {{listen: '127.0.0.1:{modbus}', gaps: zero}}",
        f"{writers}variables:",
        f"{inputs}  bits_out: {{robot: output_bit_register_0..63, modbus: 200.0}}",
        "  integers_out: {robot: output_int_register_0..23, modbus: 210}",
        f"  doubles_out: {{robot: output_double_register_0..23, modbus: {DOUBLES_OUT}}}",
    ]
    address = DOUBLES_OUT + 96
    for number, field in enumerate(STATE):
        lines.append(f"  {field.lower()}: {{robot: {field}, modbus: {address}}}")
        address += 24 if number < VECTORS else 4
    return "\n".join(lines) + "\n"
