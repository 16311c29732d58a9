"""Reading recipe files of either client, and hostile ones."""

from __future__ import annotations

import codecs
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.recipes.declared import DeclaredRecipe, RecipeFileError, RecipeProblem
from gatewayd.rtde.recipes.reading import MAX_BYTES, parse_recipes, read_recipes
from tests.rtde.recipes.samples import GUIDE


def test_the_guides_example_is_read_as_the_python_client_reads_it(tmp_path: Path) -> None:
    """Which takes keys, names and types out of the tree of the standard library."""
    path = tmp_path / "control_loop_configuration.xml"
    path.write_text(GUIDE)
    found = read_recipes(path)
    root = ET.fromstring(GUIDE)  # noqa: S314 - our own text
    assert {
        key: (list(recipe.names), [kind.word for kind in recipe.types.values()])
        for key, recipe in found.recipes.items()
    } == {
        recipe.get("key"): (
            [field.get("name") for field in recipe.findall("field")],
            [field.get("type") for field in recipe.findall("field")],
        )
        for recipe in root.findall("recipe")
    }
    assert found.recipe("in2").fields[0].line == 15
    assert found.recipe("in2").line == 14


@pytest.mark.parametrize("bom", [b"", codecs.BOM_UTF8])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_text_of_the_c_plus_plus_client(bom: bytes, end: str) -> None:
    found = parse_recipes(bom + f"timestamp{end}actual_q{end}{end}".encode(), "rtde_output_recipe.txt")
    recipe = found.recipe()
    assert recipe.key == "out"
    assert recipe.names == ("timestamp", "actual_q")
    assert [field.line for field in recipe.fields] == [1, 2]
    assert recipe.types == {}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1"])
def test_xml_in_the_encodings_of_editors(encoding: str) -> None:
    text = GUIDE.replace('version="1.0"', f'version="1.0" encoding="{encoding.removesuffix("-sig")}"')
    assert parse_recipes(text.encode(encoding), "x.xml").recipe("in1").names[0] == "input_int_register_0"


def test_content_decides_not_the_name() -> None:
    assert parse_recipes(b"\n  " + GUIDE.split("\n", 1)[1].encode(), "x.txt").recipe("in1").key == "in1"
    assert parse_recipes(b"timestamp\n", "x.xml").recipe().names == ("timestamp",)


@pytest.mark.parametrize("data", [b"", b"\n \r\n", codecs.BOM_UTF8, b"<rtde_config/>"])
def test_a_file_without_a_recipe(data: bytes) -> None:
    with pytest.raises(RecipeFileError) as error:
        parse_recipes(data, "x")
    assert str(error.value) == "x:1: there is no recipe in it; is it the right file?"


def test_a_key_that_is_taken() -> None:
    with pytest.raises(RecipeFileError) as error:
        parse_recipes(GUIDE.replace("in2", "in1").encode(), "x.xml")
    assert str(error.value) == "x.xml:14: the key 'in1' is taken, since line 10; choose another"


def test_too_much_is_refused_and_not_read(tmp_path: Path) -> None:
    path = tmp_path / "big.xml"
    path.write_bytes(b"<" + b" " * MAX_BYTES)
    with pytest.raises(RecipeFileError, match="more than 1024 KiB"):
        read_recipes(path)


def test_problems_come_in_the_order_of_their_lines() -> None:
    text = GUIDE.replace("in2", "in1").replace(
        '"speed_scaling" type="DOUBLE"', '"speed scaling" type="DOUBL"'
    )
    with pytest.raises(RecipeFileError) as error:
        parse_recipes(text.encode(), "x.xml")
    assert [problem.line for problem in error.value.problems] == [7, 7, 14]


_PIECES = st.sampled_from(
    [
        *(line.encode() for line in GUIDE.splitlines()),
        *(
            b"<recipe>",
            b"</recipe>",
            b"<field/>",
            b"<!--",
            b"-->",
            b"&lt;",
            b"&x;",
            b"<![CDATA[",
            b"]]>",
            b"\0",
            b"\xff",
        ),
        *(b'<!DOCTYPE a [<!ENTITY x "y">]>', b'<?xml version="1.0" encoding="utf-7"?>', b"timestamp", b"a,b"),
    ]
)


@given(st.one_of(st.binary(max_size=300), st.lists(_PIECES, max_size=30).map(b"\n".join)))
def test_any_bytes_are_read_or_refused_with_a_line(data: bytes) -> None:
    recipes, problems = outcome(data)
    lines = len(data.splitlines()) + 1
    assert all(1 <= problem.line <= lines and problem.text for problem in problems)
    assert bool(recipes) != bool(problems)
    for recipe in recipes:
        assert recipe.key
        assert recipe.names
        assert len(set(recipe.names)) == len(recipe.names)
        assert not any("," in name for name in recipe.names)


def outcome(data: bytes) -> tuple[list[DeclaredRecipe], tuple[RecipeProblem, ...]]:
    try:
        return list(parse_recipes(data, "x").recipes.values()), ()
    except RecipeFileError as error:
        return [], error.problems
