"""What `show` says of the robot's side of a mapping."""

from __future__ import annotations

from gatewayd.links.robot.tables import TABLES
from gatewayd.mapping.loader import load

TEXT = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1}
modbus: {listen: '127.0.0.1:1502'}
variables:
  program: {robot: runtime_state, modbus: 100}
  power:   {robot: robot_status_bits, modbus: 101}
  stopped: {robot: safety_status_bits.2, modbus: 104.0}
  fault:   {robot: safety_status_bits.9, modbus: 104.1}
  joints:  {robot: joint_mode, modbus: 110}
  made:    {robot: output_int_register_0, modbus: 120}
"""


def test_the_legend_has_the_states_and_bits_that_are_mapped() -> None:
    program, power, safety, joints = TABLES.legend(load(TEXT.encode(), "cell.yaml").cell)
    assert program.startswith("runtime_state: 0 stopping, 1 stopped, 2 running, ")
    assert power.startswith("robot_status_bits: bit 0 power on, bit 1 program running, ")
    assert safety == "safety_status_bits: bit 2 protective stopped, bit 9 fault"
    assert joints.startswith("joint_mode: 235 reset, ")
