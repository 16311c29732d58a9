from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from gatewayd.rtde.fields import INPUTS, OUTPUTS, REGISTERS, UNTYPED, Field, Series, SoftwareVersion
from gatewayd.rtde.types import DataType

GUIDE = Path(__file__).parent / "newer_guide.txt"
OLDER_GUIDE_KNOWS_BETTER = {"payload", "payload_cog", "tcp_offset"}
"""Fields for which the older guide, or a client library's issue, names another version."""
IN_NO_GUIDE = {
    "in": {"tool_digital_output_mask", "tool_digital_output"},
    "out": {
        "actual_qdd",
        "actual_moment",
        "control_step",
        "target_base_wrench",
    },
}


def rows() -> Iterator[tuple[str, str, str, list[str]]]:
    for line in GUIDE.read_text().splitlines():
        if not line.startswith("#"):
            side, name, word, *versions = line.split()
            yield side, name, word, versions


def expanded(name: str) -> list[str]:
    """All names of a row; only those with the row's version, which is stated for the upper ranges."""
    if not name.endswith("_X"):
        return [name]
    first, last = (64, 128) if "bit" in name else (24, 48)
    return [name[:-1] + str(number) for number in range(first, last)]


@pytest.mark.parametrize("side, name, word, versions", list(rows()))
def test_catalogue_agrees_with_the_newer_guide(side: str, name: str, word: str, versions: list[str]) -> None:
    table = INPUTS if side == "in" else OUTPUTS
    for one in expanded(name):
        field = table[one]
        assert field.type is DataType.from_word(word)
        if one in OLDER_GUIDE_KNOWS_BETTER:
            continue
        wanted = [SoftwareVersion.parse(version) for version in versions]
        assert field.first_version(Series.E) == (wanted[0] if wanted else None)
        assert field.first_version(Series.X) == (wanted[1] if len(wanted) > 1 else None)


@pytest.mark.parametrize("side, table", [("in", INPUTS), ("out", OUTPUTS)])
def test_catalogue_has_nothing_else_but_what_is_known_to_be_in_no_guide(
    side: str, table: dict[str, Field]
) -> None:
    families = tuple(family.prefix for family in REGISTERS)
    guide = {name for where, name, _, _ in rows() if where == side}
    rest = {name for name in table if not name.startswith(families)} - guide
    assert rest == IN_NO_GUIDE[side]


def test_every_input_register_is_read_back_with_the_same_type() -> None:
    for name, field in INPUTS.items():
        if name.startswith("input_"):
            assert OUTPUTS[name].type is field.type


def test_register_families_have_the_guides_numbers() -> None:
    assert {family.prefix: (family.numbers, family.fieldbus) for family in REGISTERS} == {
        f"{side}_{kind}_register_": ranges
        for side in ("input", "output")
        for kind, ranges in (
            ("bit", (range(64, 128), range(0))),
            ("int", (range(48), range(24))),
            ("double", (range(48), range(24))),
        )
    }


@pytest.mark.parametrize(
    "name, series, version, available",
    [
        ("output_int_register_24", Series.CB3, "3.8.0", False),
        ("output_int_register_24", Series.CB3, "3.9", True),
        ("output_int_register_24", Series.E, "5.2.9", False),
        ("output_int_register_24", Series.E, "5.3", True),
        ("output_int_register_24", Series.X, "10.0", True),
        ("output_int_register_23", Series.E, "5.0", True),
        ("payload", Series.CB3, "3.10", False),
        ("payload_inertia", Series.CB3, "3.15", True),
        ("time_scale_source", Series.CB3, "3.15", False),
        ("time_scale_source", Series.E, None, True),
        ("time_scale_source", Series.CB3, None, False),
        ("actual_qdd", Series.E, None, False),
        ("control_step", Series.X, "10.13", True),
        ("control_step", Series.X, "10.12", False),
        ("target_base_wrench", Series.X, "10.13", False),
        ("target_base_wrench", Series.X, "10.14", True),
        ("target_base_wrench", Series.E, "5.12", True),
    ],
)
def test_availability_by_series_and_version(
    name: str, series: Series, version: str | None, available: bool
) -> None:
    parsed = SoftwareVersion.parse(version) if version else None
    assert OUTPUTS[name].available(series, parsed) is available


@pytest.mark.parametrize(
    "text, version", [("5.12", (5, 12, 0)), ("5.12.3", (5, 12, 3)), ("10.7.0.1101", (10, 7, 0))]
)
def test_versions_are_read_with_two_to_four_numbers(text: str, version: tuple[int, int, int]) -> None:
    assert SoftwareVersion.parse(text) == version


@pytest.mark.parametrize("text", ["", "5", "5.", "5.x", "5.1.2.3.4", "-5.1", "5.\u0661"])
def test_anything_else_is_no_version(text: str) -> None:
    with pytest.raises(ValueError, match="is not a software version"):
        SoftwareVersion.parse(text)


def test_series_are_found_by_word_and_by_major_version() -> None:
    assert [Series.from_word(word) for word in ("cb3", "e", "x")] == list(Series)
    assert [Series.from_major(major) for major in (3, 5, 10, 7)] == [Series.CB3, Series.E, Series.X, None]
    assert [series.base_rate for series in Series] == [125, 500, 500]


def test_fields_without_a_known_type_are_not_in_the_catalogue() -> None:
    assert UNTYPED.isdisjoint({*INPUTS, *OUTPUTS})
