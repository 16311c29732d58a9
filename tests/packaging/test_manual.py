"""The manual page says what the commands say."""

from __future__ import annotations

import re
import shutil
import subprocess

import click
import pytest

from gatewayd.cli import COMMANDS, command
from tests.packaging.programs import program

manual = program("manual")
PAGE = manual.page("2026-01-02")


def test_every_command_and_option_is_there() -> None:
    root = click.Context(command, info_name="gatewayd")
    for name in COMMANDS:
        found = command.get_command(root, name)
        assert found is not None
        text = PAGE.partition(f".SS {name}\n")[2].partition(".SS ")[0]
        for parameter in found.params:
            if isinstance(parameter, click.Option):
                assert all(option.replace("-", "\\-") in text for option in parameter.opts), parameter.opts


@pytest.mark.parametrize(
    "name", ["export eds", "export dcf", "export urscript", "locks take", "locks release"]
)
def test_commands_of_commands_are_there(name: str) -> None:
    text = PAGE.partition(f".SS {name}\n")[2].partition(".SS ")[0]
    assert text.startswith(f".B gatewayd {name}\n"), text


def test_options_have_their_variables() -> None:
    assert re.search(r"\.B GATEWAYD_AUDIT\nStands for the option: run \\-\\-audit\.", PAGE)


def test_text_is_no_markup() -> None:
    assert manual.plain("a\\b\n.dot\n'quote -x") == "a\\eb\n\\&.dot\n\\&'quote \\-x"


@pytest.mark.skipif(shutil.which("man") is None, reason="man is missing (apt-get install man-db)")
def test_man_finds_no_mistake() -> None:
    done = subprocess.run(
        ["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", "-"],
        input=PAGE,
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8", "MANROFFSEQ": ""},
    )
    assert (done.returncode, done.stderr) == (0, "")
