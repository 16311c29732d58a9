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


def test_a_cell_without_a_link_for_a_plc() -> None:
    robot_only = "gatewayd: 1\ncell: a\nrobot: {host: 127.0.0.9}\nvariables: {}\n"
    done = export("plc", "-", "--for", "c", content=robot_only)
    assert done.exit_code == 1
    assert done.stderr == "stdin: the cell has no link of these: modbus, canopen\n"


PLC = ("plc", WATCHED, "--for", "iec-st")


def test_the_link_is_that_of_the_cell_or_the_one_asked_for(tmp_path: Path) -> None:
    """A cell on both buses has a program for either."""
    for arguments, text in (
        ((ROOT / "mappings/canopen-only.yaml",), "from_node"),
        ((TWO_BUSES,), "image"),
        ((TWO_BUSES, "--link", "canopen"), "from_node"),
    ):
        export("plc", *arguments, "--for", "c", "-o", tmp_path, "--force")
        assert f"struct gw_{text}" in (tmp_path / "gw.h").read_text(encoding="utf-8")


def test_a_plc_program_fills_a_folder(tmp_path: Path) -> None:
    """And says of each file what happened to it."""
    folder = tmp_path / "plc"
    assert export(*PLC, "-o", folder).stdout.count(": new\n") == 4
    assert export(*PLC, "-o", folder).stdout.count(": the same\n") == 4
    assert b"GW_Inputs" in (folder / "GW_Types.st").read_bytes()


def test_what_was_changed_by_hand_is_left_alone(tmp_path: Path) -> None:
    """Nothing at all is written then."""
    export(*PLC, "-o", tmp_path)
    types, blocks = tmp_path / "GW_Types.st", tmp_path / "GW_Blocks.st"
    types.write_text(types.read_text(encoding="utf-8") + "mine", encoding="utf-8")
    blocks.unlink()
    done = export(*PLC, "-o", tmp_path)
    assert (done.exit_code, done.stdout) == (1, "")
    assert "GW_Types.st: changed by hand, so nothing was written" in done.stderr
    assert not blocks.exists()
    assert export(*PLC, "-o", tmp_path, "--force").exit_code == 0
    assert "mine" not in types.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "arguments, code, message",
    [
        (["plc", TWO_BUSES], 2, "Missing option '--for'"),
        (["plc", TWO_BUSES, "--for", "step7"], 2, "'step7' is not one of"),
        (
            ["plc", ROOT / "mappings/canopen-only.yaml", "--for", "tia"],
            1,
            "S7 controllers are no CANopen master",
        ),
        (
            ["plc", WATCHED, "--for", "c", "--link", "canopen"],
            1,
            "the cell is no CANopen node: add",
        ),
        (
            ["plc", ROOT / "mappings/two-plcs.yaml", "--for", "iec-st"],
            1,
            "say which the PLC is, with --writer",
        ),
        ([*PLC, "--name", "start"], 1, "write --name OLD=NEW"),
        ([*PLC, "--name", "start=step"], 1, "`step` is a word of edition 2's language"),
        ([*PLC, "--prefix", "a-b"], 1, "`a-b` is no prefix"),
        (
            ["plc", WATCHED, "--for", "tia", "--host", "gateway.example.org"],
            1,
            "TCON_IP_v4 takes an IPv4 address",
        ),
        ([*PLC, "-o", "/dev/null/plc"], 2, "cannot be written"),
    ],
)
def test_a_plc_program_that_cannot_be_made(
    arguments: list[str | Path], code: int, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = export(*arguments)
    assert (done.exit_code, done.stdout) == (code, "")
    assert message in done.stderr
    assert list(tmp_path.iterdir()) == []
