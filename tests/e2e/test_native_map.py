"""A PLC program for the robot's own Modbus server against `mappings/ur-native-map.yaml`, by a foreign client.

The expectations are of Universal Robots' "ModBus Server Data" and of programs published for it, not of the mapping.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from pyModbusTCP.client import ModbusClient

from tests.e2e.plant import Plant
from tests.e2e.plc import FAILED, NO_ADDRESS
from tests.e2e.processes import HOST, Simulator, wait_for

MAPPING = Path(__file__).parents[2] / "mappings" / "ur-native-map.yaml"
STATES = (
    "power on",
    "protective stop",
    "emergency stop",
    "teach button",
    "power button",
    "stopped for safety",
)
"""Registers, and coils, from 260 on."""


def connect(plant: Plant) -> tuple[Simulator, ModbusClient]:
    """The shipped file with addresses of this test, and a program that asks unit 255, as for a robot."""
    simulator = plant.simulator()
    text = MAPPING.read_text()
    for place, value in (
        (r"host: 192\.0\.2\.15", f"host: {HOST}\n  port: {simulator.port}\n  stale_after: 600ms"),
        (r"listen: 127\.0\.0\.1:\d+", f"listen: {HOST}:{plant.modbus}"),
        (r"modbus: 127\.0\.0\.1,", "modbus: 127.0.0.0/8,"),
    ):
        text, found = re.subn(place, value, text)
        assert found == 1
    path = plant.directory / MAPPING.name
    path.write_text(text)
    plant.daemon(path)
    client = ModbusClient(HOST, plant.modbus, unit_id=255, timeout=10)
    wait_for(lambda: client.read_holding_registers(258, 1) == [7], "the robot mode")
    return simulator, client


def signed(words: list[int] | None) -> list[int]:
    """As programs for the robot's server read them: greater than 32767 is negative."""
    assert words is not None
    return [word - 0x10000 if word > 0x7FFF else word for word in words]


def test_pose_and_joints_are_in_tenths_of_millimetres_and_milliradians(plant: Plant) -> None:
    simulator, client = connect(plant)
    simulator.do("set actual_TCP_pose 0.1234,-0.5,1.3,3.1416,-3.1416,0.0005")
    simulator.do("set actual_q 1.5708,-1.5708,3,-6.2832,0,6.2832")
    simulator.do("set actual_TCP_speed 0.25,-1,0,0.5,0,0")
    wait_for(lambda: signed(client.read_input_registers(410, 1)) == [250], "the last of what was set")
    for read in (client.read_holding_registers, client.read_input_registers):
        assert signed(read(400, 6)) == [1234, -5000, 13000, 3142, -3142, 0]
        assert signed(read(270, 6)) == [1571, -1571, 3000, -6283, 0, 6283]
        assert signed(read(410, 6)) == [250, -1000, 0, 500, 0, 0]
    assert math.degrees(signed(client.read_holding_registers(270, 1))[0] / 1000) == pytest.approx(90, abs=0.1)


def test_currents_temperatures_and_modes(plant: Plant) -> None:
    simulator, client = connect(plant)
    simulator.do("set actual_current 1.5,-2,0,0,0,0.25")
    simulator.do("set joint_temperatures 31.4,20,20,20,20,25.6")
    simulator.do("set joint_mode 253,253,253,253,253,252")
    simulator.do("set tool_temperature 30")
    simulator.do("set tool_output_current 120")
    simulator.do("set safety_mode 3")
    wait_for(lambda: client.read_holding_registers(266, 1) == [3], "the safety mode")
    assert signed(client.read_holding_registers(290, 6)) == [1500, -2000, 0, 0, 0, 250]
    assert client.read_holding_registers(300, 6) == [31, 20, 20, 20, 20, 26]
    assert client.read_holding_registers(310, 6) == [253] * 5 + [252]
    assert client.read_holding_registers(769, 2) == [30, 120]


@pytest.mark.parametrize(
    "field, value, on",
    [
        ("robot_status_bits", 1, {"power on"}),
        ("robot_status_bits", 4, {"teach button"}),
        ("robot_status_bits", 8, {"power button"}),
        ("safety_status_bits", 1 << 2, {"protective stop"}),
        ("safety_status_bits", 1 << 7 | 1 << 10, {"emergency stop", "stopped for safety"}),
    ],
)
def test_states_are_registers_and_bits(plant: Plant, field: str, value: int, on: set[str]) -> None:
    simulator, client = connect(plant)
    simulator.do("set robot_status_bits 0")
    simulator.do("set safety_status_bits 0")
    simulator.do(f"set {field} {value}")
    expected = [name in on for name in STATES]
    wait_for(lambda: client.read_coils(260, 6) == expected, "the states")
    assert client.read_discrete_inputs(260, 6) == expected
    assert client.read_holding_registers(260, 6) == list(map(int, expected))


def test_digital_inputs_and_outputs_have_their_bits(plant: Plant) -> None:
    """[BBBBBBBBTTxxxxxx] from bit 0 on; configurable ones on their own."""
    simulator, client = connect(plant)
    simulator.do(f"set actual_digital_input_bits {1 << 0 | 1 << 7 | 1 << 9 | 1 << 17}")
    simulator.do(f"set actual_digital_output_bits {1 << 3 | 1 << 15 | 1 << 16}")
    wait_for(lambda: client.read_holding_registers(0, 2) == [1 | 1 << 7 | 1 << 9, 1 << 3 | 1 << 8], "bits")
    assert client.read_holding_registers(21, 2) == [2, 1]
    assert client.read_holding_registers(30, 2) == [1 << 1, 1 << 7]
    assert client.read_coils(0, 10) == [True] + [False] * 6 + [True, False, True]
    assert client.read_coils(16, 10) == [number in {3, 8} for number in range(10)]
    assert client.read_coils(136, 8) == [number == 7 for number in range(8)]


def test_shared_registers_reach_the_robot_program_and_come_back(plant: Plant) -> None:
    """The demo program echoes; both functions for writing, numbers without sign."""
    simulator, client = connect(plant)
    assert client.write_single_register(128, 65535)
    assert client.write_multiple_registers(129, [7, 8])
    assert client.write_multiple_coils(300, [True, False, True])
    wait_for(lambda: client.read_holding_registers(192, 3) == [65535, 7, 8], "the answer of the program")
    wait_for(lambda: client.read_coils(500, 3) == [True, False, True], "the bits of the program")
    assert simulator.integer("input_int_register_0") == 65535


def test_what_is_not_served_is_refused(plant: Plant) -> None:
    """It never looks like a value: analog counts, versions, and writing outputs."""
    _, client = connect(plant)
    for address in (2, 4, 16, 152, 256, 257, 320, 2048):
        assert client.read_holding_registers(address, 1) is None
        assert client.last_except == NO_ADDRESS, address
    assert not client.write_single_register(1, 255)
    assert client.last_except == NO_ADDRESS
    assert not client.write_single_coil(16, bit_value=True)
    assert client.last_except == NO_ADDRESS


def test_without_the_robot_nothing_is_answered(plant: Plant) -> None:
    simulator, client = connect(plant)
    simulator.kill()
    wait_for(lambda: client.read_holding_registers(270, 6) is None, "the loss of the robot")
    assert client.last_except == FAILED
