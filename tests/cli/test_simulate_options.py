"""The robots that options of `gatewayd simulate` ask for; `test_simulate` runs the command."""

from __future__ import annotations

from pathlib import Path

import click
import pytest

from gatewayd.cli.simulate import command
from gatewayd.cli.simulate_options import MistakeInFileError, UnreadableRecordingError, robots_of
from gatewayd.simulator.fleet import Robots


def robots(*arguments: str) -> Robots:
    context = command.make_context("simulate", list(arguments))
    options = {name: value for name, value in context.params.items() if name not in ("control", "quiet")}
    return robots_of(context, **options)


def test_a_port_each_makes_a_robot_each() -> None:
    assert list(robots("--port", "0", "--port", "0")) == ["robot1", "robot2"]


@pytest.mark.parametrize(
    "arguments, reason",
    [
        (["--loop"], "--loop needs --replay FILE"),
        (
            ["--scenario", "a.toml", "--freeze"],
            "--freeze has no meaning beside --scenario: write it in the file",
        ),
        (["--replay", "a.csv", "--program", "demo"], "--program has no meaning beside --replay"),
        (["--drop-at", "nowhere"], "nowhere"),
        (
            ["--stepped", "--speed", "2"],
            "--speed has no meaning beside --stepped: time passes by the command",
        ),
    ],
)
def test_options_that_contradict_themselves_are_named(arguments: list[str], reason: str) -> None:
    with pytest.raises(click.UsageError) as refused:
        robots(*arguments)
    assert reason in refused.value.format_message()


def test_files_say_what_is_wrong_with_them(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("[")
    with pytest.raises(MistakeInFileError, match="file"):
        robots("--scenario", str(path))
    with pytest.raises(UnreadableRecordingError, match="file"):
        robots("--replay", str(path))
    with pytest.raises(MistakeInFileError, match="file"):
        robots("--program-file", str(path))
