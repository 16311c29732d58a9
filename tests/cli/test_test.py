"""`gatewayd test` as people and pipelines call it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli.test import command

ROOT = Path(__file__).parents[2]
HEAD = """\
gatewayd: 1
cell: press-3
robot: {host: 192.0.2.10}
modbus: {listen: '192.0.2.2:1502'}
writers:
  plc: {modbus: 192.0.2.20, timeout: 1s}
variables:
  speed: {robot: input_double_register_0, modbus: 0, owner: plc}
"""
PASSES = (
    HEAD + "tests:\n  it stops:\n    - {by: plc, write: {speed: 5}}\n    - {lost: plc, expect: {speed: 0}}\n"
)
FAILS = PASSES.replace("speed: 0}}", "speed: 5}}")
BROKEN = PASSES.replace("lost: plc", "lost: plv")


def invoke(*args: str | Path, content: str | None = None) -> Result:
    return CliRunner().invoke(command, [str(argument) for argument in args], input=content)


@pytest.mark.parametrize("content,code", [(PASSES, 0), (FAILS, 1), (BROKEN, 1), (HEAD, 1), ("[", 1)])
@pytest.mark.parametrize("form", ["text", "json", "junit"])
def test_exit_code_is_the_same_in_every_format(content: str, code: int, form: str) -> None:
    assert invoke("--format", form, "-", content=content).exit_code == code


def test_unreadable_files_are_named_and_the_others_tested(tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(PASSES)
    result = invoke(tmp_path / "cell.yaml", tmp_path / "none.yaml")
    assert result.exit_code == 2
    assert "none.yaml: cannot be read" in result.output
    assert "1 test carried out, 1 passed, 0 failed, 1 file not readable" in result.output


def test_a_directory_stands_for_its_files(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(PASSES)
    (tmp_path / "b.yaml").write_text(FAILS)
    result = invoke(tmp_path)
    assert (result.exit_code, result.output.splitlines()[-1]) == (
        1,
        "2 tests carried out, 1 passed, 1 failed",
    )


def test_a_file_without_tests_says_so() -> None:
    assert "stdin: has no tests" in invoke("-", content=HEAD).output


def test_only_chooses_by_name() -> None:
    assert invoke("--only", "STOPS", "-", content=PASSES).exit_code == 0
    result = invoke("--only", "starts", "-", content=PASSES)
    assert result.exit_code == 2
    assert "no test has `starts` in its name" in result.output


def test_json_is_one_document() -> None:
    document = json.loads(invoke("--format", "json", "-", content=FAILS).output)
    assert (document["tests"], document["failed"]) == (1, 1)


def test_without_files_it_says_what_is_missing() -> None:
    assert invoke().exit_code == 2


def test_shipped_mappings_pass() -> None:
    result = invoke(ROOT / "mappings")
    assert result.exit_code == 0, result.output
