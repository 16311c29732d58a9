"""`gatewayd diff`: its exit codes and forms. What it tells: tests/report/test_diff.py."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli.diff import command

ROOT = Path(__file__).parents[2]
SMALL, PLCS = ROOT / "mappings" / "small-cell.yaml", ROOT / "mappings" / "two-plcs.yaml"
BROKEN = ROOT / "gatewayd/links/modbus_server/rules/GW214-register-overlap/bad.yaml"


def diff(*args: str | Path, content: str | None = None) -> Result:
    return CliRunner().invoke(command, [str(argument) for argument in args], input=content)


def test_the_same_file_is_no_difference() -> None:
    done = diff(SMALL, SMALL)
    assert (done.exit_code, done.stdout, done.stderr) == (0, "small-cell: no difference\n", "")


@pytest.mark.parametrize("old, new", [(SMALL, PLCS), (PLCS, SMALL)])
def test_differences_are_exit_code_1(old: Path, new: Path) -> None:
    done = diff(old, new)
    assert done.exit_code == 1
    assert {line[:2] for line in done.stdout.splitlines()[1:]} >= {"+ ", "- ", "~ "}


def test_json_is_json() -> None:
    done = diff("--format", "json", SMALL, PLCS)
    assert done.exit_code == 1
    assert json.loads(done.stdout)["version"] == 1


def test_standard_input_is_one_of_the_files() -> None:
    changed = SMALL.read_text().replace("cell: small-cell", "cell: other")
    done = diff("-", SMALL, content=changed)
    assert done.exit_code == 1
    assert done.stdout.startswith("other -> small-cell: renamed; fingerprint ")
    assert diff("-", "-", content=changed).exit_code == 2


@pytest.mark.parametrize("name", ["missing.yaml", "."])
def test_what_cannot_be_read_is_exit_code_2(name: str, tmp_path: Path) -> None:
    done = diff(SMALL, tmp_path / name)
    assert done.exit_code == 2
    assert "cannot be read" in done.stderr


def test_a_file_with_errors_is_exit_code_2_and_listed() -> None:
    done = diff(BROKEN, SMALL)
    assert done.exit_code == 2
    assert "error GW214" in done.stderr
    assert done.stdout == ""


def test_mistakes_in_tests_are_notes_as_a_reload_takes_the_file() -> None:
    text = SMALL.read_text()
    assert "\ntests:\n" in text
    changed = text.replace("\ntests:\n", "\ntests:\n  wrong:\n    - {by: nobody, write: {start: true}}\n", 1)
    done = diff(SMALL, "-", content=changed)
    assert (done.exit_code, done.stdout) == (0, "small-cell: no difference\n")
    (line,) = done.stderr.splitlines()
    assert line.startswith("stdin:")
    assert ": note: GW" in line
    assert "in tests only: " in line


def test_other_mistakes_beside_those_in_tests_are_errors() -> None:
    changed = SMALL.read_text().replace("\ntests:\n", "\ntests:\n  wrong: 3\nmistaken: 1\n", 1)
    done = diff(SMALL, "-", content=changed)
    assert (done.exit_code, done.stdout) == (2, "")
    assert "error GW" in done.stderr
