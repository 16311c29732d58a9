"""Writing by recipes and by helpers, seen at the simulated controller."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from gatewayd import rtde
from gatewayd.simulator.server import SimulatedController

Connect = Callable[..., rtde.Robot]
IO = {
    "io": [
        "standard_digital_output_mask",
        "standard_digital_output",
        "configurable_digital_output_mask",
        "configurable_digital_output",
        "tool_digital_output_mask",
        "tool_digital_output",
        "speed_slider_mask",
        "speed_slider_fraction",
        "standard_analog_output_mask",
        "standard_analog_output_type",
        "standard_analog_output_0",
        "standard_analog_output_1",
    ]
}


async def test_recipes_are_sent_each_by_itself(connect: Connect, simulator: SimulatedController) -> None:
    inputs = {"in1": ["input_int_register_0", "input_int_register_1"], "in2": ["input_double_register_24"]}
    simulator.controller.set("input_int_register_1", (42,))
    async with connect(inputs=inputs) as robot:
        await robot.write("in1", input_int_register_0=7, verify=True)
        assert simulator.controller.get("input_int_register_1") == (42,)
        await robot.write("in1", {"input_int_register_1": 5})
        await robot.write("in2", input_double_register_24=1.5, verify=True)
        assert robot.known("in1") == {"input_int_register_0": 7, "input_int_register_1": 5}
        assert robot.known("in2") == {"input_double_register_24": 1.5}
        assert robot.statistics.writes == 3


async def test_without_a_reading_the_missing_fields_are_named(
    connect: Connect, simulator: SimulatedController
) -> None:
    simulator.faults.unreadable = frozenset({"input_int_register_1"})
    inputs = {"in": ["input_int_register_0", "input_int_register_1", "external_force_torque"]}
    async with connect(inputs=inputs) as robot:
        with pytest.raises(rtde.WriteRefusedError, match="what it holds is not known") as refusal:
            await robot.write("in", input_int_register_0=1)
        assert set(refusal.value.fields) == {"input_int_register_1", "external_force_torque"}
        assert robot.statistics.writes == 0
        await robot.write(
            "in", input_int_register_0=1, input_int_register_1=2, external_force_torque=[1, 2, 3, 4, 5, 6]
        )
        await robot.write("in", input_int_register_0=3, verify=True)
        assert simulator.controller.get("external_force_torque") == (1, 2, 3, 4, 5, 6)
        assert simulator.controller.get("input_int_register_1") == (2,)
        with pytest.raises(rtde.WriteRefusedError, match="cannot be verified"):
            await robot.write("in", input_int_register_1=3, verify=True)


async def test_what_is_held_is_known_without_read_back(
    connect: Connect, simulator: SimulatedController
) -> None:
    simulator.controller.set("input_int_register_1", (42,))
    async with connect(
        inputs={"in": ["input_int_register_0", "input_int_register_1"]}, read_back=False
    ) as robot:
        await robot.write("in", input_int_register_0=1)
        await robot.newer(5)
        await robot.newer(5)
        assert simulator.controller.get("input_int_register_1") == (42,)
        with pytest.raises(rtde.WriteRefusedError, match="is not among the outputs"):
            await robot.write("in", input_int_register_0=1, verify=True)


async def test_while_paused_only_whole_recipes_can_be_written(
    connect: Connect, simulator: SimulatedController
) -> None:
    async with connect(inputs={"in": ["input_int_register_0", "input_int_register_1"]}, start=False) as robot:
        with pytest.raises(rtde.WriteRefusedError, match="input_int_register_1: was not given"):
            await robot.write("in", input_int_register_0=1)
        with pytest.raises(rtde.WriteRefusedError, match="paused"):
            await robot.write("in", input_int_register_0=1, input_int_register_1=2, verify=True)
        await robot.write("in", input_int_register_0=1, input_int_register_1=2)
        await robot.resume()
        await robot.write("in", input_int_register_0=3, verify=True)
        assert simulator.controller.get("input_int_register_1") == (2,)


async def test_digital_outputs_switch_alone(connect: Connect, simulator: SimulatedController) -> None:
    async with connect(inputs=IO) as robot:
        await robot.set_standard_digital_outputs({0: True, 3: True}, verify=True)
        await robot.set_configurable_digital_outputs({7: True}, verify=True)
        await robot.set_tool_digital_outputs({1: True}, verify=True)
        await robot.set_standard_digital_outputs({0: False}, verify=True)
        assert simulator.controller.get("actual_digital_output_bits") == (1 << 3 | 1 << 15 | 1 << 17,)
        impossible: list[Any] = [{8: True}, {0: 1}, {}]
        for wrong in impossible:
            with pytest.raises(ValueError, match="output"):
                await robot.set_standard_digital_outputs(wrong)


async def test_the_speed_slider_is_not_set_to_zero_by_accident(
    connect: Connect, simulator: SimulatedController
) -> None:
    async with connect(inputs=IO) as robot:
        await robot.set_speed_slider(0.25, verify=True)
        with pytest.raises(ValueError, match="allow_zero=True"):
            await robot.set_speed_slider(0)
        await robot.set_standard_digital_outputs({1: True}, verify=True)
        assert simulator.controller.get("target_speed_fraction") == (0.25,)
        await robot.set_speed_slider(0, allow_zero=True, verify=True)
        with pytest.raises(ValueError, match="share from 0 to 1"):
            await robot.set_speed_slider(1.5)


async def test_analog_outputs_are_set_in_their_unit(connect: Connect, simulator: SimulatedController) -> None:
    async with connect(inputs=IO) as robot:
        await robot.set_analog_output(0, volts=5, verify=True)
        await robot.set_analog_output(1, milliamperes=4, verify=True)
        assert simulator.controller.get("standard_analog_output0") == (5.0,)
        assert simulator.controller.get("standard_analog_output1") == (4.0,)
        assert int(simulator.controller.get("analog_io_types")[0]) & 0b1100 == 0b0100
        wrong: list[tuple[int, dict[str, Any]]] = [
            (2, {"volts": 1}),
            (0, {}),
            (0, {"volts": 1, "milliamperes": 5}),
            (0, {"volts": 10.5}),
            (0, {"volts": True}),
            (0, {"milliamperes": 3}),
        ]
        for number, level in wrong:
            with pytest.raises(ValueError, match=r"volt|V|mA|output"):
                await robot.set_analog_output(number, **level)


async def test_bits_keep_their_neighbours(connect: Connect, simulator: SimulatedController) -> None:
    simulator.controller.set("input_bit_registers0_to_31", (0b1001,))
    inputs = {
        "a": ["input_bit_registers0_to_31"],
        "b": ["input_bit_registers32_to_63", "input_bit_register_70"],
    }
    async with connect(inputs=inputs) as robot:
        await robot.set_input_bits({0: False, 5: True, 33: True, 70: True}, verify=True)
        assert simulator.controller.get("input_bit_registers0_to_31") == (0b101000,)
        assert simulator.controller.get("input_bit_registers32_to_63") == (0b10,)
        assert simulator.controller.get("input_bit_register_70") == (True,)
        with pytest.raises(ValueError, match="bits are 0 to 127"):
            await robot.set_input_bits({128: True})
        with pytest.raises(ValueError, match="no input recipe has input_bit_register_71"):
            await robot.set_input_bits({71: True})


async def test_a_write_that_the_robot_does_not_show_is_an_error(
    connect: Connect, simulator: SimulatedController
) -> None:
    async with connect(inputs={"in": ["input_int_register_0"]}) as robot:
        simulator.controller.overwrite("input_int_register_0", (3,))
        with pytest.raises(rtde.NotVerifiedError, match="input_int_register_0 is 3, not 7") as error:
            await robot.write("in", input_int_register_0=7, verify=True, timeout=0.05)
        assert error.value.seen == {"input_int_register_0": (7, 3)}


async def test_what_was_not_claimed_is_not_written(connect: Connect) -> None:
    async with connect(inputs={"in": ["input_int_register_0"]}) as robot:
        with pytest.raises(rtde.WriteRefusedError, match="did you mean input_int_register_0"):
            await robot.write("in", input_int_registr_0=7)
        with pytest.raises(ValueError, match="no input recipe is called 'out'; there are: 'in'"):
            await robot.write("out", input_int_register_0=7)
        with pytest.raises(ValueError, match="no value to write"):
            await robot.write("in")
        with pytest.raises(ValueError, match="no input recipe has standard_digital_output_mask"):
            await robot.set_standard_digital_outputs({0: True})
        assert robot.statistics.writes == 0


async def test_nothing_can_be_written_once_it_is_closed(connect: Connect) -> None:
    async with connect(inputs={"in": ["input_int_register_0"]}) as robot:
        pass
    with pytest.raises(rtde.ConnectionLostError, match="not connected"):
        await robot.write("in", input_int_register_0=7)
