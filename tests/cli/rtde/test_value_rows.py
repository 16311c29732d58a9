from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.cli.rtde.value_rows import Value, as_json, lines, value_row
from gatewayd.rtde.fields import OUTPUTS


@pytest.mark.parametrize(
    "name, value, text, meaning",
    [
        ("runtime_state", 2, "2", "running"),
        ("runtime_state", 99, "99", "unknown"),
        ("joint_mode", (253, 253, 255, 253, 253, 253), "253  253  255  253  253  253", "running, idle"),
        ("actual_q", (0.5, -1.23456, 0.0), "0.5  -1.235  0", ""),
        ("actual_digital_input_bits", 0b1001, "9", "bits 0, 3"),
        ("actual_digital_output_bits", 0, "0", "no bit"),
        ("robot_status_bits", 3, "3", "power on, program running"),
        ("output_bit_register_64", True, "1", ""),
        ("new_field", 1.5, "1.5", ""),
    ],
)
def test_values_in_words(name: str, value: Value, text: str, meaning: str) -> None:
    row = value_row(name, value)
    assert (row.value, row.meaning) == (text, meaning)


def test_lines_have_their_values_below_one_another() -> None:
    found = lines([value_row("runtime_state", 1), value_row("timestamp", 2.5)])
    assert found == ["runtime_state  1  (stopped)", "timestamp      2.5  s"]
    assert lines([]) == []


@given(st.sampled_from(sorted(OUTPUTS)), st.integers(-(2**63), 2**64) | st.floats() | st.booleans())
def test_whatever_a_controller_sends_is_a_line_and_json(name: str, value: Value) -> None:
    (line,) = lines([value_row(name, value)])
    assert line.startswith(name)
    found = json.loads(json.dumps(as_json(value), allow_nan=False))
    assert found == value or (isinstance(value, float) and not math.isfinite(value) and found is None)
