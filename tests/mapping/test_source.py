"""The text of a mapping file as a tree with places."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.source import MAX_BYTES, Items, MappingText, RealNumber, Scalar, Table, parse
from tests.mapping.values import plain


def read(text: str) -> MappingText:
    return parse(text.encode(), "cell.yaml")


def found(source: MappingText) -> list[tuple[str, int, int]]:
    return [
        (finding.rule.slug, finding.position.line, finding.position.column) for finding in source.findings
    ]


def root(text: str) -> Table:
    source = read(text)
    assert source.root is not None
    assert source.findings == ()
    return source.root


def test_keys_and_values_know_their_place() -> None:
    """Positions count from 1 and point at the first character, in block and in flow style."""
    table = root("a:\n  b: {c: [1, x]}\n")
    inner = table.entries["a"].value
    assert isinstance(inner, Table)
    entry = inner.entries["b"]
    assert entry.key.position == Position("cell.yaml", 2, 3)
    assert isinstance(entry.value, Table)
    items = entry.value.entries["c"].value
    assert isinstance(items, Items)
    assert [(item.position.line, item.position.column) for item in items.items] == [(2, 11), (2, 14)]


def test_number_keeps_its_text() -> None:
    """`0.10` is bit 10 of register 0, so the text of a number outlives its value."""
    value = root("a: 0.10").entries["a"].value
    assert isinstance(value, Scalar)
    number = value.value
    assert isinstance(number, RealNumber)
    assert (number, number.text) == (0.1, "0.10")


@pytest.mark.parametrize(
    "text, value",
    [
        ("on", "on"),
        ("no", "no"),
        ("true", True),
        ("False", False),
        ("~", None),
        ("", None),
        ("010", 10),
        ("0x10", 16),
        ("0o17", 15),
        ("-7", -7),
        ("22:30", "22:30"),
        ("1_000", "1_000"),
        ("1e3", 1000.0),
        (".5", 0.5),
        ("'1'", "1"),
        ("0.0.0.0:502", "0.0.0.0:502"),
        ("output_int_register_0..23", "output_int_register_0..23"),
        ("100ms", "100ms"),
    ],
)
def test_scalars_follow_yaml_1_2(text: str, value: object) -> None:
    """The core schema of YAML 1.2: no `on`, no octal by a leading zero, no base 60."""
    assert plain(root(f"a: {text}")) == {"a": value}


@pytest.mark.parametrize(
    "text, slug, line, column",
    [
        ("", "empty-file", 1, 1),
        ("# only a comment\n", "empty-file", 1, 1),
        ("hello", "wrong-type", 1, 1),
        ("- 1", "wrong-type", 1, 1),
        ("a: 1\nb: 2\na: 3", "duplicate-key", 3, 1),
        ("a: &x 1", "anchor-or-alias", 1, 4),
        ("a: *x", "anchor-or-alias", 1, 4),
        ("<<: {a: 1}", "anchor-or-alias", 1, 1),
        ("a: !!int '3'", "yaml-tag", 1, 4),
        ("a: !custom 3", "yaml-tag", 1, 4),
        ("%YAML 1.1\n---\na: 1", "yaml-tag", 2, 1),
        ("a: 1\n---\nb: 2", "several-documents", 2, 1),
        ("? [a]\n: 1", "bad-name", 1, 3),
        ("a: [1,\nb: 2", "yaml-syntax", 2, 5),
        ("a: b: c", "yaml-syntax", 1, 5),
        ("a:\n\tb: 1", "yaml-syntax", 2, 1),
        ("a: 'open", "yaml-syntax", 1, 9),
        ("a: x\x07", "not-utf8", 1, 5),
        ("a: " + "[" * 40, "too-large", 1, 20),
    ],
)
def test_what_a_mapping_may_not_be_is_found_at_its_place(
    text: str, slug: str, line: int, column: int
) -> None:
    """One finding with rule, line and column for each thing that YAML has and a mapping has not."""
    source = read(text)
    assert (slug, line, column) in found(source), found(source)
    assert all(finding.message for finding in source.findings)


def test_duplicate_key_names_the_first() -> None:
    """The finding points back at the first of two equal keys, and the first one counts."""
    source = read("a: 1\nb: 2\na: 3")
    assert [place.position.line for place in source.findings[0].related] == [1]
    assert source.root is not None
    assert plain(source.root) == {"a": 1, "b": 2}


@pytest.mark.parametrize(
    "data, column", [(b"\xff\xfea\x00", 1), (b"a: \xe9", 4), ("a: é".encode() + b"\xc3", 5)]
)
def test_other_encodings_are_found(data: bytes, column: int) -> None:
    """What is not UTF-8 is named with its place."""
    source = parse(data, "f")
    assert found(source) == [("not-utf8", 1, column)]
    assert source.root is None


def test_what_windows_calls_unicode_is_named() -> None:
    (finding,) = parse("gatewayd: 1".encode("utf-16"), "cell.yaml").findings
    assert "UTF-16" in str(finding.hint)


@pytest.mark.parametrize(
    "line, hint",
    [
        ("a: {robot: actual_q[0]}", "put quotes"),
        ("a: {robot: x, owner: plc limits: [0, 1]}", "a comma or a closing bracket"),
        ("a: {robot: x} // parts", "a comment begins with #"),
        ("a: {robot: x} (* parts *)", "a comment begins with #"),
    ],
)
def test_a_slip_of_the_pen_has_its_own_hint(line: str, hint: str) -> None:
    (finding,) = parse(f"variables:\n  {line}\n  b: {{}}\n".encode(), "cell.yaml").findings
    assert hint in str(finding.hint)


def test_an_address_of_the_plc_is_no_value() -> None:
    (finding,) = parse(b"{modbus: %MW100}", "cell.yaml").findings
    assert "a number from 0" in str(finding.hint)


def test_byte_order_mark_is_no_character() -> None:
    """Editors on Windows begin UTF-8 files with one."""
    assert plain(root("\ufeffa: 1")) == {"a": 1}


def test_syntax_error_names_what_it_is_part_of() -> None:
    """A bracket that is never closed is found at the end, and the finding points back at it."""
    finding = read("a: {b: 1").findings[0]
    assert "the end of the file" in finding.message
    assert [(place.position.column, place.message) for place in finding.related] == [
        (4, "the table `{` begins here")
    ]


def test_huge_file_is_refused_unread() -> None:
    """More than a mebibyte is no mapping."""
    assert found(parse(b"#" * (MAX_BYTES + 1), "f")) == [("too-large", 1, 1)]


@given(st.binary(max_size=300))
def test_no_bytes_raise(data: bytes) -> None:
    """Whatever the bytes: a tree or findings."""
    source = parse(data, "f")
    assert source.root is not None or source.findings


@given(st.text(st.sampled_from("ab:- \n\t[]{},&*!%|>'\"#?0.1~<=\\"), max_size=60))
def test_no_yaml_like_text_raises(text: str) -> None:
    """Texts made of YAML's own signs reach the corners of the reader."""
    source = read(text)
    assert source.root is not None or source.findings
    if source.root is not None:
        plain(source.root)
