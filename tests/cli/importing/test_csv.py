"""`gatewayd import csv` as a person uses it."""

from __future__ import annotations

import re
from contextlib import chdir
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli import command
from tests.cli.importing.register_list.lists import ENGLISH

MAPPINGS = Path(__file__).parents[3] / "mappings"
HOST = ("--host", "127.0.0.9")
WRITER = ("--writer", "127.0.0.1")


def gatewayd(*arguments: object, content: str | None = None) -> Result:
    return CliRunner().invoke(command, list(map(str, arguments)), input=content, prog_name="gatewayd")


def import_csv(*arguments: object, content: str | None = None) -> Result:
    return gatewayd("import", "csv", *arguments, content=content)


@pytest.fixture
def listed(tmp_path: Path) -> Path:
    path = tmp_path / "Press 3.csv"
    path.write_text(ENGLISH)
    return path


WRITERS = {
    "full-image.yaml": ["plc"],
    "small-cell.yaml": ["plc"],
    "two-plcs.yaml": ["line_plc", "cell_plc", "panel"],
    "ur-native-map.yaml": ["plc"],
}


@pytest.mark.parametrize("name", WRITERS)
def test_what_show_prints_comes_back_the_same(name: str, tmp_path: Path) -> None:
    shown = gatewayd("show", "--format", "csv", MAPPINGS / name).stdout
    listed, made = tmp_path / "list.csv", tmp_path / "made.yaml"
    listed.write_text(shown)
    writers = [f"--writer={writer}=127.0.0.{number}" for number, writer in enumerate(WRITERS[name], 1)]
    done = import_csv(listed, *HOST, "--series", "e", *writers, "-o", made)
    assert (done.exit_code, done.stderr) == (0, "")
    assert gatewayd("show", "--format", "csv", made).stdout == shown


def test_a_list_becomes_a_mapping_that_passes_the_check(listed: Path, tmp_path: Path) -> None:
    made = tmp_path / "press.yaml"
    done = import_csv(listed, *HOST, *WRITER, "--series", "e", "-o", made)
    assert done.exit_code == 0
    assert done.stdout == f"{made}: 5 variables, 2 doubts\n"
    assert f"{listed}:4:1: doubt: the list names no field of the robot" in done.stderr
    assert f"{listed}:7:15: doubt: no byte order is said" in done.stderr
    assert "cell: press-3\n" in made.read_text()
    assert gatewayd("check", made).exit_code == 0


def test_standard_input_and_output(listed: Path) -> None:
    done = import_csv("-", *HOST, *WRITER, content=listed.read_text())
    assert done.exit_code == 0
    assert done.stdout.startswith('# Proposed by `gatewayd import csv` from "stdin"')


def test_errors_write_nothing(listed: Path, tmp_path: Path) -> None:
    listed.write_text(ENGLISH.replace("UINT", "UNIT"))
    made = tmp_path / "press.yaml"
    done = import_csv(listed, *HOST, *WRITER, "-o", made)
    assert (done.exit_code, done.stdout) == (1, "")
    assert f"{listed}:5:13: error: `UNIT` cannot be read here\n    hint: write bit, bool" in done.stderr
    assert done.stderr.endswith("nothing was written\n")
    assert not made.exists()


def test_strict_counts_doubts_as_errors(listed: Path, tmp_path: Path) -> None:
    made = tmp_path / "press.yaml"
    done = import_csv(listed, *HOST, *WRITER, "--strict", "-o", made)
    assert done.exit_code == 1
    assert "nothing was written: doubts count as errors with --strict" in done.stderr
    assert not made.exists()


def test_an_existing_file_is_kept(listed: Path, tmp_path: Path) -> None:
    made = tmp_path / "press.yaml"
    made.write_text("mine\n")
    done = import_csv(listed, *HOST, *WRITER, "-o", made)
    assert done.exit_code == 2
    assert "overwrite it with --force" in done.stderr
    assert made.read_text() == "mine\n"
    assert import_csv(listed, *HOST, *WRITER, "-o", made, "--force").exit_code == 0


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["nowhere.csv", *HOST], "nowhere.csv: cannot be read: No such file or directory"),
        (["nowhere.csv"], "Missing option '--host'"),
        (["nowhere.csv", *HOST, "--writer", "plc=here"], "write an IP address or a network, or NAME=ADDRESS"),
        (["nowhere.csv", *HOST, "--addresses", "from-2"], "from-2"),
    ],
)
def test_wrong_usage(arguments: list[str], message: str) -> None:
    done = import_csv(*arguments)
    assert (done.exit_code, done.stdout) == (2, "")
    assert message in done.stderr


def test_the_example_of_the_guide(tmp_path: Path) -> None:
    """Its list, its command, and the mapping that it shows."""
    page = (MAPPINGS.parent / "docs" / "howto" / "import-register-list.md").read_text()
    listed, said, made = re.findall(r"```(?:text|yaml)\n(.*?)```", page, re.DOTALL)[:3]
    line = re.search(r"```sh\n(gatewayd import csv .*)\n", page)
    assert line is not None
    with chdir(tmp_path):
        Path("liste.csv").write_text(listed)
        done = gatewayd(*line[1].split()[1:])
        assert done.exit_code == 0
        assert done.stderr + done.stdout == said
        assert made in Path("press.yaml").read_text()
        assert gatewayd("check", "press.yaml").exit_code == 0
