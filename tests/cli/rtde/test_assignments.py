from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.cli.rtde.assignments import AssignmentError, Assignments, parse_assignments
from gatewayd.rtde.companions import COMPANIONS
from gatewayd.rtde.fields import INPUTS


def test_each_thing_is_written_in_its_way() -> None:
    found = parse_assignments(
        [
            "input_int_register_24=-7",
            "input_double_register_3 = 0.5",
            "input_bit_registers32_to_63=0x1F",
            "external_force_torque=1,2,3, 4 5,6",
            "input_bit_register_5=on",
            "input_bit_register_70=FALSE",
            "standard_digital_output_3=1",
            "standard_digital_output_0=off",
            "tool_digital_output_1=on",
            "standard_analog_output_0=5V",
            "standard_analog_output_1=12.5 mA",
            "speed_slider=50%",
        ]
    )
    assert found == Assignments(
        registers={
            "input_int_register_24": -7,
            "input_double_register_3": 0.5,
            "input_bit_registers32_to_63": 31,
            "external_force_torque": (1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
        },
        bits={5: True, 70: False},
        pins={"standard": {3: True, 0: False}, "tool": {1: True}},
        slider=0.5,
        analog={0: (5.0, "V"), 1: (12.5, "mA")},
    )
    assert set(found.fields()) == {
        "input_int_register_24", "input_double_register_3", "input_bit_registers32_to_63", "external_force_torque",
        "input_bit_registers0_to_31", "input_bit_register_70", "standard_digital_output_mask",
        "standard_digital_output", "tool_digital_output_mask", "tool_digital_output", "standard_analog_output_mask",
        "standard_analog_output_type", "standard_analog_output_0", "standard_analog_output_1", "speed_slider_mask",
        "speed_slider_fraction",
    }  # fmt: skip


@pytest.mark.parametrize(
    "texts, words",
    [
        (["input_int_register_24"], "is not FIELD=VALUE"),
        (["=7"], "is not FIELD=VALUE"),
        (["input_int_register_24=7", "input_int_register_24=8"], "is there twice"),
        (["input_int_register_24=0.5"], "takes a whole number"),
        (["input_int_register_24=3000000000"], "INT32 and takes -2147483648 to 2147483647"),
        (["input_bit_registers0_to_31=-1"], "UINT32 and takes 0 to 4294967295"),
        (["input_double_register_0=nan"], "takes a finite number"),
        (["input_double_register_0=fast"], "takes a number"),
        (["input_bit_register_128=on"], "input bits are 0 to 127"),
        (["input_bit_register_64=2"], "takes on or off"),
        (["input_bit_register_3=on", "input_bit_registers0_to_31=5"], "as a word and by its bits"),
        (["standard_digital_output_8=on"], "of this kind there are 0 to 7"),
        (["tool_digital_output_2=on"], "of this kind there are 0 to 1"),
        (["standard_analog_output_0=0.5"], "an amount with its unit, say 5V or 12mA"),
        (["standard_analog_output_0=11V"], "takes 0 to 10 V"),
        (["standard_analog_output_0=3mA"], "takes 4 to 20 mA"),
        (["speed_slider=150%"], "takes 0 to 1, or 0% to 100%"),
        (["speed_slider=0.5", "speed_slider_fraction=0.4"], "the speed slider is there twice"),
        (["external_force_torque=1,2"], "VECTOR6D: 6 with commas between them"),
        (["actual_q=1"], "actual_q is no input of the robot"),
        (["input_int_registr_0=1"], "did you mean input_int_register_0"),
        (["standard_digital_output=8"], "write standard_digital_output_1=on"),
        (["configurable_digital_output_mask=8"], "write configurable_digital_output_1=on"),
        (["standard_analog_output_type=1"], "write standard_analog_output_0=5V or"),
        (["speed_slider_mask=1"], "write speed_slider=50%"),
    ],
)
def test_what_cannot_be_written_says_what_to_write(texts: list[str], words: str) -> None:
    with pytest.raises(AssignmentError) as refused:
        parse_assignments(texts)
    assert words in str(refused.value)


NAMES = st.sampled_from([*INPUTS, "standard_digital_output_3", "speed_slider", "input_bit_register_9", "x"])
VALUES = st.sampled_from(["0", "1", "on", "5V", "50%", "0x10", "-3", "1e400", "1,2,3,4,5,6", ""]) | st.text(
    max_size=9
)


@given(st.lists(st.builds("{}={}".format, NAMES, VALUES) | st.text(max_size=20), max_size=4))
def test_masks_are_never_written_without_their_values(texts: list[str]) -> None:
    """Whatever is typed is refused, or claims every mask together with what it selects."""
    with suppress(AssignmentError):
        found = parse_assignments(texts)
        fields = set(found.fields())
        assert fields <= INPUTS.keys()
        assert not {needs.mask for needs in COMPANIONS.values()} & found.registers.keys()
        for value, needs in COMPANIONS.items():
            assert value not in fields or {needs.mask, needs.type or needs.mask} <= fields
