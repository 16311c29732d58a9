"""`gatewayd rtde set` against the simulator as a process, and beside a running gateway."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.cli.rtde import gateway_processes
from gatewayd.cli.rtde import set as module
from tests.cli.rtde.robot import place, rtde
from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, Simulator, free_port, wait_for


@pytest.fixture(autouse=True)
def no_other_gateway(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Gateways of this machine are no matter of these tests."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(gateway_processes, "gateway_processes", tuple)


def stop_program(simulator: Simulator) -> Simulator:
    simulator.do("overwrite runtime_state 1")
    return simulator


def test_everything_is_written_shown_by_the_robot_and_given_back(plant: Plant) -> None:
    simulator = stop_program(plant.simulator("--control", "stdin"))
    simulator.do("set input_bit_registers0_to_31 1")
    simulator.do("set standard_digital_output 4")
    result = rtde(
        "set", place(simulator), "input_int_register_24=7", "input_double_register_30=-0.5", "input_bit_register_5=on",
        "input_bit_register_70=on", "standard_digital_output_3=on", "configurable_digital_output_0=on",
        "tool_digital_output_1=on", "standard_analog_output_0=5V", "standard_analog_output_1=12mA", "speed_slider=25%",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert result.output.splitlines()[-1] == "The controller keeps these values: nothing sets them back."
    assert "standard_analog_output_1 = 12 mA" in result.output
    assert simulator.integer("input_int_register_24") == 7
    assert simulator.number("input_double_register_30") == -0.5
    assert simulator.integer("input_bit_registers0_to_31") == 0b100001, "the other bits stay"
    assert simulator.integer("actual_digital_output_bits") == 1 << 3 | 1 << 8 | 1 << 17
    assert simulator.number("standard_analog_output0") == pytest.approx(5.0)
    assert simulator.number("standard_analog_output1") == pytest.approx(12.0)
    assert simulator.number("target_speed_fraction") == pytest.approx(0.25)
    again = rtde("set", place(simulator), "input_int_register_24=8", "standard_digital_output_3=off")
    assert again.exit_code == 0, "the claims of the first are given back"
    assert simulator.integer("actual_digital_output_bits") == 1 << 8 | 1 << 17


def test_what_the_robot_does_not_show_is_said(plant: Plant) -> None:
    simulator = stop_program(plant.simulator())
    result = rtde("set", place(simulator), "external_force_torque=0,0,5,0,0,0")
    assert result.exit_code == 0, result.output
    assert "sent; the robot does not show what it holds" in result.output


def test_a_running_program_forbids_it(plant: Plant) -> None:
    simulator = plant.simulator()
    result = rtde("set", place(simulator), "input_int_register_24=7")
    assert result.exit_code == 1
    assert "nothing was written: the program is running" in result.output
    assert simulator.integer("input_int_register_24") == 0
    assert rtde("set", place(simulator), "input_int_register_24=7", "--while-running").exit_code == 0
    assert simulator.integer("input_int_register_24") == 7


def test_a_field_in_use_is_named_with_its_likely_holder(plant: Plant) -> None:
    simulator = stop_program(plant.simulator("--hold", "input_int_register_3"))
    result = rtde("set", place(simulator), "input_int_register_3=7", "input_int_register_24=7")
    assert result.exit_code == 1
    assert "nothing was written: input_int_register_3: IN_USE, probably claimed by" in result.output
    assert "PROFINET" in result.output
    assert simulator.integer("input_int_register_24") == 0


def test_what_the_robot_does_not_take_over_is_no_success(
    plant: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_PATIENCE", 0.2)
    simulator = stop_program(plant.simulator())
    simulator.do("overwrite input_int_register_24 3")
    result = rtde("set", place(simulator), "input_int_register_24=7")
    assert result.exit_code == 1
    assert "input_int_register_24 is 3, not 7" in result.output
    assert "nothing sets them back" not in result.output


CELL = """\
writers: {plc: {modbus: 127.0.0.1}}
variables:
  part: {robot: input_int_register_0, modbus: 0, owner: plc}
"""


def test_a_gateway_that_serves_the_robot_forbids_it(plant: Plant, tmp_path: Path) -> None:
    simulator = stop_program(plant.simulator())
    socket = tmp_path / "gatewayd.sock"
    plant.daemon(plant.mapping(CELL, simulator.port, name="press"), "--control", str(socket))
    wait_for(socket.exists, "the control socket")
    result = rtde("set", place(simulator), "input_int_register_24=7")
    assert result.exit_code == 1
    assert "serves this robot as cell press: write by it, with gatewayd force" in result.output
    assert simulator.integer("input_int_register_24") == 0
    other = stop_program(plant.simulator())
    assert rtde("set", place(other), "input_int_register_24=7").exit_code == 0, "another robot is nobody's"


def test_a_gateway_without_a_control_socket_forbids_it_too(plant: Plant) -> None:
    simulator = stop_program(plant.simulator())
    plant.daemon(plant.mapping(CELL, simulator.port, name="press"), "--control", "none")
    wait_for(lambda: simulator.do("clients") not in {"ok", "ok 0"}, "the gateway's connection")
    result = rtde("set", place(simulator), "input_int_register_24=7")
    assert result.exit_code == 1
    assert "is connected to this robot, and its control socket was not found" in result.output
    assert simulator.integer("input_int_register_24") == 0
    assert rtde("set", place(stop_program(plant.simulator())), "input_int_register_24=7").exit_code == 0


def test_who_cannot_be_reached_is_said() -> None:
    result = rtde("set", f"{HOST}:{free_port()}", "input_int_register_24=7")
    assert result.exit_code == 1
    assert "its RTDE service is off" in result.output


def test_a_robot_that_sends_no_data_is_written_nothing(plant: Plant, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether a program runs is not known then."""
    monkeypatch.setattr(module, "_PATIENCE", 0.2)
    simulator = stop_program(plant.simulator("--silence"))
    result = rtde("set", place(simulator), "input_int_register_24=7")
    assert result.exit_code == 1
    assert "nothing was written: " in result.output
    assert simulator.integer("input_int_register_24") == 0


def test_wrong_usage_says_what_to_do() -> None:
    result = rtde("set", "127.0.0.1:1", "standard_digital_output=8")
    assert result.exit_code == 2
    assert "standard_digital_output_1=on" in result.output
