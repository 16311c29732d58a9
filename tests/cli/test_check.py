"""`gatewayd check` as people and pipelines call it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli.check import command

ROOT = Path(__file__).parents[2]
GOOD = ROOT / "gatewayd/links/modbus_server/rules/GW214-register-overlap/good.yaml"
BAD = ROOT / "gatewayd/links/modbus_server/rules/GW214-register-overlap/bad.yaml"
WARNED = ROOT / "gatewayd/links/modbus_server/rules/GW217-open-listener/bad.yaml"
GOLDEN = sorted((ROOT / "tests/golden").glob("*.golden"))
RULE_OFF = "----------\n"
NEXT_FILE = re.compile(r"^===== (\S+)\n", re.MULTILINE)


def check(*args: str | Path, content: str | bytes | None = None) -> Result:
    return CliRunner().invoke(command, [str(argument) for argument in args], input=content)


@pytest.mark.parametrize("path", GOLDEN, ids=lambda path: path.stem)
def test_golden(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Mappings above the line, the exact output below. GOLDEN=write rewrites the output."""
    above, _, below = path.read_text(encoding="utf-8").partition(RULE_OFF)
    monkeypatch.chdir(tmp_path)
    _, *parts = NEXT_FILE.split(above)
    names = parts[::2]
    for name, text in zip(names, parts[1::2], strict=True):
        Path(name).write_text(text, encoding="utf-8")
    output = check(*names).output
    if os.environ.get("GOLDEN") == "write":
        path.write_text(above + RULE_OFF + output, encoding="utf-8")
    assert output == below


def test_there_are_golden_files() -> None:
    assert len(GOLDEN) >= 12


@pytest.mark.parametrize(
    "arguments,code",
    [
        ([GOOD], 0),
        ([BAD], 1),
        ([WARNED], 0),
        (["--strict", WARNED], 1),
        (["--strict", GOOD], 0),
        ([GOOD, "nowhere.yaml"], 2),
        ([], 2),
        (["--format", "xml", GOOD], 2),
        (["--explain", "GW999"], 2),
    ],
    ids=str,
)
def test_exit_codes(arguments: list[str | Path], code: int) -> None:
    assert check(*arguments).exit_code == code


def test_unreadable_files_hide_nothing(tmp_path: Path) -> None:
    """A missing file and a directory cost one line each; the others are checked."""
    done = check(tmp_path / "gone.yaml", tmp_path, BAD)
    assert done.exit_code == 2
    assert f"{tmp_path}/gone.yaml: cannot be read: No such file or directory" in done.output
    assert f"{tmp_path}: cannot be read: no mapping file (*.yaml, *.yml) in this directory" in done.output
    assert "error GW214 register-overlap" in done.output
    assert done.output.endswith("1 file checked, 2 files not readable: 1 error\n")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission_is_one_line(tmp_path: Path) -> None:
    locked = tmp_path / "locked.yaml"
    locked.write_text("gatewayd: 1\n")
    locked.chmod(0)
    done = check(locked)
    assert (done.exit_code, done.output.splitlines()[0]) == (
        2,
        f"{locked}: cannot be read: Permission denied",
    )


def test_standard_input() -> None:
    """`-` reads a mapping from a pipe."""
    done = check("-", content=BAD.read_text())
    assert done.exit_code == 1
    assert done.output.startswith("stdin:7:49: error GW214 register-overlap:")


def test_a_file_named_twice_is_one_cell() -> None:
    """It does not clash with itself."""
    assert check(GOOD, GOOD).output == "1 file checked: no findings\n"


def test_files_of_one_gateway_are_checked_together(tmp_path: Path) -> None:
    """Equal units on one listener are found, unless the files never run together."""
    copy = tmp_path / "copy.yaml"
    copy.write_text(GOOD.read_text().replace("press-3", "press-4").replace("1.10}", "1.11}"))
    assert "error GW206 unit-clash" in check(GOOD, copy).output
    assert check("--separately", GOOD, copy).exit_code == 0


def test_json_is_for_programs() -> None:
    """One document, whatever was found."""
    done = check("--format", "json", "--separately", BAD, WARNED, "nowhere.yaml")
    document = json.loads(done.output)
    assert [finding["rule"] for finding in document["findings"]] == ["GW214", "GW217"]
    assert (document["errors"], document["warnings"], len(document["unreadable"])) == (1, 1, 1)


def test_github_annotates_the_line() -> None:
    done = check("--format", "github", BAD)
    assert done.output.startswith(f"::error file={BAD},line=7,col=49,title=GW214 register-overlap::")
    assert done.output.count("\n") == 1


@pytest.mark.parametrize("name", ["GW214", "gw214", "register-overlap"])
def test_explain_works_without_any_file(name: str) -> None:
    done = check("--explain", name)
    assert done.exit_code == 0
    assert done.output.startswith("# GW214 register-overlap: ")
    assert "int32" in done.output


@pytest.mark.parametrize("name", ["GW307", "rate-not-a-divisor"])
def test_explain_says_that_a_rule_is_retired(name: str) -> None:
    done = check("--explain", name)
    assert done.exit_code == 0
    assert done.output.startswith("# GW307 rate-not-a-divisor: retired\n\nThis rule is no longer checked. ")


def test_explain_all_lists_every_rule_once() -> None:
    lines = check("--explain", "all").output.splitlines()
    assert [line[:5] for line in lines] == sorted({line[:5] for line in lines})
    assert len(lines) > 80


def test_explain_suggests_the_nearest() -> None:
    assert "did you mean `register-overlap`?" in check("--explain", "register-overlop").output


def test_help_teaches_by_examples() -> None:
    output = check("--help").output
    assert "gatewayd check my-cell.yaml" in output
    assert "--explain GW214" in output
    assert "Exit codes:" in output


@pytest.mark.parametrize("variable,coloured", [("PATH", True), ("NO_COLOR", False)])
def test_colour_is_for_terminals(variable: str, coloured: bool) -> None:
    """Findings are coloured on a terminal, unless NO_COLOR is set."""
    terminal, end = os.openpty()
    environment = {name: value for name, value in os.environ.items() if name != "NO_COLOR"} | {
        "TERM": "xterm"
    }
    environment.setdefault(variable, "1")
    subprocess.run(
        [sys.executable, "-m", "gatewayd", "check", str(BAD)],
        stdout=end,
        check=False,
        timeout=30,
        env=environment,
    )
    os.close(end)
    output = os.read(terminal, 4096)
    os.close(terminal)
    assert b"GW214" in output
    assert (b"\x1b[31m" in output) == coloured


def test_as_a_process_it_imports_no_server() -> None:
    """Neither pymodbus, nor asyncio, nor rich is paid for."""
    script = (
        "import sys; from gatewayd.cli.check import command\n"
        f"command.main([{str(GOOD)!r}], standalone_mode=False)\n"
        "heavy = {'pymodbus', 'asyncio', 'rich', 'structlog'} & set(sys.modules)\n"
        "sys.exit(' '.join(sorted(heavy)) or 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=30
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "\x1b" not in done.stdout


def test_a_directory_stands_for_its_mapping_files(tmp_path: Path) -> None:
    """As for `gatewayd run`: cells that would serve together are checked together."""
    for name in ("b.yaml", "a.yaml"):
        (tmp_path / name).write_text(GOOD.read_text())
    (tmp_path / "notes.txt").write_text("not a mapping")
    assert check(tmp_path).output == check(tmp_path / "a.yaml", tmp_path / "b.yaml").output
    assert check(tmp_path).exit_code == 1
