"""`gatewayd export` as people call it."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli.export import command

ROOT = Path(__file__).parents[2]
TWO_BUSES = ROOT / "mappings" / "two-buses.yaml"
MODBUS_ONLY = ROOT / "mappings" / "full-image.yaml"
WATCHED = ROOT / "mappings" / "small-cell.yaml"
BROKEN = ROOT / "gatewayd/links/canopen_node/rules/GW402-pdo-too-long/bad.yaml"


def export(*args: str | Path, content: str | None = None) -> Result:
    return CliRunner().invoke(command, [str(argument) for argument in args], input=content)


def test_the_data_sheet_goes_to_standard_output_or_a_file(tmp_path: Path) -> None:
    """The same bytes either way, and every time."""
    printed = export("eds", TWO_BUSES)
    assert printed.exit_code == 0
    assert printed.stdout.startswith("[FileInfo]\nFileName=two-buses.eds\n")
    target = tmp_path / "cell.eds"
    assert export("eds", TWO_BUSES, "-o", target).output == ""
    assert target.read_bytes() == printed.stdout.encode()


def test_a_configuration_names_the_node() -> None:
    lines = export("dcf", TWO_BUSES).stdout.splitlines()
    assert lines[lines.index("[DeviceComissioning]") + 1 :][:3] == [
        "NodeID=0x14",
        "NodeName=two-buses",
        "Baudrate=500",
    ]
    assert "LastEDS=two-buses.eds" in lines


def test_options_reach_the_export() -> None:
    done = export("urscript", WATCHED, "--prefix", "press", "--handshake", "start:busy")
    assert done.exit_code == 0
    assert 'rtde_set_watchdog("input_int_register_23", 5, "stop")\n' in done.stdout
    assert "def press_acknowledge_start():\n" in done.stdout


def test_standard_input() -> None:
    done = export("eds", "-", content=TWO_BUSES.read_text(encoding="utf-8"))
    assert done.exit_code == 0


@pytest.mark.parametrize(
    "arguments, code, message",
    [
        (["eds", MODBUS_ONLY], 1, "the cell is on no CAN bus"),
        (["dcf", MODBUS_ONLY], 1, "the cell is on no CAN bus"),
        (["urscript", MODBUS_ONLY, "--handshake", "in_bits"], 1, "TOGGLE:ACKNOWLEDGE"),
        (["eds", BROKEN], 1, "error GW402 pdo-too-long"),
        (["eds", "nowhere.yaml"], 2, "nowhere.yaml: cannot be read: No such file or directory"),
        (["eds", TWO_BUSES, "-o", "nowhere/a.eds"], 2, "nowhere/a.eds: cannot be written"),
        (["xdd", TWO_BUSES], 2, "xdd"),
    ],
)
def test_what_cannot_be_exported_is_explained(arguments: list[str | Path], code: int, message: str) -> None:
    """On stderr, so that a pipe gets nothing wrong."""
    done = export(*arguments)
    assert (done.exit_code, done.stdout) == (code, "")
    assert message in done.stderr
