"""What the outputs have to show once a write has arrived."""

from __future__ import annotations

import math

from gatewayd.rtde.api.completion import Elements
from gatewayd.rtde.api.sample import Sample, SampleLayout
from gatewayd.rtde.api.verification import DIGITAL_BITS, expectations, failed, shown_by
from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe, Scalar

NAMES = (
    "input_int_register_0",
    "input_double_register_0",
    DIGITAL_BITS,
    "target_speed_fraction",
    "standard_analog_output0",
)
LAYOUT = SampleLayout(Recipe(NAMES, [OUTPUTS[name].type for name in NAMES]), NAMES)


def seen(*flat: Scalar) -> Sample:
    return Sample(LAYOUT, flat, 0.0)


def check(given: dict[str, Elements], sample: Sample | None) -> set[str]:
    return set(failed(tuple(expectations(given)), sample))


def test_registers_are_the_same_bit_for_bit() -> None:
    given: dict[str, Elements] = {"input_int_register_0": (7,), "input_double_register_0": (math.nan,)}
    assert check(given, seen(7, math.nan, 0, 1.0, 0.0)) == set()
    assert check(given, seen(8, 0.0, 0, 1.0, 0.0)) == {"input_int_register_0", "input_double_register_0"}
    assert check(given, None) == {"input_int_register_0", "input_double_register_0"}


def test_of_digital_outputs_only_the_masked_ones_count() -> None:
    given: dict[str, Elements] = {
        "configurable_digital_output_mask": (0b11,),
        "configurable_digital_output": (0b01,),
    }
    assert check(given, seen(0, 0.0, 0x01FF | 0xF0000, 1.0, 0.0)) == set()
    assert check(given, seen(0, 0.0, 0x03FF, 1.0, 0.0)) == {DIGITAL_BITS}


def test_slider_and_analog_outputs_come_near() -> None:
    slider: dict[str, Elements] = {"speed_slider_mask": (1,), "speed_slider_fraction": (0.5,)}
    assert check(slider, seen(0, 0.0, 0, 0.501, 0.0)) == set()
    assert check(slider, seen(0, 0.0, 0, 0.6, 0.0)) == {"target_speed_fraction"}
    analog: dict[str, Elements] = {
        "standard_analog_output_mask": (1,),
        "standard_analog_output_type": (0,),
        "standard_analog_output_0": (0.5,),
    }
    assert check(analog, seen(0, 0.0, 0, 1.0, 12.05)) == set()
    assert check(analog, seen(0, 0.0, 0, 1.0, 5.0)) == {"standard_analog_output0"}


def test_what_cannot_be_seen_is_known() -> None:
    assert shown_by("external_force_torque") == ()
    assert shown_by("tool_digital_output") == (DIGITAL_BITS,)
    assert shown_by("input_bit_register_70") == ("input_bit_register_70",)
