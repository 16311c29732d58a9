"""Whole packages from the values of some fields: nothing is sent that was not given or is known."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.api.completion import complete, elements
from gatewayd.rtde.api.errors import WriteRefusedError
from gatewayd.rtde.fields import INPUTS
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

IO = (
    "standard_digital_output_mask",
    "standard_digital_output",
    "speed_slider_mask",
    "speed_slider_fraction",
    "standard_analog_output_mask",
    "standard_analog_output_type",
    "standard_analog_output_0",
    "standard_analog_output_1",
)


def recipe(*names: str) -> Recipe:
    return Recipe(names, [INPUTS[name].type for name in names])


def unknown(_: str) -> None:
    return None


def test_what_is_not_given_keeps_what_it_holds() -> None:
    layout = recipe("input_int_register_0", "input_int_register_1")
    held = {"input_int_register_1": (42,)}
    assert complete("in", layout, {"input_int_register_0": (7,)}, held.get) == (7, 42)


def test_a_field_that_nobody_knows_has_to_be_given() -> None:
    layout = recipe("input_int_register_0", "input_int_register_1", "external_force_torque")
    with pytest.raises(WriteRefusedError) as refusal:
        complete("in", layout, {"input_int_register_0": (7,)}, unknown)
    assert set(refusal.value.fields) == {"input_int_register_1", "external_force_torque"}


def test_a_mask_that_is_not_given_selects_nothing() -> None:
    layout = recipe(*IO, "input_int_register_0")
    assert complete("io", layout, {"input_int_register_0": (3,)}, unknown) == (
        0,
        0,
        0,
        0.0,
        0,
        0,
        0.0,
        0.0,
        3,
    )


def test_what_a_mask_selects_has_to_be_given() -> None:
    with pytest.raises(
        WriteRefusedError, match="standard_digital_output: standard_digital_output_mask = 3 selects"
    ):
        complete("io", recipe(*IO), {"standard_digital_output_mask": (3,)}, unknown)
    with pytest.raises(WriteRefusedError) as refusal:
        complete("io", recipe(*IO), {"standard_analog_output_mask": (2,)}, unknown)
    assert set(refusal.value.fields) == {"standard_analog_output_type", "standard_analog_output_1"}


@pytest.mark.parametrize(
    "name", ["standard_digital_output", "speed_slider_fraction", "standard_analog_output_1"]
)
def test_a_value_without_its_mask_is_refused_as_it_does_nothing(name: str) -> None:
    with pytest.raises(WriteRefusedError, match="does nothing as"):
        complete("io", recipe(*IO), {name: (1,)}, unknown)


@given(st.data())
def test_no_value_comes_from_nowhere(data: st.DataObject) -> None:
    """Of registers: each element of the package was given or is known."""
    names = data.draw(
        st.lists(
            st.sampled_from([n for n in INPUTS if n.startswith("input_")]),
            min_size=1,
            max_size=8,
            unique=True,
        )
    )
    layout = recipe(*names)
    written = {name: (1,) for name in names if data.draw(st.booleans())}
    held = {name: (2,) for name in names if data.draw(st.booleans())}
    if all(name in written or name in held for name in names):
        assert complete("in", layout, written, held.get) == tuple(
            1 if name in written else 2 for name in names
        )
    else:
        with pytest.raises(WriteRefusedError):
            complete("in", layout, written, held.get)


@pytest.mark.parametrize(
    "name, value",
    [
        ("input_int_register_0", 2**31),
        ("input_int_register_0", 1.5),
        ("input_int_register_0", True),
        ("input_bit_register_64", 1),
        ("input_bit_registers0_to_31", -1),
        ("external_force_torque", [1.0]),
        ("external_force_torque", 1.0),
        ("input_double_register_0", "1"),
        ("speed_slider_fraction", 1.01),
        ("speed_slider_fraction", math.nan),
        ("external_force_torque", (math.nan,) * 6),
        ("external_force_torque", (0, 0, math.inf, 0, 0, 0)),
        ("input_double_register_0", None),
        ("input_double_register_0", 10**400),
        ("standard_analog_output_0", -0.1),
    ],
)
def test_a_value_that_its_type_does_not_have_is_refused(name: str, value: Any) -> None:
    with pytest.raises((TypeError, ValueError), match=name):
        elements(name, value, INPUTS[name].type)


@pytest.mark.parametrize("mask, most", [("speed_slider_mask", 1), ("standard_analog_output_mask", 3)])
def test_a_mask_has_no_bits_that_select_nothing(mask: str, most: int) -> None:
    kind = INPUTS[mask].type
    assert elements(mask, most, kind) == (most,)
    with pytest.raises(ValueError, match=f"{mask} has no bits but {most:#b}, and 7 sets others"):
        elements(mask, 7, kind)


def test_doubles_take_integers_and_what_is_no_number() -> None:
    assert elements("input_double_register_0", 1, DataType.DOUBLE) == (1.0,)
    assert math.isnan(elements("input_double_register_0", math.nan, DataType.DOUBLE)[0])
    assert elements("external_force_torque", range(6), DataType.VECTOR6D) == (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)
