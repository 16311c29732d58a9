"""What of recipes a mapping carries, and that it passes the check whatever the recipe."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.cli.importing.recipe import ImportSettings, imported, is_input_recipe, mapping_text
from gatewayd.mapping.diagnostics import Severity
from gatewayd.mapping.loader import load
from gatewayd.rtde.fields import INPUTS, OUTPUTS, Field
from gatewayd.rtde.recipes import DeclaredField, DeclaredRecipe, parse_recipes, xml_text

SETTINGS = ImportSettings("cell", "127.0.0.9", "127.0.0.1:1502", writer="127.0.0.1")


def recipe(key: str, *names: str, typed: bool = True) -> DeclaredRecipe:
    sides = {**INPUTS, **OUTPUTS}
    fields = [
        DeclaredField(name, sides[name].type if typed and name in sides else None, 2 + place)
        for place, name in enumerate(names)
    ]
    return DeclaredRecipe(key, tuple(fields), 1, "x")


@pytest.mark.parametrize(
    "key, names, typed, expected",
    [
        ("out", ["timestamp", "input_int_register_0"], True, False),
        ("out", ["input_int_register_0"], True, False),
        ("out", ["input_int_register_0"], False, True),
        ("setp", ["input_int_register_0"], True, True),
        ("out", ["speed_slider_mask", "input_int_register_0"], True, True),
        ("in", ["actual_q"], True, False),
        ("in", ["brand_new"], True, False),
        ("in", ["brand_new", "input_int_register_0"], True, True),
    ],
)
def test_fields_tell_which_way_a_recipe_goes_and_the_key_where_they_cannot(
    key: str, names: list[str], typed: bool, expected: bool
) -> None:
    assert is_input_recipe(recipe(key, *names, typed=typed)) == expected


@pytest.mark.parametrize(
    "recipes, expected",
    [
        (
            [recipe("out", "timestamp", "input_int_register_0")],
            "x:3: error: input_int_register_0 is read back by the recipe 'out', but no recipe writes it; a mapping ",
        ),
        (
            [recipe("out", "timestamp", "speed_slider_mask")],
            "x:3: error: speed_slider_mask is an input among outputs, which no controller sends; put it into ",
        ),
        (
            [recipe("out", "timestamp", "brand_new")],
            "x:3: error: brand_new is in no guide, and its type is not declared; strike it, or import it from an XML ",
        ),
        (
            [recipe("in", "input_int_register_0", "brand_new")],
            "x:3: error: brand_new is no input of the guides; a mapping cannot write it: strike it",
        ),
    ],
)
def test_what_cannot_be_carried_has_its_line_and_a_remedy(
    recipes: list[DeclaredRecipe], expected: str
) -> None:
    fields, findings = imported(recipes)
    (finding,) = map(str, findings)
    assert finding.startswith(expected)
    assert len(fields) == 1


def test_an_input_without_the_mask_that_makes_it_act_is_left_out() -> None:
    fields, findings = imported([recipe("in", "input_int_register_0", "speed_slider_fraction")])
    assert [field.name for field in fields] == ["input_int_register_0"]
    assert str(findings[0]).startswith(
        "x:3: error: speed_slider_fraction has no effect without speed_slider_mask, which "
    )
    assert imported([recipe("in", "speed_slider_mask", "speed_slider_fraction")])[1] == ()


def test_an_input_that_is_read_back_as_well_is_one_variable() -> None:
    fields, findings = imported(
        [recipe("out", "timestamp", "input_int_register_0"), recipe("in", "input_int_register_0")]
    )
    assert [(field.name, field.is_input) for field in fields] == [
        ("input_int_register_0", True),
        ("timestamp", False),
    ]
    assert findings == ()


def test_a_type_other_than_the_guides_is_noted() -> None:
    text = '<a><recipe key="out">\n<field name="robot_mode" type="UINT32"/></recipe></a>'
    fields, findings = imported(list(parse_recipes(text.encode(), "x").recipes.values()))
    assert [str(finding) for finding in findings] == [
        "x:2: note: robot_mode is declared as UINT32; the mapping takes INT32, as the guides"
    ]
    assert fields[0].type.word == "INT32"


def test_a_field_of_no_guide_is_carried_with_its_declared_type() -> None:
    text = '<a><recipe key="out"><field name="brand_new" type="VECTOR6D"/></recipe></a>'
    fields, _ = imported(list(parse_recipes(text.encode(), "x").recipes.values()))
    written = mapping_text(fields, SETTINGS, "x")
    assert "brand_new: {robot: {field: brand_new, type: VECTOR6D}, modbus: 1000}" in written
    assert _errors(written) == []


def test_registers_follow_each_other_and_reals_may_take_two() -> None:
    fields, _ = imported([recipe("out", "timestamp", "actual_q", "robot_mode", "tool_output_mode")])
    exact, single = (mapping_text(fields, settings, "x") for settings in (SETTINGS, _single()))
    assert re.findall(r", modbus: (\d+)", exact) == ["1000", "1004", "1028", "1030"]
    assert "modbus: {holding: 1002, type: float32}" in single
    assert _errors(single) == []


def _single() -> ImportSettings:
    return ImportSettings("cell", "127.0.0.9", "127.0.0.1:1502", writer="127.0.0.1", single=True)


def _errors(text: str) -> list[str]:
    return [str(found) for found in load(text.encode(), "x").diagnostics if found.severity is Severity.ERROR]


def test_all_inputs_and_all_outputs_together_pass_the_check() -> None:
    text = xml_text([recipe("in", *INPUTS), recipe("out", *OUTPUTS)])
    fields, findings = imported(list(parse_recipes(text.encode(), "x").recipes.values()))
    assert len(fields) == len(INPUTS) + len([name for name in OUTPUTS if name not in INPUTS])
    assert findings == ()
    assert _errors(mapping_text(fields, SETTINGS, "x")) == []


_FIELDS = st.lists(
    st.sampled_from([*INPUTS.values(), *OUTPUTS.values()]),
    min_size=1,
    max_size=8,
    unique_by=lambda field: field.name,
)


@given(st.lists(_FIELDS, min_size=1, max_size=3), st.booleans())
def test_whatever_is_carried_passes_the_check(drawn: list[list[Field]], single: bool) -> None:
    recipes = [recipe(f"r{place}", *(field.name for field in fields)) for place, fields in enumerate(drawn)]
    fields, findings = imported(recipes)
    assert {field.name for field in fields} <= {name for each in recipes for name in each.names}
    assert bool(fields) or all(finding.is_error for finding in findings)
    if fields:
        assert _errors(mapping_text(fields, _single() if single else SETTINGS, "x")) == []


@pytest.mark.parametrize("host", ["192.0.2.10", "robot.local", "fe80::1%eth0", "::1"])
def test_hosts_are_written_as_yaml_takes_them(host: str) -> None:
    fields, _ = imported([recipe("out", "timestamp")])
    loaded = load(mapping_text(fields, ImportSettings("1e3", host, "[::1]:1502"), 'a"b').encode(), "x")
    assert loaded.plan is not None
    assert loaded.plan.cell.name == "1e3"
