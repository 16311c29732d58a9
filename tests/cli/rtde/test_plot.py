"""`gatewayd rtde plot` as a person uses it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli import command
from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording import create_recording


def plot(*arguments: object) -> Result:
    return CliRunner().invoke(command, ["rtde", "plot", *map(str, arguments)], prog_name="gatewayd")


def recorded(path: Path, *names: str) -> Path:
    recipe = Recipe(names, [OUTPUTS[name].type for name in names])
    with create_recording(path, recipe) as recording:
        for number in range(50):
            row = recipe.unpack(bytes(recipe.size))
            changed = {"timestamp": number / 500, "runtime_state": 2 if 10 <= number < 30 else 1}
            places = {
                recipe.slots[name].start: value for name, value in changed.items() if name in recipe.slots
            }
            recording.write([places.get(place, value) for place, value in enumerate(row)])
    return path


@pytest.fixture
def source(tmp_path: Path) -> Path:
    return recorded(tmp_path / "robot_data.csv", "timestamp", "actual_q", "runtime_state")


def test_a_picture_stands_beside_the_recording(source: Path, tmp_path: Path) -> None:
    done = plot(source)
    assert (done.exit_code, done.stderr) == (0, "")
    assert done.stdout == f"{tmp_path / 'robot_data.png'}: 7 panels, 50 packages\n"
    assert (tmp_path / "robot_data.png").read_bytes().startswith(b"\x89PNG")


def test_fields_title_and_filter(source: Path, tmp_path: Path) -> None:
    out = tmp_path / "x.svg"
    done = plot(source, "-f", "actual_q[2]", "--running", "--title", "press 3", "-o", out)
    assert done.stdout == f"{out}: 1 panel, 20 packages\n"
    assert ">press 3<" in out.read_text()
    assert ">actual_q, elbow in rad<" in out.read_text()


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["-f", "actual_qd"], "the recording has no actual_qd; it has timestamp, actual_q, runtime_state"),
        (["-o", "x.gif"], "'x.gif' is no picture that can be drawn: name it .png, .svg or .pdf"),
    ],
)
def test_wrong_usage(source: Path, arguments: list[str], message: str) -> None:
    done = plot(source, *arguments)
    assert done.exit_code == 2
    assert message in done.stderr


def test_several_recordings_in_one_picture(source: Path, tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    other = recorded(tmp_path / "b" / source.name, "runtime_state", "timestamp", "payload")
    refused = plot(source, other, "-f", "runtime_state")
    assert refused.exit_code == 2
    assert "name the picture of several recordings with -o" in refused.stderr
    out = tmp_path / "x.svg"
    done = plot(source, other, "-f", "runtime_state", "-f", "payload", "-o", out)
    assert (done.exit_code, done.stdout) == (0, f"{out}: 2 panels, 100 packages\n")
    assert f">{source}: runtime_state<" in out.read_text()
    assert f">{other}: runtime_state<" in out.read_text()


def test_an_existing_picture_wants_force(source: Path, tmp_path: Path) -> None:
    (tmp_path / "robot_data.png").write_text("precious")
    refused = plot(source)
    assert (refused.exit_code, (tmp_path / "robot_data.png").read_text()) == (2, "precious")
    assert plot(source, "--force", "-f", "runtime_state").exit_code == 0


def test_a_filter_needs_something_to_filter_by(tmp_path: Path) -> None:
    done = plot(recorded(tmp_path / "x.csv", "timestamp", "robot_mode"), "--running")
    assert done.exit_code == 2
    assert "--running needs runtime_state or robot_status_bits, which " in done.stderr


def test_too_many_panels_are_answered_with_the_fields(tmp_path: Path) -> None:
    names = [name for name, field in OUTPUTS.items() if field.type.count == 6][:16]
    done = plot(recorded(tmp_path / "x.csv", *names))
    assert done.exit_code == 2
    assert (
        "panels are more than fit in a picture; choose some with --field: target_q, target_qd" in done.stderr
    )


def test_nothing_to_draw(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("timestamp runtime_state\n0.0 1\n")
    done = plot(path, "--running")
    assert done.exit_code == 1
    assert done.stderr == f"{path}: no package while a program ran: nothing was drawn\n"
    assert not (tmp_path / "x.png").exists()


def test_a_recording_that_cannot_be_read_and_one_that_is_torn(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("timestamp robot_mode\n0.0 1\n0.1 x\n")
    done = plot(path)
    assert (done.exit_code, (tmp_path / "x.png").exists()) == (1, False)
    assert done.stderr.startswith(f"{path}:3: 'x' in column robot_mode is no INT32")
    path.write_text("timestamp robot_mode\n0.0 1\n0.1")
    done = plot(path)
    assert (done.exit_code, done.stderr) == (0, f"{path}:3: the last line is not whole and was left out\n")


def test_without_matplotlib(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = plot(source)
    assert done.exit_code == 2
    assert "pip install 'gatewayd[plot]'" in done.stderr
