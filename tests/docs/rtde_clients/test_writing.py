"""Inputs, by recipe and by helper, as the controller shows them afterwards."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd import rtde
from gatewayd.rtde import sync
from gatewayd.rtde.fields import INPUTS
from gatewayd.simulator.double import SimulatedRobot
from gatewayd.simulator.server import SimulatedController
from tests.docs.rtde_clients.conftest import Connect

IO = {"io": [name for name in INPUTS if not name.startswith(("input_", "external_"))]}


def family(prefix: str) -> list[str]:
    return [name for name in INPUTS if name.startswith(prefix)]


async def test_write_sends_a_package_of_one_recipe(connect: Connect, simulator: SimulatedController) -> None:
    """By keywords, or by a mapping of all values; whoever is not named keeps what it holds."""
    simulator.set("input_int_register_25", 42)
    inputs = {"a": ["input_int_register_24", "input_int_register_25"], "b": ["input_double_register_24"]}
    async with connect(inputs=inputs) as robot:
        await robot.write("a", input_int_register_24=7, verify=True)
        assert simulator.get("input_int_register_25") == 42
        await robot.write("a", {"input_int_register_24": 8, "input_int_register_25": 9}, verify=True)
        assert (simulator.get("input_int_register_24"), simulator.get("input_int_register_25")) == (8, 9)
        assert simulator.get("input_double_register_24") == 0.0, "the other recipe was not sent"
        assert robot.statistics.writes == 2


def test_write_without_asyncio(robot: SimulatedRobot) -> None:
    inputs = {"in": ["input_int_register_24"]}
    with sync.connect(robot.host, port=robot.port, inputs=inputs) as connected:
        connected.write("in", input_int_register_24=11, verify=True)
    assert robot.get("input_int_register_24") == 11


@pytest.mark.parametrize("kind, numbers", [("int", 48), ("double", 48), ("bit", 64)])
async def test_every_register_can_be_written(
    connect: Connect, simulator: SimulatedController, kind: str, numbers: int
) -> None:
    """Also 0 to 23, which the C++ client's helpers refuse; bits 64 to 127 by their own names."""
    names = family(f"input_{kind}_register_")
    assert len(names) == numbers
    values: dict[str, Any] = {
        name: number % 2 == 1 if kind == "bit" else number + 1 for number, name in enumerate(names)
    }
    async with connect(inputs={"in": names}) as robot:
        await robot.write("in", values, verify=True)
        assert {name: simulator.get(name) for name in names} == values


async def test_an_external_wrench_is_six_numbers(connect: Connect, simulator: SimulatedController) -> None:
    async with connect(inputs={"in": ["external_force_torque"]}) as robot:
        await robot.write("in", external_force_torque=[1, 2, 3, 0.1, 0.2, 0.3])
        while simulator.get("external_force_torque") == (0.0,) * 6:
            await robot.newer(5)
        assert simulator.get("external_force_torque") == (1, 2, 3, 0.1, 0.2, 0.3)
        with pytest.raises(ValueError, match="external_force_torque takes 6 values, 3 given"):
            await robot.write("in", external_force_torque=[1, 2, 3])


async def test_nothing_is_sent_that_nobody_gave(connect: Connect, simulator: SimulatedController) -> None:
    """No package of zeros: what is neither given nor known is refused by name, and what is known is kept."""
    simulator.set("input_double_register_24", 0.5)
    inputs = {"in": ["input_double_register_24", "external_force_torque"]}
    async with connect(inputs=inputs) as robot:
        await robot.newer(5)
        with pytest.raises(rtde.WriteRefusedError, match="external_force_torque: was not given"):
            await robot.write("in", input_double_register_24=1.0)
        assert robot.statistics.writes == 0
        assert simulator.get("input_double_register_24") == 0.5
        assert robot.known("in") == {"input_double_register_24": 0.5}
        await robot.write("in", external_force_torque=[0] * 6)
        assert robot.known("in") == {"input_double_register_24": 0.5, "external_force_torque": (0.0,) * 6}


async def test_what_is_missing_is_named(connect: Connect) -> None:
    """Of a helper the fields that no recipe has, of a write those that were not claimed."""
    async with connect(inputs={"in": ["input_int_register_24"]}) as robot:
        with pytest.raises(
            ValueError, match="no input recipe has speed_slider_mask and speed_slider_fraction"
        ):
            await robot.set_speed_slider(0.5)
        with pytest.raises(rtde.WriteRefusedError) as refusal:
            await robot.write("in", input_int_register_25=1)
        assert set(refusal.value.fields) == {"input_int_register_25"}
        assert refusal.value.recipe == "in"


@pytest.mark.parametrize("kind, pins, first", [("standard", 8, 0), ("configurable", 8, 8), ("tool", 2, 16)])
async def test_digital_outputs_switch_alone(
    connect: Connect, simulator: SimulatedController, kind: str, pins: int, first: int
) -> None:
    """`set_standard_digital_outputs`, `set_configurable_digital_outputs`, `set_tool_digital_outputs`."""
    simulator.set("actual_digital_output_bits", (1 << 18) - 1)
    async with connect(inputs=IO) as robot:
        switch = getattr(robot, f"set_{kind}_digital_outputs")
        await switch({pins - 1: False}, verify=True)
        assert simulator.get("actual_digital_output_bits") == (1 << 18) - 1 - (1 << first + pins - 1)
        await switch({pins - 1: True, 0: False}, verify=True)
        assert simulator.get("actual_digital_output_bits") == (1 << 18) - 1 - (1 << first)
        with pytest.raises(ValueError, match=f"{kind} digital output {pins}: True: pins are 0 to {pins - 1}"):
            await switch({pins: True})


@pytest.mark.parametrize("unit, domain", [("volts", 1), ("milliamperes", 0)])
@pytest.mark.parametrize("number", [0, 1])
async def test_an_analog_output_is_set_in_its_unit(
    connect: Connect, simulator: SimulatedController, number: int, unit: str, domain: int
) -> None:
    """`volts=` and `milliamperes=` select the domain too; the other output stays as it is."""
    async with connect(inputs=IO) as robot:
        other = simulator.get(f"standard_analog_output{1 - number}")
        level: dict[str, Any] = {unit: 7.5}
        await robot.set_analog_output(number, **level, verify=True)
        assert simulator.get(f"standard_analog_output{number}") == pytest.approx(7.5)
        types = simulator.get("analog_io_types")
        assert isinstance(types, int)
        assert types >> (2 + number) & 1 == domain
        assert simulator.get(f"standard_analog_output{1 - number}") == other


async def test_the_speed_slider_takes_a_fraction(connect: Connect, simulator: SimulatedController) -> None:
    async with connect(inputs=IO) as robot:
        await robot.set_speed_slider(0.25, verify=True)
        assert simulator.get("target_speed_fraction") == 0.25
        with pytest.raises(ValueError, match="allow_zero=True"):
            await robot.set_speed_slider(0)
        with pytest.raises(ValueError, match="share from 0 to 1"):
            await robot.set_speed_slider(1.5)


@pytest.mark.parametrize("number", [0, 31, 32, 63, 64, 127])
async def test_an_input_bit_is_set_by_its_number(
    connect: Connect, simulator: SimulatedController, number: int
) -> None:
    """All of 0 to 127; those of a word keep their neighbours."""
    words = ["input_bit_registers0_to_31", "input_bit_registers32_to_63"]
    for word in words:
        simulator.set(word, 1 << 5)
    async with connect(inputs={"words": words, "bits": family("input_bit_register_")}) as robot:
        await robot.set_input_bits({number: True}, verify=True)
        found = [simulator.get(word) for word in words]
        found += [simulator.get(f"input_bit_register_{number}")] if number > 63 else []
        expected: list[Any] = [1 << 5, 1 << 5]
        if number < 64:
            expected[number // 32] |= 1 << number % 32
        else:
            expected.append(True)
        assert found == expected
        with pytest.raises(ValueError, match="bits are 0 to 127"):
            await robot.set_input_bits({128: True})
