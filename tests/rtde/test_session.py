from __future__ import annotations

import pytest

from gatewayd.rtde.session import TOO_LONG, Wishes, input_hint, output_hint


def test_outputs_have_the_timestamp_first_and_everything_once() -> None:
    wishes = Wishes(
        ("robot_mode", "timestamp", "input_int_register_1", "robot_mode"),
        ("input_int_register_1", "input_int_register_2", "speed_slider_mask"),
        watchdog="input_int_register_3",
    )
    assert wishes.wanted_outputs() == ("timestamp", "robot_mode", "input_int_register_1")
    assert wishes.read_backs() == ("input_int_register_2", "input_int_register_3")
    assert wishes.wanted_inputs()[-1] == "input_int_register_3"


@pytest.mark.parametrize("read_back, words", [(True, "not verified"), (False, "map fewer")])
def test_the_hint_says_what_a_list_that_is_too_long_costs(read_back: bool, words: str) -> None:
    assert words in output_hint(TOO_LONG, read_back=read_back)


def test_hints_name_the_cause() -> None:
    assert "PROFINET" in input_hint("input_int_register_0", "IN_USE")
    assert "does not have" in input_hint("input_int_register_0", "NOT_FOUND")
    assert "ODD" in input_hint("input_int_register_0", "ODD")
    assert "ODD" in output_hint("ODD", read_back=False)
