from __future__ import annotations

import pytest

from gatewayd.rtde.catalogue import INPUTS
from gatewayd.rtde.claims import recipe_key
from gatewayd.rtde.companions import COMPANIONS, Companions, companions, masked_by


def test_every_mask_and_type_of_the_catalogue_is_a_companion_and_shares_the_recipe() -> None:
    named = {name for name in INPUTS if name.endswith(("_mask", "_type"))}
    used = {name for needs in COMPANIONS.values() for name in (needs.mask, needs.type) if name is not None}
    assert used == named
    for field, needs in COMPANIONS.items():
        assert field in INPUTS
        assert {recipe_key(name) for name in (field, needs.mask, needs.type) if name} == {recipe_key(field)}


def test_what_acts_by_itself_has_none() -> None:
    acting = {name for name in INPUTS if companions(name) is None}
    assert acting == {name for name in INPUTS if name.startswith(("input_", "external_"))} | {
        name for name in INPUTS if name.endswith(("_mask", "_type"))
    }


@pytest.mark.parametrize(
    "field, bit, mask_bit",
    [
        ("speed_slider_fraction", None, 0),
        ("standard_digital_output", 3, 3),
        ("tool_digital_output", 1, 1),
        ("standard_analog_output_1", None, 1),
    ],
)
def test_the_bit_of_the_mask(field: str, bit: int | None, mask_bit: int) -> None:
    needs = companions(field)
    assert needs is not None
    assert needs.bit_of(bit) == mask_bit


def test_a_whole_word_of_digital_outputs_has_no_single_mask_bit() -> None:
    with pytest.raises(ValueError, match="masks single bits"):
        Companions("standard_digital_output_mask").bit_of(None)


def test_masks_know_what_they_mask() -> None:
    assert masked_by("standard_analog_output_mask") == (
        "standard_analog_output_0",
        "standard_analog_output_1",
    )
    assert masked_by("standard_analog_output_type") == ()
