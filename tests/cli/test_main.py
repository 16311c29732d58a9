"""The `gatewayd` command as a process: help, completion, exit codes, and no traceback whatever happens."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import click
import pytest

import gatewayd
from gatewayd.cli import COMMANDS, command

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def run() -> Run:
    """Run `python -m gatewayd ARGS` with extra environment variables."""

    def start(*args: str, **environment: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "gatewayd", *args],
            capture_output=True,
            text=True,
            check=False,
            timeout=30,
            env=os.environ | environment,
        )

    return start


def test_help_teaches_the_first_five_commands_and_the_exit_codes(run: Run) -> None:
    done = run("--help")
    assert done.returncode == 0
    assert "Five commands from nothing to a running cell:" in done.stdout
    assert "Exit codes:" in done.stdout
    for name, text in COMMANDS.items():
        assert name in done.stdout
        assert text in done.stdout


@pytest.mark.parametrize("arguments", [["--help"], ["export", "--help"]])
def test_help_imports_no_library_but_click(arguments: list[str]) -> None:
    script = (
        f"import sys; sys.argv={['gatewayd', *arguments]!r}\n"
        "from gatewayd.__main__ import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'gatewayd.mapping.tables', 'pymodbus', 'rich', 'ruamel', 'asyncio'} & set(sys.modules)\n"
        "sys.exit(' '.join(sorted(heavy)) or 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=30
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_version(run: Run) -> None:
    assert run("--version").stdout == f"gatewayd {gatewayd.__version__}\n"


def test_console_script_is_the_same_command() -> None:
    script = Path(sys.executable).with_name("gatewayd")
    if not script.exists():
        pytest.skip("gatewayd is not installed, it runs from its source tree")
    done = subprocess.run([script, "--version"], capture_output=True, text=True, check=True, timeout=30)
    assert done.stdout == f"gatewayd {gatewayd.__version__}\n"


def test_unknown_command_is_wrong_usage(run: Run) -> None:
    done = run("frobnicate")
    assert done.returncode == 2
    assert "No such command 'frobnicate'" in done.stderr


def test_a_misspelt_command_is_answered_with_the_right_one(run: Run) -> None:
    assert "Did you mean 'check'?" in run("chekc").stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_every_listed_command_can_be_imported_and_has_help(name: str) -> None:
    found = command.get_command(click.Context(command), name)
    assert isinstance(found, click.Command)
    assert found.name == name
    assert found.help


def test_every_command_module_is_listed() -> None:
    """A module of gatewayd/cli, or of the folder of a group, with a `command` is in the table of its group."""
    folder = Path(gatewayd.__file__).parent / "cli"
    commands = re.compile(r"^(command = |def command\()", re.MULTILINE)
    for group in (path.parent for path in folder.rglob("__init__.py")):
        inner = {path.parent.name: path for path in group.glob("*/__init__.py")}
        inner |= {path.stem: path for path in group.glob("*.py") if path.stem != "__init__"}
        found = {name for name, path in inner.items() if commands.search(path.read_text())}
        package = import_module(".".join(("gatewayd", *group.relative_to(folder.parent).parts)))
        assert {"import" if name == "importing" else name for name in found} == set(
            getattr(package, "COMMANDS", ())
        )


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_a_script_and_how_to_keep_it(run: Run, shell: str) -> None:
    done = run("completion", shell)
    assert done.returncode == 0
    assert "_GATEWAYD_COMPLETE" in done.stdout
    assert done.stdout.splitlines()[-1].startswith("# To keep it, once:  gatewayd completion")


def test_completion_offers_commands_without_importing_them(run: Run) -> None:
    done = run(_GATEWAYD_COMPLETE="bash_complete", COMP_WORDS="gatewayd c", COMP_CWORD="1")
    assert done.stdout.split() == ["plain,check", "plain,completion"]


def test_rules_are_completed_by_id_and_by_name(run: Run) -> None:
    for begun, whole in (("gw21", "GW214"), ("bit-in", "bit-in-number")):
        words = f"gatewayd check --explain {begun}"
        done = run(_GATEWAYD_COMPLETE="bash_complete", COMP_WORDS=words, COMP_CWORD="3")
        assert f"plain,{whole}" in done.stdout.split()


BROKEN = """
import sys
import click
from gatewayd.__main__ import main
from gatewayd.cli import command

@click.command("broken")
def broken():
    {what}

command.add_command(broken)
type(command).get_command = lambda self, ctx, name: broken
sys.argv = ["gatewayd", "broken"]
main()
"""


DEFECT = "gatewayd: internal error: {} (<string>:9); please report with the log\n"


@pytest.mark.parametrize(
    "what, code, message",
    [
        ("1 / 0", 70, DEFECT.format("ZeroDivisionError: division by zero")),
        ("raise ValueError('two\\nlines')", 70, DEFECT.format("ValueError: two lines")),
        ("raise KeyboardInterrupt", 130, "\n"),
        ("raise RuntimeError('Error calling __set_name__') from KeyboardInterrupt()", 130, ""),
        ("raise click.ClickException('no')", 1, "Error: no\n"),
        (
            "raise click.UsageError('no')",
            2,
            "Usage: gatewayd broken [OPTIONS]\nTry 'gatewayd broken --help' for help.\n\nError: no\n",
        ),
        ("raise BrokenPipeError", 1, ""),
        ("click.get_current_context().exit(1)", 1, ""),
        ("sys.exit(3)", 3, ""),
        ("return 1", 1, ""),
        ("return None", 0, ""),
    ],
)
def test_whatever_a_command_does_ends_in_one_message_and_an_exit_code(
    what: str, code: int, message: str
) -> None:
    done = subprocess.run(
        [sys.executable, "-c", BROKEN.format(what=what)],
        capture_output=True,
        text=True,
        check=False,
        timeout=30,
    )
    assert (done.returncode, done.stderr) == (code, message)


def test_internal_error_shows_its_traceback_on_request() -> None:
    done = subprocess.run(
        [sys.executable, "-c", BROKEN.format(what="1 / 0")],
        capture_output=True,
        text=True,
        check=False,
        timeout=30,
        env=os.environ | {"GATEWAYD_TRACEBACK": "1"},
    )
    assert done.stderr.startswith("Traceback")


def test_a_reader_that_goes_away_is_no_error() -> None:
    """`gatewayd --help | true` says nothing on stderr, whether or not the output was written in time."""
    process = subprocess.Popen(
        [sys.executable, "-m", "gatewayd", "--help"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    errors = process.stderr.read()
    assert process.wait(30) in (0, 1)
    assert errors == ""


def test_ctrl_c_in_a_process() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", BROKEN.format(what="print('up', flush=True); __import__('time').sleep(20)")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "up\n"
    began = time.monotonic()
    process.send_signal(signal.SIGINT)
    assert process.wait(10) == 130
    assert time.monotonic() - began < 5
    assert process.stderr is not None
    assert "Traceback" not in process.stderr.read()


def test_an_interrupt_that_python_cannot_raise_comes_once_more() -> None:
    """As in the callbacks of imports, where it would be printed and forgotten."""
    program = """
import sys, time
from gatewayd import __main__

class Callback:
    def __del__(self):
        raise KeyboardInterrupt

def command():
    Callback()
    time.sleep(60)

__main__._command = command
sys.argv[1:] = ["check"]
__main__.main()
"""
    ended = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=30, check=False
    )
    assert (ended.returncode, ended.stderr) == (130, "")
