"""Recordings and recipe files, as the Python client's writers, readers and configuration files have them."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.rtde import recipes
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording import (
    RecordingError,
    create_recording,
    open_recording,
    program_runs,
    read_arrays,
)
from gatewayd.rtde.types import DataType

RECIPE = Recipe(
    ["timestamp", "payload_cog", "runtime_state", "output_bit_register_64"],
    [DataType.DOUBLE, DataType.VECTOR3D, DataType.UINT32, DataType.BOOL],
)
PACKAGES = ((0.5, 1.0, 2.0, 3.0, 1, True), (0.502, 1.5, 2.5, 3.5, 2, False), (0.504, 0.0, 0.0, 0.0, 2, False))


def written(path: Path, **options: object) -> bytes:
    with create_recording(path, RECIPE, **options) as recording:  # type: ignore[arg-type]
        for package in PACKAGES:
            recording.write(package)
    assert recording.packages == 3
    return path.read_bytes()


def test_text_has_a_header_and_a_line_for_each_package(tmp_path: Path) -> None:
    """`name_0` for the elements of a vector, spaces between columns, truth values as numbers."""
    assert written(tmp_path / "robot_data.csv") == (
        b"timestamp payload_cog_0 payload_cog_1 payload_cog_2 runtime_state output_bit_register_64\n"
        b"0.5 1.0 2.0 3.0 1 1\n"
        b"0.502 1.5 2.5 3.5 2 0\n"
        b"0.504 0.0 0.0 0.0 2 0\n"
    )


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|"])
def test_the_delimiter_is_free_and_found_out(tmp_path: Path, delimiter: str) -> None:
    text = written(tmp_path / "x.csv", delimiter=delimiter).decode()
    assert text.splitlines()[1] == delimiter.join(("0.5", "1.0", "2.0", "3.0", "1", "1"))
    with open_recording(tmp_path / "x.csv") as found:
        assert tuple(found) == PACKAGES


def test_names_and_types_are_those_of_the_recipe(tmp_path: Path) -> None:
    """`create_recording` takes a `Recipe`, as `Robot.outputs` is one; a value that does not fit is refused by name."""
    with create_recording(tmp_path / "x.csv", RECIPE) as recording:
        with pytest.raises(ValueError, match="runtime_state is UINT32 and cannot hold -1"):
            recording.write((0.5, 1.0, 2.0, 3.0, -1, True))
        with pytest.raises(ValueError, match="5 values"):
            recording.write(PACKAGES[0][:-1])
        recording.write(PACKAGES[0])
    with open_recording(tmp_path / "x.csv") as found:
        assert (found.recipe.names, found.recipe.types) == (RECIPE.names, RECIPE.types)


def test_binary_has_two_lines_and_packages_of_one_size(tmp_path: Path) -> None:
    data = written(tmp_path / "robot_data.bin", binary=True)
    names, types, rest = data.split(b"\n", 2)
    assert names.decode().split() == [
        "timestamp", "payload_cog_0", "payload_cog_1", "payload_cog_2", "runtime_state", "output_bit_register_64",
    ]  # fmt: skip
    assert types.decode().split() == ["DOUBLE", "DOUBLE", "DOUBLE", "DOUBLE", "UINT32", "BOOL"]
    assert rest == b"".join(map(RECIPE.pack, PACKAGES))


@pytest.mark.parametrize("kind", list(DataType), ids=lambda kind: kind.word)
def test_each_type_has_its_word_in_the_second_line(tmp_path: Path, kind: DataType) -> None:
    """That of its elements for a vector, once for each."""
    with create_recording(tmp_path / "x", Recipe(["x"], [kind]), binary=True):
        pass
    words = {"VECTOR3D": "DOUBLE", "VECTOR6D": "DOUBLE", "VECTOR6INT32": "INT32", "VECTOR6UINT32": "UINT32"}
    assert (tmp_path / "x").read_text().splitlines()[1].split() == [
        words.get(kind.word, kind.word)
    ] * kind.count


def test_a_recording_is_read_package_by_package(tmp_path: Path) -> None:
    written(tmp_path / "x.csv")
    with open_recording(tmp_path / "x.csv") as recording:
        assert recording.recipe.names == RECIPE.names
        assert len(list(recording)) == 3
        assert [values[recording.recipe.slots["payload_cog"]] for values in recording][1] == (1.5, 2.5, 3.5)


def test_only_the_rows_of_a_running_program_are_taken(tmp_path: Path) -> None:
    """`program_runs` is the filter; `read_arrays` has it as an option, and the plotter by --running."""
    written(tmp_path / "x.csv")
    runs = program_runs(RECIPE)
    assert runs is not None
    assert list(map(runs, PACKAGES)) == [False, True, True]
    assert read_arrays(tmp_path / "x.csv", running=True)["timestamp"].tolist() == [0.502, 0.504]


def test_columns_are_arrays(tmp_path: Path) -> None:
    written(tmp_path / "x.csv")
    found = read_arrays(tmp_path / "x.csv")
    assert found["timestamp"].tolist() == [0.5, 0.502, 0.504]
    assert found["payload_cog"].shape == (3, 3)
    assert found["runtime_state"].dtype.name == "uint32"
    assert len(found["output_bit_register_64"]) == 3


def test_what_is_no_recording_is_refused_with_its_name(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("")
    with pytest.raises(RecordingError, match=r"x\.csv:1: no recording"):
        open_recording(tmp_path / "x.csv")


XML = """\
<?xml version="1.0"?>
<rtde_config>
  <recipe key="state">
    <field name="actual_q" type="VECTOR6D"/>
    <field name="output_int_register_0" type="INT32"/>
  </recipe>
  <recipe key="setp"><field name="input_double_register_0" type="DOUBLE"/></recipe>
</rtde_config>
"""


def test_an_xml_file_has_recipes_by_key(tmp_path: Path) -> None:
    """Each a `DeclaredRecipe` with key, names and types."""
    (tmp_path / "control_loop_configuration.xml").write_text(XML)
    found = recipes.read_recipes(tmp_path / "control_loop_configuration.xml")
    assert isinstance(found, recipes.RecipeFile)
    state = found.recipe("state")
    assert isinstance(state, recipes.DeclaredRecipe)
    assert (state.key, state.names) == ("state", ("actual_q", "output_int_register_0"))
    assert state.types == {"actual_q": DataType.VECTOR6D, "output_int_register_0": DataType.INT32}
    assert found.recipe("setp").names == ("input_double_register_0",)
    with pytest.raises(recipes.RecipeFileError, match="no recipe has the key 'watchdog'; choose one of"):
        found.recipe("watchdog")


def test_a_recipe_element_is_parsed_from_bytes() -> None:
    found = recipes.parse_recipes(XML.encode(), "x.xml")
    assert found.recipe("state").fields[1].line == 5
    with pytest.raises(recipes.RecipeFileError, match=r"x\.xml:4: "):
        recipes.parse_recipes(XML.replace('type="VECTOR6D"', 'type="VECTOR"').encode(), "x.xml")


def test_a_text_file_has_one_recipe(tmp_path: Path) -> None:
    """That of the C++ client: a name in each line, without types."""
    (tmp_path / "rtde_output_recipe.txt").write_text("timestamp\nactual_q\n")
    found = recipes.read_recipes(tmp_path / "rtde_output_recipe.txt").recipe()
    assert (found.names, found.types) == (("timestamp", "actual_q"), {})
