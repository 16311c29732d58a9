"""The commands that stand for the other clients' scripts, in this process, at a simulated robot in a thread."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli import command
from gatewayd.cli.rtde import gateway_processes as module
from gatewayd.cli.rtde import set as set_command
from gatewayd.rtde.fields import INPUTS, OUTPUTS, Series, SoftwareVersion
from gatewayd.rtde.recording import open_recording
from gatewayd.simulator.double import SimulatedRobot

Rtde = Callable[..., Result]


@pytest.fixture
def rtde(robot: SimulatedRobot) -> Rtde:
    """`gatewayd rtde NAME`; `HOST` in the arguments is the simulated robot."""

    def run(*arguments: str | Path, good: bool = True) -> Result:
        place = f"{robot.host}:{robot.port}"
        line = ["rtde", *(str(each).replace("HOST", place) for each in arguments)]
        done = CliRunner().invoke(command, line, prog_name="gatewayd")
        assert (done.exit_code == 0) == good, done.output
        return done

    return run


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "robot_data.csv"


def packages(path: Path) -> list[tuple[float, ...]]:
    with open_recording(path) as found:
        return [tuple(map(float, values)) for values in found]


def test_record_host_and_output(rtde: Rtde, out: Path) -> None:
    """`gatewayd rtde record HOST OUT`: every package, none left out but by the controller."""
    done = rtde("record", "HOST", out, "-f", "robot_mode", "--samples", "20")
    assert done.stdout.startswith(f"{out}: 20 packages in ")
    found = packages(out)
    assert {mode for _, mode in found} == {7.0}
    steps = {round((b[0] - a[0]) * 500) for a, b in pairwise(found)}
    assert (steps == {1}) == ("none skipped" in done.stdout)


def test_record_port(rtde: Rtde, robot: SimulatedRobot, out: Path) -> None:
    """Behind the host, as HOST:PORT."""
    refused = rtde("record", f"{robot.host}:1", out, "--samples", "1", good=False)
    assert f"{robot.host}:1" in refused.output
    rtde("record", f"{robot.host}:{robot.port}", out, "--samples", "1")
    assert len(packages(out)) == 1


@pytest.mark.parametrize("samples", [1, 7])
def test_record_samples(rtde: Rtde, out: Path, samples: int) -> None:
    rtde("record", "HOST", out, "-f", "robot_mode", "--samples", str(samples))
    assert len(packages(out)) == samples


@pytest.mark.parametrize("frequency, step", [("125", 4), ("250", 2)])
def test_record_frequency(rtde: Rtde, out: Path, frequency: str, step: int) -> None:
    rtde("record", "HOST", out, "-f", "robot_mode", "--samples", "3", "--frequency", frequency)
    times = [time for time, _ in packages(out)]
    steps = [round((b - a) * 500) for a, b in pairwise(times)]
    assert all(each % step == 0 for each in steps)
    assert min(steps) == step


def test_record_config(rtde: Rtde, out: Path, tmp_path: Path) -> None:
    """The Python client's XML, with its key and its types, which are compared."""
    config = tmp_path / "record_configuration.xml"
    text = (
        '<?xml version="1.0"?><rtde_config><recipe key="out"><field name="timestamp" type="DOUBLE"/>'
        '<field name="robot_mode" type="INT32"/></recipe></rtde_config>'
    )
    config.write_text(text)
    rtde("record", "HOST", out, "--config", config, "--key", "out", "--samples", "2")
    assert out.read_text().splitlines()[0] == "timestamp robot_mode"
    config.write_text(text.replace("INT32", "UINT32"))
    refused = rtde("record", "HOST", tmp_path / "y.csv", "--config", config, "--samples", "2", good=False)
    assert "robot_mode was declared as UINT32, the controller has INT32" in refused.output


def test_record_config_of_every_field(out: Path) -> None:
    """As the Python client's own files have them: every field by itself, with tabs, empty lines and comments."""
    names = [name for name, field in OUTPUTS.items() if field.available(Series.E, SoftwareVersion(5, 26))]
    assert len(names) > 300
    fields = "\n".join(f'\t\t<field name="{name}" type="{OUTPUTS[name].type.word}"/>\n' for name in names)
    text = (
        f'<?xml version="1.0"?>\n<rtde_config>\n\t<recipe key="out">\n\t\t<!-- all -->\n{fields}\t</recipe>\n'
    )
    config = out.with_name("record_configuration_v3.xml")
    config.write_text(f"{text}</rtde_config>\n")
    with SimulatedRobot(version="5.26") as robot:
        line = [
            "rtde",
            "record",
            f"{robot.host}:{robot.port}",
            str(out),
            "--config",
            str(config),
            "--samples",
            "2",
        ]
        done = CliRunner().invoke(command, line, prog_name="gatewayd")
    assert done.exit_code == 0, done.output
    with open_recording(out) as found:
        assert found.recipe.names == tuple(names)
        assert len(list(found)) == 2


def test_record_binary(rtde: Rtde, tmp_path: Path) -> None:
    path = tmp_path / "robot_data.bin"
    rtde("record", "HOST", path, "-f", "robot_mode", "--samples", "2", "--binary")
    assert path.read_bytes().startswith(b"timestamp robot_mode\nDOUBLE INT32\n")
    assert [mode for _, mode in packages(path)] == [7.0, 7.0]


def test_record_help(rtde: Rtde) -> None:
    text = rtde("record", "--help").stdout
    for option in ("--samples", "--frequency", "--config", "--binary", "--quiet"):
        assert option in text
    assert "[HOST] [OUT]" in text


def test_record_takes_the_protocol_of_the_controller(out: Path) -> None:
    """`gatewayd rtde record` has no --protocol-version: one that speaks version 1 alone is recorded all the same."""
    with SimulatedRobot(series="cb3", faults={"protocol_v1": True}) as old:
        line = ["rtde", "record", f"{old.host}:{old.port}", str(out), "-f", "robot_mode", "--samples", "2"]
        done = CliRunner().invoke(command, line, prog_name="gatewayd")
        assert done.exit_code == 0, done.output
    assert [mode for _, mode in packages(out)] == [7.0, 7.0]


def test_info_has_the_properties_in_words(rtde: Rtde) -> None:
    """`gatewayd rtde info HOST`."""
    lines = rtde("info", "--seconds", "0.1", "HOST").stdout.splitlines()
    found = [line.split(maxsplit=1)[1] for line in lines if line.startswith("property")]
    assert [line.split(" = ")[0] for line in found] == [
        "v1.software.version",
        "v1.control_box.type",
        "v1.robot_arm.tool_flange.type",
    ]
    assert found[0] == "v1.software.version = 5.26.0"
    assert " = type " in found[1]
    assert "subtype" in found[1]
    assert "revision" in found[2]


def test_info_takes_host_and_port(rtde: Rtde, robot: SimulatedRobot) -> None:
    """`gatewayd rtde info HOST:PORT`."""
    found = json.loads(rtde("info", "--json", "--seconds", "0.1", f"{robot.host}:{robot.port}").stdout)
    assert found["controller"] == f"{robot.host}:{robot.port}"
    refused = rtde("info", f"{robot.host}:1", good=False)
    assert f"{robot.host}:1" in refused.output


def test_fields_has_type_unit_and_description(rtde: Rtde) -> None:
    """`gatewayd rtde fields`: the catalogue of the library, `OUTPUTS` and `INPUTS`."""
    rows = list(csv.DictReader(io.StringIO(rtde("fields", "--format", "csv", "--version", "5.26").stdout)))
    found = {(row["direction"], row["name"]): row for row in rows}
    for direction, name in (("output", "payload"), ("input", "speed_slider_fraction")):
        field = (OUTPUTS if direction == "output" else INPUTS)[name]
        row = found[direction, name]
        assert (row["type"], row["unit"], row["comment"]) == (field.type.word, field.unit, field.comment)
        assert field.comment


@pytest.mark.parametrize("level", ["info", "warning", "error"])
def test_message_has_source_and_level(
    rtde: Rtde, robot: SimulatedRobot, caplog: pytest.LogCaptureFixture, level: str
) -> None:
    """`gatewayd rtde message HOST TEXT --level --source`."""
    caplog.set_level("INFO")
    done = rtde("message", "HOST", "gripper changed", "--level", level, "--source", "line 3")
    assert done.stdout == f"sent at level {level}\n"
    while robot.clients:
        pass
    number = ["exception", "error", "warning", "info"].index(level)
    assert f"(level {number}) line 3: gripper changed" in caplog.text


def test_set_verifies_what_it_writes(
    rtde: Rtde, robot: SimulatedRobot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """`gatewayd rtde set`: registers 64, 24 and 24, as the C++ client's example of a round trip."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(
        module, "gateway_processes", tuple
    )  # those of this machine are no matter of this test
    robot.overwrite("runtime_state", "STOPPED")
    assignments = ("input_bit_register_64=on", "input_int_register_24=5", "input_double_register_24=0.5")
    assert "input_double_register_24 = 0.5" in rtde("set", "HOST", *assignments).stdout
    assert robot.get("input_bit_register_64") is True
    assert (robot.get("input_int_register_24"), robot.get("input_double_register_24")) == (5, 0.5)
    monkeypatch.setattr(set_command, "_PATIENCE", 0.05)
    robot.overwrite("input_int_register_24", 6)
    refused = rtde("set", "HOST", "input_int_register_24=7", good=False)
    assert "input_int_register_24 is 6, not 7" in refused.output
