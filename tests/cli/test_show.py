"""`gatewayd show` on the screen and in a pipe."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli.show import command

ROOT = Path(__file__).parents[2]
MAPPINGS = sorted((ROOT / "mappings").glob("*.yaml"))
FULL = ROOT / "mappings" / "full-image.yaml"
BROKEN = ROOT / "gatewayd/links/modbus_server/rules/GW214-register-overlap/bad.yaml"


def show(*args: str | Path, content: str | None = None, **environment: str) -> Result:
    unset: dict[str, str | None] = {"COLUMNS": None}  # test runners set it for their own sake
    return CliRunner(env=unset | environment).invoke(
        command, [str(argument) for argument in args], input=content
    )


@pytest.mark.parametrize("path", MAPPINGS, ids=lambda path: path.stem)
@pytest.mark.parametrize("form", ["table", "csv", "json", "markdown"])
def test_shipped_mappings_show_in_every_form(path: Path, form: str) -> None:
    done = show("--format", form, path)
    assert done.exit_code == 0
    assert done.output


@pytest.mark.parametrize("path", MAPPINGS, ids=lambda path: path.stem)
def test_the_table_fits_120_columns(path: Path) -> None:
    """Nothing is cut, and nothing but the notes below is wider."""
    lines = show(path).output.splitlines()
    table = lines[: next(n for n, line in enumerate(lines) if line.startswith("writer "))]
    assert max(map(len, table[1:])) <= 120
    assert "\u2026" not in "".join(lines)


def test_the_table_names_both_kinds_of_address() -> None:
    output = show(FULL).output
    assert (
        "out_doubles[0..23] <- output_double_register_0..23 holding 1200-1295      401201-401296 float64"
        in output
    )
    assert "in_bits[0..63]     -> input_bit_register_0..63     coil 0-63" in output
    assert "full-image: 224 variables, Modbus TCP 127.0.0.1:1502 unit 1, fingerprint " in output


def test_the_pdo_table_and_the_load_of_the_bus() -> None:
    """PDO, COB-ID, type, times, bits, variables, objects; what no PDO carries; the load by bit-rate."""
    output = show(ROOT / "mappings" / "two-buses.yaml", COLUMNS="130").output
    assert "CANopen can0 node 20, fingerprint" in output
    lines = [" ".join(line.split()) for line in output.splitlines()]
    assert "RPDO 1 (command) 0x214 sync (1) 100ms 0-15 -> recipe 2070h:01 UNSIGNED16" in lines
    assert "17 -> feed_ready 2000h:02 BOOLEAN" in lines
    assert "TPDO 3 (forces) 0x1C0 every 5 SYNCs (5) 0-31 <- force 2430h:01 REAL32" in lines
    assert "by SDO only: part_number 2010h:01" in lines
    assert any(line.startswith("worst-case bus load by bit-rate: 1000k ") for line in lines)
    assert "writer line: RPDO, heartbeat of node 1, lost after 0.5s of silence" in lines


def test_a_variable_on_canopen_alone_shows_its_object() -> None:
    lines = show(ROOT / "mappings" / "canopen-only.yaml", COLUMNS="130").output.splitlines()
    assert any("in_bits[0..63]" in line and "object 2000h:01-40" in line for line in lines)


def test_json_and_markdown_have_the_pdo_table() -> None:
    document = json.loads(show("--format", "json", ROOT / "mappings" / "two-buses.yaml").output)
    assert document["canopen"]["pdos"][4]["cob_id"] == "0x1C0"
    text = show("--format", "markdown", ROOT / "mappings" / "two-buses.yaml").output
    assert "| TPDO 3 (forces) | 0x1C0 | every 5 SYNCs (5) |  |  | 32 | torque | 2430h:02 | REAL32 |" in text


def test_all_shows_every_variable() -> None:
    output = show("--all", FULL).output
    assert "in_bits[17]" in output
    assert "--all shows each variable" not in output


def test_brackets_are_not_taken_for_markup() -> None:
    assert "joints[0..5]" in show(ROOT / "mappings" / "two-plcs.yaml").output


def test_a_narrow_terminal_loses_nothing() -> None:
    """Long texts are folded, never cut."""
    output = show(FULL, COLUMNS="60").output
    assert max(len(line) for line in output.splitlines()[1:12]) <= 60
    assert "\u2026" not in output


def test_csv_is_one_row_for_every_place() -> None:
    read = list(csv.DictReader(show("--format", "csv", FULL).output.splitlines()))
    assert len(read) == 2 * (64 + 64) + 2 * (24 + 24)


def test_json_is_for_programs() -> None:
    assert json.loads(show("--format", "json", FULL).output)["cell"] == "full-image"


def test_standard_input() -> None:
    assert "full-image:" in show("-", content=FULL.read_text(encoding="utf-8")).output


def test_a_broken_file_is_explained() -> None:
    """Findings go to stderr, so that a pipe gets nothing wrong."""
    done = show("--format", "csv", BROKEN)
    assert (done.exit_code, done.stdout) == (1, "")
    assert "error GW214 register-overlap" in done.stderr


def test_an_unreadable_file_is_one_line(tmp_path: Path) -> None:
    done = show(tmp_path / "gone.yaml")
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr == f"{tmp_path}/gone.yaml: cannot be read: No such file or directory\n"


def test_what_holds_for_the_whole_cell_is_noted() -> None:
    """Supervision of writers, adoption, and outputs that hang on the program."""
    content = """\
gatewayd: 1
cell: c
robot: {host: r, valid: running, adopt_for: 3s}
modbus: {listen: '127.0.0.1:1502'}
writers: {plc: {modbus: 127.0.0.1, timeout: 1s, timeout_counts: writes, grace: 500ms}}
variables:
  go: {robot: input_bit_register_0, modbus: 0.0, owner: plc}
  ready: {robot: output_bit_register_0, modbus: 9.0}
"""
    output = show("-", content=content).output
    assert (
        "writer plc: 127.0.0.1, lost after 1s of silence (only writes count), "
        "keeps what it owns for 0.5s without a connection\n" in output
    )
    assert "falls back after 3s without an owner" in output
    assert "clear, running" in output
    plain = show("-", content=content.replace("valid: running, adopt_for: 3s", "adopt_for: none")).output
    assert "without an owner" not in plain
    assert "running" not in plain


def test_status_words_stand_in_the_pdo_table() -> None:
    content = """\
gatewayd: 1
cell: c
robot: {host: r}
canopen:
  channel: can0
  bitrate: 500000
  node: 16
  pdos: {state: {status: [flags, quality of mode], variables: mode}}
variables: {mode: {robot: robot_mode}}
"""
    lines = [" ".join(line.split()) for line in show("-", content=content, COLUMNS="130").output.splitlines()]
    assert "TPDO 1 (state) 0x190 event (254) 0-15 <- status: flags 5F00h:02 UNSIGNED16" in lines
    assert "16-31 <- status: quality of mode 5F40h:01 UNSIGNED16" in lines
    assert "32-63 <- mode 2410h:01 INTEGER32" in lines


@pytest.mark.parametrize("path", MAPPINGS, ids=lambda path: path.stem)
@pytest.mark.parametrize("width", [40, 60, 72, 80, 120, 200])
def test_a_screen_of_any_width_breaks_no_number_and_names_what_it_leaves_out(path: Path, width: int) -> None:
    done = show(path, COLUMNS=str(width))
    lines = done.output.splitlines()
    end = next(
        n for n, line in enumerate(lines) if line.startswith(("writer ", "left out", "by SDO", "worst-case"))
    )
    assert max(map(len, lines[:end])) <= width
    wide = show(path, COLUMNS="200").output
    numbers = set(re.findall(r"\b[0-9]{6}\b", wide))
    head = next(line for line in lines if "name" in line and "4xxxxx" in line)
    left_out = " ".join(done.output.partition("left out, ")[2].partition(";")[0].split())
    for column in ("no.", "robot", "address", "type", "value", "owner", "lost"):
        assert (column in head) != (column in left_out)
    limits = {"100000"} if "value" in left_out else set()
    assert set(re.findall(r"\b[0-9]{6}\b", done.output)) == numbers - limits
