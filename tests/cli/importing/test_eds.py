"""`gatewayd import eds` as a person uses it."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli import command
from tests.links.devices.canopen.cells import SHEET
from tests.links.devices.canopen.sheets import Described, eds

CELL = ("--host", "127.0.0.9", "--node", "5")


def gatewayd(*arguments: object) -> Result:
    return CliRunner().invoke(command, list(map(str, arguments)), prog_name="gatewayd")


def import_eds(*arguments: object) -> Result:
    return gatewayd("import", "eds", *arguments)


@pytest.fixture
def sheet(tmp_path: Path) -> Path:
    (tmp_path / "sheets").mkdir()
    path = tmp_path / "sheets" / "Valve-7.eds"
    path.write_bytes(SHEET.read_bytes())
    return path


def test_proposal_passes_the_check(sheet: Path, tmp_path: Path) -> None:
    out = tmp_path / "cell.yaml"
    done = import_eds(sheet, *CELL, "--bus", "can1", "-o", out)
    assert done.exit_code == 0
    assert done.stdout == f"{out}: 2 variables, 2 doubts\n"
    assert f"{sheet}:1: doubt: the device has no heartbeat (1017h)" in done.stderr
    checked = gatewayd("check", "--strict", out)
    assert (checked.exit_code, "no findings" in checked.output) == (0, True)
    text = out.read_text()
    assert "    eds: sheets/Valve-7.eds\n" in text
    assert "  valve_7:\n" in text
    assert "cell: valve-7\n" in text


def test_to_standard_output(sheet: Path) -> None:
    done = import_eds(sheet, *CELL, "--device", "clamp", "--cell", "press")
    assert done.exit_code == 0
    assert "  clamp: {device: clamp}\n" in done.stdout
    assert "cell: press\n" in done.stdout


def test_reserved_name_gets_a_number(tmp_path: Path) -> None:
    path = tmp_path / "device.eds"
    path.write_bytes(SHEET.read_bytes())
    assert "  device_1:\n" in import_eds(path, *CELL).stdout
    assert import_eds(path, *CELL, "--device", "robot").exit_code == 1


def test_nothing_is_half_imported(tmp_path: Path) -> None:
    path, out = tmp_path / "odd.eds", tmp_path / "out.yaml"
    objects = {0x2001: Described(0x16, name="Odd"), 0x2002: Described(5, name="Even")}
    path.write_bytes(eds(objects, [[0x20010018, 0x20020008]]))
    done = import_eds(path, *CELL, "-o", out)
    assert (done.exit_code, done.stdout, out.exists()) == (1, "", False)
    assert f"{path}:6: error: 2001h:00 Odd in TPDO 1 is of the type 0016h" in done.stderr
    assert "nothing was written; --leave-out writes the rest" in done.stderr
    done = import_eds(path, *CELL, "-o", out, "--leave-out")
    assert (done.exit_code, "even: " in out.read_text()) == (1, True)


def test_doubts_may_count_as_errors(sheet: Path) -> None:
    done = import_eds(sheet, *CELL, "--strict")
    assert (done.exit_code, done.stdout) == (1, "")


def test_wrong_usage(sheet: Path, tmp_path: Path) -> None:
    out = tmp_path / "cell.yaml"
    out.write_text("mine")
    assert import_eds(sheet, *CELL, "-o", out).exit_code == 2
    assert out.read_text() == "mine"
    assert import_eds(sheet, *CELL, "--device", "a b").exit_code == 2
    assert import_eds(sheet, "--host", "127.0.0.9").exit_code == 2
    assert import_eds(tmp_path / "none.eds", *CELL).exit_code == 2


def test_file_that_is_too_long(tmp_path: Path) -> None:
    path = tmp_path / "long.eds"
    path.write_bytes(b" " * ((4 << 20) + 1))
    assert import_eds(path, *CELL).exit_code == 2


def test_no_data_sheet(tmp_path: Path) -> None:
    path = tmp_path / "text.eds"
    path.write_text("hello")
    done = import_eds(path, *CELL)
    assert (done.exit_code, "nothing was written\n" in done.stderr) == (1, True)
