"""Every field that the .NET client has by a name of its own: read, or written, by its name of the guide.

One robot reads all outputs at once, from a controller that holds something else in each; another one writes all
inputs. Each test compares its own field.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Mapping
from typing import Any

import pytest

from gatewayd import rtde
from gatewayd.rtde.fields import INPUTS, OUTPUTS, Field
from gatewayd.rtde.types import DataType
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.server import SimulatedController
from tests.docs.rtde_clients.conftest import PATIENCE
from tests.docs.rtde_clients.rows import Row, rows

Flat = Mapping[str, tuple[Any, ...]]
"""The elements of each field."""


def field_rows(group: str) -> list[Row]:
    return [row for row in rows() if row.client == "dotnet" and row.group == group]


def members(name: str, known: Mapping[str, Field]) -> list[str]:
    """The field, or all registers of `..._register_X`."""
    prefix = name.removesuffix("X")
    return [name] if name in known else [each for each in known if re.fullmatch(rf"{prefix}\d+", each)]


def elements(number: int, kind: DataType) -> tuple[Any, ...]:
    """Something that no other field of this type holds, as far as the type goes."""
    if kind is DataType.BOOL:
        return (number % 3 == 0,)
    if kind.code == "d":
        return tuple(number + place / 8 for place in range(kind.count))
    return tuple((number + 7 * place) % 256 for place in range(kind.count))


def held(known: Mapping[str, Field]) -> Flat:
    return {name: elements(number, known[name].type) for number, name in enumerate(known)}


@pytest.fixture(scope="module")
def read() -> Flat:
    """What a robot has read of a controller whose time stands still, beside the timestamp of that controller."""

    async def visit() -> Flat:
        controller = Controller()
        controller.faults.freeze = True
        for name, values in held(OUTPUTS).items():
            if name not in ("timestamp", "control_step"):
                controller.overwrite(name, values)
        names = [name for name in OUTPUTS if controller.output_type(name)]
        async with (
            SimulatedController(controller) as served,
            rtde.connect("127.0.0.1", port=served.port, outputs=names) as robot,
        ):
            sample = await robot.newer(PATIENCE)
            found = {name: sample[name] for name in sample.names}
            return {name: value if isinstance(value, tuple) else (value,) for name, value in found.items()}

    return asyncio.run(visit())


@pytest.mark.parametrize("name", [row.ours.strip("`") for row in field_rows("Outputs")])
def test_an_output_is_read(name: str, read: Flat) -> None:
    expected = {**held(OUTPUTS), "timestamp": (100.0,)}
    expected["target_q"] = expected["actual_q"]  # an arm that stands is where it should be
    fields = members(name, OUTPUTS)
    assert fields
    assert {field: read[field] for field in fields} == {field: expected[field] for field in fields}


@pytest.fixture(scope="module")
def written() -> Flat:
    """What a controller holds after a robot has written every input: registers in one recipe, the rest in another."""

    async def visit() -> Flat:
        registers = [name for name in INPUTS if name.startswith("input_")]
        recipes = {"registers": registers, "io": [name for name in INPUTS if name not in registers]}
        async with (
            SimulatedController(Controller()) as served,
            rtde.connect("127.0.0.1", port=served.port, inputs=recipes) as robot,
        ):
            for recipe, names in recipes.items():
                await robot.write(recipe, {name: flat(value(name)) for name in names})
            await robot.write(
                "registers", input_int_register_0=flat(value("input_int_register_0")), verify=True
            )
            return {name: served.controller.get(name) for name in INPUTS}

    return asyncio.run(visit())


MEANT = {
    "speed_slider_mask": (1,),
    "speed_slider_fraction": (0.25,),
    "standard_analog_output_mask": (0b11,),
    "standard_analog_output_type": (0b10,),
    "standard_analog_output_0": (0.5,),
    "standard_analog_output_1": (0.75,),
    "tool_digital_output_mask": (0b11,),
    "tool_digital_output": (0b10,),
}
"""What is written where not every number of the type makes sense."""


def value(name: str) -> tuple[Any, ...]:
    return MEANT.get(name) or held(INPUTS)[name]


def flat(values: tuple[Any, ...]) -> Any:
    return values[0] if len(values) == 1 else values


@pytest.mark.parametrize("name", [row.ours.strip("`") for row in field_rows("Inputs")])
def test_an_input_is_written(name: str, written: Flat) -> None:
    fields = members(name, INPUTS)
    assert fields
    assert {field: written[field] for field in fields} == {field: value(field) for field in fields}


@pytest.mark.parametrize("group, known", [("Outputs", OUTPUTS), ("Inputs", INPUTS)])
def test_registers_are_all_there(group: str, known: Mapping[str, Field]) -> None:
    """Ints and doubles from 0 to 47, bits from 64 to 127, as the client has them."""
    counts = {
        name: len(members(name, known))
        for row in field_rows(group)
        if (name := row.ours.strip("`"))[-2:] == "_X"
    }
    sizes = {"int": 48, "double": 48, "bit": 64}
    assert counts
    assert counts == {name: sizes[name.split("_")[1]] for name in counts}


SPELLED = {"deg C": "°C", "kg m^2": "kg·m²", "ms by the guide": "ms"}
"""Units of the .NET client's pages as the catalogue has them."""


def test_units_are_those_of_the_catalogue() -> None:
    """As far as both name one: the catalogue has no unit where the guides have none."""
    stated = {
        row.ours.strip("`"): SPELLED.get(found[1], found[1])
        for row in field_rows("Outputs")
        if (found := re.search(r"\[(.*)\]", row.what))
    }
    ours = {name: OUTPUTS[name].unit for name in stated}
    assert len(list(filter(None, ours.values()))) > 20
    assert {name: unit for name, unit in ours.items() if unit} == {n: u for n, u in stated.items() if ours[n]}
