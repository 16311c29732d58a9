"""The plan of a session with the controller in words."""

from __future__ import annotations

from gatewayd.links.registry import kind_of
from gatewayd.links.robot.plan import RobotPlan
from gatewayd.mapping.loader import load

TEXT = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1, watchdog: {field: input_int_register_23, frequency: 10, requires: plc}}
modbus: {listen: '127.0.0.1:1502'}
writers: {plc: {modbus: 127.0.0.2}}
variables:
  start: {robot: input_bit_register_0, modbus: 0.0, owner: plc}
"""


def test_settings_and_address() -> None:
    plan = load(TEXT.encode(), "cell.yaml").plan
    assert plan is not None
    found = kind_of("robot").describe(plan.the(RobotPlan), plan.cell)
    assert found.settings["watchdog"] == "input_int_register_23 at 10 Hz, requires plc"
    assert found.settings["frequency"] == "the controller's own"
    assert found.settings["adopt_for"] == "10 s"
    assert found.fields == {"address": "127.0.0.1:30004"}
    assert not found.places


def test_states_and_status_bits_have_words() -> None:
    variables = """\
  mode:    {robot: runtime_state, modbus: 100}
  safety:  {robot: safety_status_bits, modbus: 102}
  stopped: {robot: safety_status_bits.2, modbus: 104.0}
  made:    {robot: output_int_register_0, modbus: 106}
"""
    plan = load((TEXT + variables).encode(), "cell.yaml").plan
    assert plan is not None
    found = kind_of("robot").describe(plan.the(RobotPlan), plan.cell)
    assert {index: words[1] for index, words in found.meanings.items()} == {
        1: "stopped",
        3: "protective stopped",
    }
    assert {index: words[2] for index, words in found.bits.items()} == {2: "protective stopped"}
