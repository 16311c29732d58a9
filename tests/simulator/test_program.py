"""The language of robot programs: what it means, and where mistakes are."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.simulator.program import DEMO, FieldReference, ProgramError, ProgramRule, RuleOperation, parse


def one(text: str) -> ProgramRule:
    (rule,) = parse(text)
    return rule


def name(reference: FieldReference | None) -> tuple[str, int | None] | None:
    return None if reference is None else (reference.field, reference.part)


def test_an_echo_with_scale_and_offset() -> None:
    rule = one("output_double_register_1 = input_int_register_0 * -2.5 - 1e3 # raw to mm")
    assert (rule.operation, name(rule.target)) == (RuleOperation.ECHO, ("output_double_register_1", None))
    assert (name(rule.input), rule.scale, rule.offset) == (("input_int_register_0", None), -2.5, -1000.0)
    assert not rule.plain


def test_a_plain_echo() -> None:
    assert one("output_int_register_0=input_int_register_0").plain


def test_delay_and_pulse() -> None:
    rule = one("output_bit_register_64 = not input_bit_register_64 after 200ms for 1.5s")
    assert (rule.operation, rule.after, rule.pulse) == (RuleOperation.NOT, 0.2, 1.5)


@pytest.mark.parametrize("word,operation", [("count", RuleOperation.COUNT), ("toggle", RuleOperation.TOGGLE)])
def test_edges_and_intervals(word: str, operation: RuleOperation) -> None:
    by_source = one(f"output_int_register_0 = {word} input_bit_register_64")
    by_time = one(f"output_int_register_0 = {word} every 20ms")
    assert (by_source.operation, name(by_source.input)) == (operation, ("input_bit_register_64", None))
    assert (by_time.operation, by_time.every, by_time.input) == (operation, 0.02, None)


def test_a_constant() -> None:
    rule = one("safety_status = 3")
    assert (rule.operation, rule.offset) == (RuleOperation.CONSTANT, 3.0)


def test_reserved_bits_are_bits_of_words() -> None:
    rule = one("output_bit_register_63 = input_bit_register_31")
    assert name(rule.target) == ("output_bit_registers32_to_63", 31)
    assert name(rule.input) == ("input_bit_registers0_to_31", 31)
    assert rule.target.of_bit


def test_elements_and_bits() -> None:
    rule = one("actual_digital_input_bits.17 = actual_TCP_pose[2]")
    assert rule.input is not None
    assert (name(rule.target), rule.target.of_bit) == (("actual_digital_input_bits", 17), True)
    assert (name(rule.input), rule.input.of_bit) == (("actual_TCP_pose", 2), False)


def test_a_range_is_a_rule_for_each_number() -> None:
    rules = parse("output_int_register_2..4 = input_int_register_7..9 + 1")
    assert [(name(rule.target), name(rule.input)) for rule in rules] == [
        ((f"output_int_register_{n}", None), (f"input_int_register_{n + 5}", None)) for n in (2, 3, 4)
    ]


def test_the_demo_is_a_program() -> None:
    assert len(parse(DEMO)) == 2 + 24 + 24


def test_lines_statements_and_comments() -> None:
    assert len(parse("# nothing\n\n a_0 = 1; a_1 = 2 # ; a_2 = 3\n;;\na_3 = 4\n")) == 3


@pytest.mark.parametrize(
    "text,line,column,message",
    [
        ("output_int_register_0", 1, 22, "expected '='"),
        ("\n  = 3", 2, 3, "expected a target, not '='"),
        ("a_0 =", 1, 6, "expected a source"),
        ("a_0 = 1; b = c *", 1, 17, "expected a number"),
        ("a_0 = b after 200", 1, 15, "expected a duration with its unit, as 200ms or 1.5s"),
        ("a_0 = b after 200 ms", 1, 15, "expected a duration with its unit, as 200ms or 1.5s"),
        ("a_0 = b c", 1, 9, "unexpected 'c'"),
        ("a_0 = b ? c", 1, 9, "unexpected '?'"),
        ("a_0 = not not b", 1, 11, "expected a source, not 'not'"),
        ("a_0..3 = b_0..2", 1, 10, "4 targets, but 3 sources"),
        ("a_3..0 = b_3..0", 1, 1, "'a_3..0' is not a range: write NAME_0..23, at most 128 numbers"),
        ("a_0 = 3s", 1, 7, "expected a number"),
    ],
)
def test_a_mistake_has_its_place(text: str, line: int, column: int, message: str) -> None:
    with pytest.raises(ProgramError) as caught:
        parse(text, "cell.prog")
    assert str(caught.value) == f"cell.prog:{line}:{column}: {message}"
    assert (caught.value.line, caught.value.column) == (line, column)


WORDS = "output_int_register_0 input_int_register_0..3 not count every after for = * + - 3 2ms 1e9 ; # a[1] b.2 a.. .."
PIECES = st.sampled_from([*WORDS.split(), "\n", "\t", "9" * 30])


@given(st.one_of(st.text(max_size=60), st.lists(PIECES, max_size=12).map(" ".join)))
def test_any_text_is_a_program_or_a_program_error(text: str) -> None:
    place = (1, 1)
    try:
        parse(text)
    except ProgramError as error:
        place = (error.line, error.column)
    lines = [*text.splitlines(), ""]
    assert 1 <= place[0] <= len(lines)
    assert 1 <= place[1] <= len(lines[place[0] - 1]) + 1
