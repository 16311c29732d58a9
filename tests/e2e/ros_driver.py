"""A client with the recipes of Universal Robots' ROS 2 driver: python -m tests.e2e.ros_driver HOST PORT.

The driver itself is no Python package; what it asks of the controller is in its two recipe files, and one refused
input refuses all. Prints `ready`, or `refused FIELDS`; each line NUMBER VALUE of its input is written to that double
register, and answered with `written` and the packages that were skipped until then.
"""

from __future__ import annotations

import asyncio
import sys

from gatewayd import rtde

OUTPUTS = (
    "timestamp", "actual_q", "actual_qd", "speed_scaling", "target_speed_fraction", "runtime_state",
    "actual_TCP_force", "actual_TCP_pose", "target_TCP_pose", "tcp_offset", "actual_digital_input_bits",
    "actual_digital_output_bits", "standard_analog_input0", "standard_analog_input1", "standard_analog_output0",
    "standard_analog_output1", "analog_io_types", "tool_mode", "tool_analog_input_types", "tool_analog_input0",
    "tool_analog_input1", "tool_output_voltage", "tool_output_current", "tool_temperature", "robot_mode",
    "safety_mode", "robot_status_bits", "safety_status_bits", "actual_current",
)  # fmt: skip
INPUTS = (
    "speed_slider_mask", "speed_slider_fraction", "standard_digital_output_mask", "standard_digital_output",
    "configurable_digital_output_mask", "configurable_digital_output", "tool_digital_output_mask",
    "tool_digital_output", "standard_analog_output_mask", "standard_analog_output_type",
    "standard_analog_output_0", "standard_analog_output_1",
    *(f"input_double_register_{number}" for number in range(24, 31)),
)  # fmt: skip


async def main(host: str, port: int) -> None:
    robot = rtde.connect(host, port=port, outputs=OUTPUTS, inputs={"driver": INPUTS}, frequency=125)
    try:
        await robot.open()
    except rtde.FieldsRefusedError as refused:
        print("refused", *(each.field for each in refused.fields), flush=True)
        return
    print("ready", flush=True)
    loop = asyncio.get_running_loop()
    while line := (await loop.run_in_executor(None, sys.stdin.readline)).split():
        before = robot.statistics.packages
        await robot.write("driver", {f"input_double_register_{line[0]}": float(line[1])})
        while robot.statistics.packages < before + 10:
            await robot.newer(10)
        print("written", robot.statistics.skipped, flush=True)
    await robot.close()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], int(sys.argv[2])))
