"""Masks: unmasked bits and values are garbage that changes nothing."""

from __future__ import annotations

import math

import pytest

from gatewayd.simulator.controller import Controller
from gatewayd.simulator.masks import effects
from gatewayd.simulator.store import FieldStore, Scalar


@pytest.fixture
def store() -> FieldStore:
    return Controller().store


def put(store: FieldStore, **values: Scalar) -> None:
    for name, value in values.items():
        store.write(name, (value,))
    for effect in effects(values):
        effect(store)


def test_only_masked_digital_outputs_change(store: FieldStore) -> None:
    put(store, standard_digital_output_mask=0b0110, standard_digital_output=0xFF)
    put(store, configurable_digital_output_mask=0b1000_0001, configurable_digital_output=0b1000_0000)
    put(store, tool_digital_output_mask=0b10, tool_digital_output=0xFF)
    assert store.read("actual_digital_output_bits") == (0b10_1000_0000_0000_0110,)
    assert store.read("actual_configurable_digital_output_bits") == (0b1000_0000,)
    put(store, standard_digital_output_mask=0b0100, standard_digital_output=0)
    assert store.read("actual_digital_output_bits") == (0b10_1000_0000_0000_0010,)


@pytest.mark.parametrize("fraction,shown", [(0.3, 0.3), (7.0, 1.0), (-1.0, 0.0), (math.nan, 1.0)])
def test_the_speed_slider_is_kept_between_0_and_1(store: FieldStore, fraction: float, shown: float) -> None:
    put(store, speed_slider_mask=1, speed_slider_fraction=fraction)
    assert store.read("target_speed_fraction") == (shown,)


def test_the_speed_slider_needs_its_mask(store: FieldStore) -> None:
    put(store, speed_slider_mask=0, speed_slider_fraction=0.1)
    assert store.read("target_speed_fraction") == (1.0,)


def test_an_analog_output_is_a_ratio_of_its_domain(store: FieldStore) -> None:
    put(
        store,
        standard_analog_output_mask=0b01,
        standard_analog_output_type=0b01,
        standard_analog_output_0=0.25,
        standard_analog_output_1=5e-324,
    )
    assert store.read("standard_analog_output0") == (2.5,)
    assert store.read("standard_analog_output1") == (4.0,)
    assert store.read("analog_io_types") == (0b0101,)
    put(
        store,
        standard_analog_output_mask=0b10,
        standard_analog_output_type=0,
        standard_analog_output_0=0.9,
        standard_analog_output_1=0.5,
    )
    assert (store.read("standard_analog_output0"), store.read("standard_analog_output1")) == ((2.5,), (12.0,))
