from __future__ import annotations

import pytest

from gatewayd.rtde.catalogue import bit_word, is_fieldbus_range, likely_holders, suggest
from gatewayd.rtde.fields import INPUTS, OUTPUTS, SoftwareVersion


@pytest.mark.parametrize(
    "number, word, bit",
    [
        (0, "bit_registers0_to_31", 0),
        (31, "bit_registers0_to_31", 31),
        (32, "bit_registers32_to_63", 0),
        (63, "bit_registers32_to_63", 31),
    ],
)
@pytest.mark.parametrize("side", ["input", "output"])
def test_bits_below_64_lie_in_two_words(side: str, number: int, word: str, bit: int) -> None:
    name, place = bit_word(side, number)
    assert (name, place) == (f"{side}_{word}", bit)
    assert name in OUTPUTS


@pytest.mark.parametrize("number", [-1, 64, 127])
def test_other_bits_lie_in_no_word(number: int) -> None:
    with pytest.raises(ValueError, match="not in the words"):
        bit_word("input", number)


@pytest.mark.parametrize(
    "misspelt, meant",
    [
        ("actual_tcp_pose", "actual_TCP_pose"),
        ("ouput_int_register_7", "output_int_register_7"),
        ("standard_digital_ouput_mask", "standard_digital_output_mask"),
        ("runtime_stat", "runtime_state"),
    ],
)
def test_a_misspelt_name_is_recognised(misspelt: str, meant: str) -> None:
    assert suggest(misspelt)[0] == meant


def test_nonsense_brings_no_suggestion() -> None:
    assert suggest("qqqq") == ()


def test_suggestions_come_from_given_candidates() -> None:
    assert suggest("stat", ("start", "stop")) == ("start",)


@pytest.mark.parametrize(
    "field, words",
    [
        ("input_int_register_0", "PROFINET"),
        ("input_bit_registers32_to_63", "PROFINET"),
        ("input_int_register_19", "lower range (registers 18-23"),
        ("input_double_register_0", "PolyScope 5.23"),
        ("input_int_register_45", "upper range"),
        ("input_bit_register_80", "URCap"),
        ("speed_slider_mask", "EtherNet/IP"),
        ("external_force_torque", "force-torque"),
        ("no_such_field", "another RTDE client"),
    ],
)
def test_in_use_names_the_usual_suspects(field: str, words: str) -> None:
    assert words in likely_holders(field)


@pytest.mark.parametrize(
    "number, software, ranges",
    [
        (3, (5, 12), ""),
        (3, (5, 22, 9), ""),
        (3, (5, 23), "from 0 on"),
        (3, (10, 8), ""),
        (3, (10, 9), "from 0 on"),
        (3, (3, 15), ""),
        (3, (11, 0), ""),
        (3, None, "from 0 on"),
        (19, (5, 12), "lower range"),
        (19, (5, 23), "from 0 on"),
        (19, (10, 9), "from 0 on"),
        (19, (3, 15), "lower range"),
        (19, None, "lower range"),
    ],
)
def test_which_range_ur_rtde_has_depends_on_the_software(
    number: int, software: tuple[int, ...] | None, ranges: str
) -> None:
    found = likely_holders(
        f"input_double_register_{number}", SoftwareVersion(*software) if software else None
    )
    assert [text for text in ("from 0 on", "lower range") if text in found] == ([ranges] if ranges else [])


def test_upper_registers_are_not_blamed_on_the_fieldbus() -> None:
    assert "PROFINET" not in likely_holders("input_int_register_24")


def test_every_input_has_a_likely_holder() -> None:
    for name in INPUTS:
        assert likely_holders(name).endswith("another RTDE client")


def test_fieldbus_range_ends_with_23_and_bit_63() -> None:
    reserved = {name for name in INPUTS if is_fieldbus_range(name)}
    assert len(reserved) == 24 + 24 + 2
    assert "input_int_register_23" in reserved
    assert "input_double_register_24" not in reserved
