"""`gatewayd simulate` as a process."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import IO, TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.simulator.conftest import Client, Process


async def test_it_serves_clients_and_takes_commands(
    process: Callable[..., Process], client: type[Client]
) -> None:
    simulator = process("--program", "output_int_register_0 = input_int_register_0 * 2")
    async with client(simulator.port) as one:
        await one.stream("timestamp", "output_int_register_0")
        assert simulator.do("set input_int_register_0 21") == "ok"
        await one.until(lambda values: values[1] == 42)
        assert simulator.do("clients") == "ok 1"
        assert simulator.do("drop-clients") == "ok 1"
        await one.ended()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_ends_it_cleanly(process: Callable[..., Process], number: signal.Signals) -> None:
    simulator = process()
    simulator.popen.send_signal(number)
    output, errors = simulator.popen.communicate(timeout=10)
    assert (simulator.popen.returncode, output, errors) == (0, "", "")


def run(commands: str | None = None, stdin: int | IO[str] | None = None) -> subprocess.CompletedProcess[str]:
    """A run that ends by itself, with commands as text or from somewhere else."""
    command = [sys.executable, "-m", "gatewayd", "simulate", "--port", "0", "--control", "stdin"]
    return subprocess.run(
        command, input=commands, stdin=stdin, capture_output=True, text=True, timeout=30, check=False
    )


def test_quit_ends_it() -> None:
    ended = run("clients\n\nquit\nclients\n")
    assert (ended.returncode, ended.stdout.splitlines()[1:]) == (0, ["ok 0", "ok"])


def test_the_end_of_input_ends_it_also_when_it_is_a_file(tmp_path: Path) -> None:
    script = tmp_path / "commands"
    script.write_text("get robot_mode\n")
    with script.open() as lines:
        ended = run(stdin=lines)
    assert (ended.returncode, ended.stdout.splitlines()[1:]) == (0, ["ok 7"])
    assert run(stdin=subprocess.DEVNULL).returncode == 0


def test_a_line_without_end_is_refused() -> None:
    ended = run("get " + "x" * 200_000 + "\nclients\n")
    assert ended.returncode == 0
    assert ended.stdout.splitlines()[1].startswith("error ")
    assert ended.stdout.splitlines()[-1] == "ok 0"


def test_faults_of_lists_and_connections_can_be_declared(process: Callable[..., Process]) -> None:
    """`--strict-lists` without a way means what it meant before there were several."""
    simulator = process(
        "--strict-lists",
        *("--drop-at", "outputs:2", "--drop-times", "0"),
        *("--unreadable", "input_int_register_0", "--delay", "0.01", "--creep"),
    )
    assert simulator.do("clients") == "ok 0"
    assert simulator.stop() == 0
