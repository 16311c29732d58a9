"""`gatewayd import rtde` as a person uses it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli import command
from tests.rtde.recipes.samples import GUIDE

WRITER = ("--host", "127.0.0.9", "--writer", "127.0.0.1")


def import_rtde(*arguments: object) -> Result:
    return CliRunner().invoke(command, ["import", "rtde", *map(str, arguments)], prog_name="gatewayd")


@pytest.fixture
def recipe(tmp_path: Path) -> Path:
    path = tmp_path / "control_loop_configuration.xml"
    path.write_text(GUIDE)
    return path


def test_the_guides_example_becomes_a_mapping_that_passes_the_check(recipe: Path, tmp_path: Path) -> None:
    out = tmp_path / "cell.yaml"
    done = import_rtde(recipe, *WRITER, "--frequency", 125, "--series", "e", "--version", "5.12", "-o", out)
    assert (done.exit_code, done.stderr) == (0, "")
    assert done.stdout == f"{out}: 18 variables\n"
    checked = subprocess.run(
        [sys.executable, "-m", "gatewayd", "check", "--strict", out],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (checked.returncode, checked.stderr) == (0, "")
    text = out.read_text()
    assert "cell: control-loop-configuration\n" in text
    assert "  frequency: 125\n" in text
    assert (
        "input_int_register_1: {robot: input_int_register_1, modbus: 2, owner: plc, on_release: clear}"
        in text
    )


def test_one_recipe_of_several_to_standard_output(recipe: Path) -> None:
    done = import_rtde(recipe, "--host", "127.0.0.9", "--recipe", "out")
    assert done.exit_code == 0
    assert "writers:" not in done.stdout
    assert "input_int_register_0" not in done.stdout
    refused = import_rtde(recipe, "--host", "127.0.0.9", "--recipe", "no")
    assert (refused.exit_code, refused.stdout) == (1, "")
    assert refused.stderr == f"{recipe}:1: no recipe has the key 'no'; choose one of 'out', 'in1', 'in2'\n"


def test_inputs_want_a_writer(recipe: Path) -> None:
    done = import_rtde(recipe, "--host", "127.0.0.9")
    assert (done.exit_code, done.stdout) == (2, "")
    assert "name the PLC that may write them with --writer ADDRESS" in done.stderr


def test_a_writer_on_another_machine_is_listened_to(recipe: Path) -> None:
    assert (
        "listen: 0.0.0.0:502\n  allow: [192.0.2.20]"
        in import_rtde(recipe, "--host", "127.0.0.9", "--writer", "192.0.2.20").stdout
    )


def test_nothing_is_half_imported_unless_it_is_asked_for(tmp_path: Path) -> None:
    path, out = tmp_path / "rtde_output_recipe.txt", tmp_path / "cell.yaml"
    path.write_text("timestamp\nbrand_new\nactual_q\n")
    done = import_rtde(path, "--host", "127.0.0.9", "-o", out)
    assert done.exit_code == 1
    found, outcome = done.stderr.splitlines()
    assert found.startswith(
        f"{path}:2: error: brand_new is in no guide, and its type is not declared; strike it, or "
    )
    assert outcome == "nothing was written; --leave-out writes the rest"
    assert not out.exists()
    done = import_rtde(path, "--host", "127.0.0.9", "-o", out, "--leave-out")
    assert (done.exit_code, done.stdout) == (1, f"{out}: 7 variables\n")
    assert "brand_new" not in out.read_text()


def test_what_the_check_would_refuse_is_not_written(recipe: Path, tmp_path: Path) -> None:
    out = tmp_path / "cell.yaml"
    done = import_rtde(recipe, "--host", "192.0.2.300", "--writer", "127.0.0.1", "-o", out)
    assert done.exit_code == 1
    assert "`192.0.2.300` is not an IP address" in done.stderr
    assert not out.exists()


def test_an_existing_file_wants_force(recipe: Path, tmp_path: Path) -> None:
    out = tmp_path / "cell.yaml"
    out.write_text("precious")
    done = import_rtde(recipe, *WRITER, "-o", out)
    assert (done.exit_code, out.read_text()) == (2, "precious")
    assert "is there already; choose another name, or overwrite it with --force" in done.stderr
    assert import_rtde(recipe, *WRITER, "-o", out, "--force").exit_code == 0


@pytest.mark.parametrize("content", ["<rtde_config", "a b\n", ""])
def test_a_file_that_is_no_recipe(tmp_path: Path, content: str) -> None:
    path = tmp_path / "x"
    path.write_text(content)
    done = import_rtde(path, "--host", "127.0.0.9")
    assert (done.exit_code, done.stdout) == (1, "")
    assert done.stderr.startswith(f"{path}:1: ")
