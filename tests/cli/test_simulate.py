"""`gatewayd simulate`: options that are refused, and what a failure looks like."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

import pytest

from gatewayd.cli.simulate import _MODELS
from gatewayd.simulator.kinematics import MODELS


def run(*options: str) -> subprocess.CompletedProcess[str]:
    """A run that must end by itself."""
    port = () if "--port" in options else ("--port", "0")
    command = [sys.executable, "-m", "gatewayd", "simulate", *port, *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)


def test_a_port_in_use_is_one_clear_line() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        result = run("--port", str(port))
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr.startswith(f"gatewayd: cannot listen on 127.0.0.1:{port}: ")
    assert "Address already in use; " in result.stderr
    assert "--port 0" in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_a_mistake_in_a_program_file_names_its_place(tmp_path: Path) -> None:
    file = tmp_path / "cell.prog"
    file.write_text("output_int_register_0 = 1\noutput_int_register_1 = wrong\n")
    result = run("--program-file", str(file))
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == f"Error: {file}:2:25: the controller has no field 'wrong'\n"


@pytest.mark.parametrize(
    "options,message",
    [
        (("--hold", "foo"), "no such input: foo"),
        (("--stepped",), "--stepped needs --control stdin"),
        (("--loop",), "--loop needs --replay FILE"),
        (("--scenario", "/nowhere"), "/nowhere: No such file or directory"),
        (
            ("--scenario", "x.toml", "--series", "e"),
            "--series has no meaning beside --scenario: write it in the",
        ),
        (
            ("--replay", "x.csv", "--program", "demo"),
            "--program has no meaning beside --replay: the recording is",
        ),
        (("--unreadable", "input_int_register_0,foo"), "no such input: foo"),
        (
            ("--field", "dexterity:REAL"),
            "'dexterity:REAL' is not NAME:TYPE, where TYPE is one of BOOL, UINT8",
        ),
        (("--field", "timestamp:INT32"), "timestamp cannot be another field"),
        (("--drop-at", "nowhere"), "'nowhere' is not STEP or STEP:NUMBER"),
        (("--strict-lists", "maybe"), "'maybe' is not one of"),
        (("--delay", "-1"), "'-1' is not a number of seconds"),
        (("--version", "4.1"), "software versions begin with 3 (cb3), 5 (e) or 10 (x)"),
        (("--version", "5.12", "--series", "x"), "5.12 is software of series e, not of x"),
        (("--version", "new"), "is not a software version"),
        (("--overflow-close", "nan"), "'nan' is not a number of seconds"),
        (("--program-file", "/nowhere"), "/nowhere: No such file or directory"),
    ],
)
def test_wrong_options_are_refused(options: tuple[str, ...], message: str) -> None:
    result = run(*options)
    assert result.returncode == 2
    assert message in " ".join(result.stderr.split())


def test_a_mistake_in_a_scenario_names_its_place(tmp_path: Path) -> None:
    file = tmp_path / "cell.toml"
    file.write_text('[robots.left]\nseries = "e"\ntimeline = """\n1 power off\n2 power up\n"""\n')
    result = run("--scenario", str(file))
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == f"Error: {file}:5: `power up`: 'up' is not one of on, off, release\n"


def test_a_recording_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    result = run("--replay", str(tmp_path / "none.csv"))
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr == f"gatewayd: {tmp_path}/none.csv: cannot be read: No such file or directory\n"


def test_models_are_those_that_the_kinematics_know() -> None:
    assert _MODELS == MODELS


def test_the_help_explains_rules_and_commands() -> None:
    text = run("--help").stdout
    for words in ("TARGET = count SOURCE", "drop-clients", "--text-on-connect", "Exit codes:"):
        assert words in text
