from __future__ import annotations

import pytest

from gatewayd.rtde.claims import recipe_key
from gatewayd.rtde.companions import COMPANIONS, MASK_BITS
from gatewayd.rtde.fields import INPUTS


def test_every_mask_and_type_of_the_catalogue_is_a_companion_and_shares_the_recipe() -> None:
    named = {name for name in INPUTS if name.endswith(("_mask", "_type"))}
    used = {name for needs in COMPANIONS.values() for name in (needs.mask, needs.type) if name is not None}
    assert used == named
    for field, needs in COMPANIONS.items():
        assert field in INPUTS
        assert {recipe_key(name) for name in (field, needs.mask, needs.type) if name} == {recipe_key(field)}


def test_what_acts_by_itself_has_none() -> None:
    acting = {name for name in INPUTS if name not in COMPANIONS}
    assert acting == {name for name in INPUTS if name.startswith(("input_", "external_"))} | {
        name for name in INPUTS if name.endswith(("_mask", "_type"))
    }


@pytest.mark.parametrize(
    "field, mask_bit",
    [
        ("speed_slider_fraction", 0),
        ("standard_digital_output", None),
        ("tool_digital_output", None),
        ("standard_analog_output_1", 1),
    ],
)
def test_the_bit_of_the_mask(field: str, mask_bit: int | None) -> None:
    assert COMPANIONS[field].bit == mask_bit


def test_the_analog_outputs_share_a_mask() -> None:
    masked = [field for field, needs in COMPANIONS.items() if needs.mask == "standard_analog_output_mask"]
    assert masked == ["standard_analog_output_0", "standard_analog_output_1"]


def test_the_bits_that_select_whole_values() -> None:
    assert dict(MASK_BITS) == {"speed_slider_mask": 0b1, "standard_analog_output_mask": 0b11}
