"""What `check` says of usual slips: the right line, the right sign, a remedy that can be typed."""

from __future__ import annotations

import pytest

from gatewayd.mapping.loader import load
from gatewayd.mapping.slips import lookalike, slip_in

MAPPING = """gatewayd: 1
cell: press
robot:
  host: 127.0.0.1
  series: e
modbus:
  listen: 127.0.0.1:1503
canopen:
  channel: can0
  node: 5
  bitrate: 250000
writers:
  plc: {modbus: 127.0.0.1, timeout: 1s}
  hmi: {modbus: 127.0.0.2, timeout: 1s}
variables:
  start: {robot: input_bit_register_0, modbus: 0.0, owner: [plc, hmi], lease: 5s}
  speed:
    robot: input_double_register_0
    modbus: {holding: 20, type: float32}
    owner: [plc, hmi]
  done: {robot: output_bit_register_0, modbus: 100.0}
"""


def findings(before: str, after: str) -> list[tuple[str, int, str, str]]:
    """Rule, line, message and hint of what `check` finds once `before` is replaced."""
    assert before in MAPPING
    found = load(MAPPING.replace(before, after).encode(), "cell.yaml").diagnostics
    return [(item.rule.id, item.position.line, item.message, item.hint or "") for item in found]


def test_the_mapping_itself_is_right() -> None:
    assert findings("cell: press", "cell: press") == []


@pytest.mark.parametrize(
    "slip, rule, line, message, hint",
    [
        (("  series: e", "   series: e"), "GW101", 5, "`series` is indented deeper than `host`", "2 spaces"),
        (("  host: 127.0.0.1\n", "host: 127.0.0.1\n"), "GW101", 5, "`series`", "2 spaces: they belong to `robot`"),
        (("  host: 127", "  host:127"), "GW101", 4, "`host:127.0.0.1` has no space", "write `host: 127.0.0.1`"),
        (("  node: 5", "  node:5"), "GW101", 10, "`node:5` has no space after the colon", "write `node: 5`"),
        (("series: e", "series:\u00a0e"), "GW101", 5, "a no-break space (U+00A0) stands", "retype the line"),
        (("  series", "\u00a0 series"), "GW101", 5, "a no-break space (U+00A0) stands", "retype the line"),
        (("  series", " \u00a0series"), "GW101", 5, "a no-break space (U+00A0) stands", "retype the line"),
        (("  speed", "\u00a0\u00a0speed"), "GW101", 17, "a no-break space (U+00A0) stands", "retype the line"),
        (("  speed:", "  spe\u200bed:"), "GW113", 17, "is not a name", "a zero width space (U+200B) in it"),
        (("[plc, hmi]\n", "plc, hmi\n"), "GW110", 20, "`plc, hmi` is not a list", "brackets: [plc, hmi]"),
        (("[plc, hmi],", "plc, hmi,"), "GW110", 16, "`hmi` has no value", "brackets: `owner: [plc, hmi]`"),
        (("bitrate: 250000", "bitrate: 250k"), "GW110", 11, "`250k`", "write 250000, without the unit"),
        (("bitrate: 250000", "bitrate: 250 kbit/s"), "GW110", 11, "`250 kbit/s`", "write 250000, without"),
        (("bitrate: 250000", "bitrate: 10kg"), "GW110", 11, "`10kg`", "write 10, without the unit"),
        (("type: float32", "type: float"), "GW114", 19, "`type` is `float`", "write float32"),
        (("type: float32", "type: double"), "GW114", 19, "`type` is `double`", "write float64"),
        (("series: e", "series: UR10e"), "GW114", 5, "`series` is `UR10e`", "write e for UR10e"),
        (("series: e", "series: UR10"), "GW114", 5, "`series` is `UR10`", "write cb3"),
        (("host: 127.0.0.1", "host: http://127.0.0.9/x"), "GW118", 4, "`http://", "write 127.0.0.9"),
        (("  speed:", "  tool speed:"), "GW113", 17, "`tool speed` is not a name", "write tool_speed"),
        (("[plc, hmi],", "[\u201cplc\u201d, hmi],"), "GW113", 16, "not a name", "not a quotation mark in YAML"),
        (("writers:", "wirters:"), "GW108", 12, "the file has no key `wirters`", "did you mean `writers`?"),
        (("variables:", "variabels:"), "GW108", 15, "no key `variabels`", "did you mean `variables`?"),
        (("robot:\n", "robott:\n"), "GW108", 3, "no key `robott`", "did you mean `robot`?"),
    ],
)  # fmt: skip
def test_a_slip_is_one_finding(slip: tuple[str, str], rule: str, line: int, message: str, hint: str) -> None:
    (found,) = findings(*slip)
    assert found[:2] == (rule, line)
    assert message in found[2]
    assert hint in found[3]


def test_a_no_break_space_in_a_text_or_comment_is_nobodys_business() -> None:
    text = "comment: 5\u00a0mm, robot: output_bit_register_0"
    assert findings("robot: output_bit_register_0", text) == []
    assert findings("  host: 127.0.0.1", "  # 5\u00a0mm\n  host: 127.0.0.1") == []


@pytest.mark.parametrize(
    "text, hint",
    [
        ("\u22125", "`\u2212` is a minus sign (U+2212): write an ordinary minus, -"),
        ("a\uff1ab", "is a fullwidth colon (U+FF1A)"),
        ("plain: [text] 'here'", ""),
    ],
)
def test_characters_that_look_like_others(text: str, hint: str) -> None:
    assert hint in lookalike(text)
    assert bool(hint) == bool(lookalike(text))


def test_lines_that_are_not_there_have_no_slip() -> None:
    assert slip_in([], 1, 3) is None
    assert slip_in(["a: 1"], 0, 9) is None
