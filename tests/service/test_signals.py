"""Every signal of the platform, sent to real gateways at several moments of their life, does what the table says."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gatewayd.service.signals import FORCED, TABLE, Effect, effect_of, name_of
from tests.e2e.plant import Plant
from tests.e2e.plc import PLC
from tests.e2e.processes import Daemon, Process, Simulator, wait_for

CELL = f"""\
writers:
  plc: {{modbus: {PLC}}}
variables:
  number: {{robot: input_int_register_0,  modbus: 0, owner: plc, on_release: 5}}
"""
ALL = sorted(signal.valid_signals())
BY_EFFECT = {effect: [number for number in ALL if effect_of(number) is effect] for effect in Effect}
ENDING = [*BY_EFFECT[Effect.STOP], *BY_EFFECT[Effect.END]]
HARMLESS = [
    signal.SIGCONT,  # first: the system forgets a waiting SIGTSTP when it comes
    signal.SIGCHLD,
    signal.SIGURG,
    signal.SIGWINCH,
    *BY_EFFECT[Effect.RELOAD],
    *BY_EFFECT[Effect.IGNORED],
    *BY_EFFECT[Effect.SILENT],
]
SOME_IGNORED = [signal.SIGUSR1, signal.SIGALRM, signal.SIGTSTP, signal.SIGRTMIN, signal.SIGRTMAX]


def test_the_table_has_every_signal_that_the_platform_names() -> None:
    """A new one would be ignored with a line in the log; here somebody decides."""
    assert {one.name for one in signal.Signals} - {"SIGRTMIN", "SIGRTMAX"} <= TABLE.keys()
    assert name_of(signal.SIGRTMIN + 3) == "SIGRTMIN+3"
    assert effect_of(signal.SIGRTMIN + 3) is Effect.IGNORED


def dispositions(pid: int) -> dict[str, int]:
    """Masks of signals that are blocked, ignored and caught, as the kernel has them."""
    status = Path(f"/proc/{pid}/status").read_text("ascii")
    lines = dict(line.split(":\t", 1) for line in status.splitlines() if line.startswith("Sig"))
    return {name: int(text, 16) for name, text in lines.items() if name in ("SigBlk", "SigIgn", "SigCgt")}


def children(pid: int) -> list[int]:
    """Those that run their own program: until then a child holds its parent (vfork)."""
    found = Path(f"/proc/{pid}/task/{pid}/children").read_text("ascii").split()
    return [int(text) for text in found if b"\0-I\0" in Path(f"/proc/{text}/cmdline").read_bytes()]


@pytest.fixture(scope="module")
def simulator(lasting_plant: Plant) -> Simulator:
    """One for all daemons, which it outlives."""
    return lasting_plant.simulator()


@pytest.fixture
def served(plant: Plant, simulator: Simulator) -> tuple[Simulator, Daemon]:
    """A robot that has 42 from the PLC."""
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    assert plc.write_integers(0, 42) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 42, "the robot to have the value")
    return simulator, daemon


# -- while it serves ------------------------------------------------------------------------------------------------


def test_no_signal_that_can_be_caught_kills_while_it_serves(served: tuple[Simulator, Daemon]) -> None:
    simulator, daemon = served
    for number in HARMLESS:
        daemon.signal(number)
    for number in BY_EFFECT[Effect.IGNORED]:
        daemon.wait_for_line("signal ignored", f"signal={name_of(number)}")
    daemon.wait_for_line("nothing has changed")
    for number in SOME_IGNORED:
        daemon.signal(number)
    code, _seconds = daemon.stop()
    assert code == 0
    assert simulator.integer("input_int_register_0") == 5
    assert len(daemon.lines("signal ignored", "signal=SIGUSR1")) == 1, (
        "a storm of signals is no storm of lines"
    )
    assert "Traceback" not in daemon.text()


@pytest.mark.parametrize("number", ENDING, ids=name_of)
def test_what_ends_it_sends_the_fallbacks(served: tuple[Simulator, Daemon], number: signal.Signals) -> None:
    simulator, daemon = served
    daemon.signal(number)
    assert daemon.wait() == 0
    assert simulator.integer("input_int_register_0") == 5
    daemon.wait_for_line("stopping", f"signal={name_of(number)}")
    daemon.wait_for_line("stopped")
    assert "Traceback" not in daemon.text()


def test_while_it_ends_nothing_else_counts(plant: Plant, simulator: Simulator) -> None:
    """A robot that does not read keeps the end waiting; SIGHUP and the others do nothing, SIGTERM forces."""
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plant.ready_plc()
    daemon.signal(signal.SIGSTOP)
    for number in (signal.SIGTERM, *HARMLESS, signal.SIGPWR, signal.SIGXCPU):
        if number != signal.SIGCONT:
            daemon.signal(number)
    daemon.signal(signal.SIGCONT)
    assert daemon.wait() == 0
    assert "Traceback" not in daemon.text()


def test_a_second_request_forces(served: tuple[Simulator, Daemon]) -> None:
    _simulator, daemon = served
    daemon.signal(signal.SIGSTOP)
    daemon.signal(signal.SIGTERM)
    daemon.signal(signal.SIGINT)
    daemon.signal(signal.SIGCONT)
    assert daemon.wait() == FORCED
    assert "Traceback" not in daemon.text()


@pytest.mark.parametrize("number", [signal.SIGABRT, signal.SIGSEGV, signal.SIGSYS], ids=name_of)
def test_a_fault_ends_it_and_says_where(served: tuple[Simulator, Daemon], number: signal.Signals) -> None:
    _simulator, daemon = served
    daemon.signal(number)
    assert daemon.wait() == -number
    assert "most recent call first" in daemon.text()


# -- before it serves -----------------------------------------------------------------------------------------------


@pytest.fixture
def reading(plant: Plant) -> Process:
    """It waits for the process that reads the files: stopped, that one never comes to an end."""
    daemon = plant.run(plant.mapping(CELL, 1))
    wait_for(lambda: bool(children(daemon.pid)), "the process that reads the files")
    (child,) = children(daemon.pid)
    os.kill(child, signal.SIGSTOP)
    return daemon


@pytest.mark.parametrize("number", ENDING, ids=name_of)
def test_what_ends_it_while_the_files_are_read(reading: Process, number: signal.Signals) -> None:
    (child,) = children(reading.pid)
    reading.signal(number)
    assert reading.wait() == 0
    assert not Path(f"/proc/{child}").exists(), "the process that reads the files is left behind"
    reading.wait_for_line("stopped before anything was served", f"signal={name_of(number)}")
    assert "Traceback" not in reading.text()


def test_nothing_else_ends_it_while_the_files_are_read(plant: Plant, simulator: Simulator) -> None:
    daemon = plant.run(plant.mapping(CELL, simulator.port))
    wait_for(lambda: bool(children(daemon.pid)), "the process that reads the files")
    (child,) = children(daemon.pid)
    os.kill(child, signal.SIGSTOP)
    for number in HARMLESS:
        daemon.signal(number)
        os.kill(child, number) if number != signal.SIGCONT else None
    os.kill(child, signal.SIGCONT)
    daemon.wait_for_line("signal ignored", "signal=SIGUSR1")
    daemon.wait_for_line("nothing has changed")
    assert len(daemon.lines("nothing has changed")) == 1, "SIGHUP is remembered as one reload"
    assert daemon.stop()[0] == 0


def test_the_process_that_reads_the_files_hears_no_signal(reading: Process) -> None:
    (child,) = children(reading.pid)
    wanted = sum(1 << (number - 1) for number in ALL if number not in (signal.SIGKILL, signal.SIGSTOP))
    wait_for(lambda: dispositions(child)["SigBlk"] == wanted, "its mask; the kernel's own spawn blocks more")


def test_the_process_that_reads_the_files_does_not_outlive_a_kill(reading: Process) -> None:
    (child,) = children(reading.pid)
    reading.signal(signal.SIGKILL)
    reading.wait()
    os.kill(child, signal.SIGCONT)
    wait_for(lambda: not _is_alive(child), "the process that reads the files to end")


def _is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in ("Z", "X")
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("number", [*ENDING, signal.SIGHUP, signal.SIGUSR1, signal.SIGALRM], ids=name_of)
def test_signals_from_the_first_line_of_ours(
    plant: Plant, simulator: Simulator, number: signal.Signals
) -> None:
    """As soon as the kernel blocks them. What comes while Python itself starts is not ours to decide."""
    daemon = plant.run(plant.mapping(CELL, simulator.port))
    bit = 1 << (number - 1)
    wait_for(lambda: bool(dispositions(daemon.pid)["SigBlk"] & bit), "the first line of ours")
    daemon.signal(number)
    if number not in ENDING:
        daemon.wait_for_line("listening for Modbus")
        daemon.signal(signal.SIGTERM)
    assert daemon.wait() == 0
    assert "Traceback" not in daemon.text()


@pytest.mark.parametrize("step", range(24))
def test_sigterm_at_any_moment_of_the_start(plant: Plant, simulator: Simulator, step: int) -> None:
    """A robot that had a value when the links were up gets the fallback; none of the moments leaves a traceback."""
    daemon = plant.run(plant.mapping(CELL, simulator.port))
    bit = 1 << (signal.SIGTERM - 1)
    wait_for(lambda: bool(dispositions(daemon.pid)["SigBlk"] & bit), "the first line of ours")
    due = time.monotonic() + step * 0.05
    wait_for(lambda: time.monotonic() >= due or not daemon.running, "the moment")
    daemon.signal(signal.SIGTERM)
    assert daemon.wait() == 0
    text = daemon.text()
    assert "Traceback" not in text
    assert "stopp" in text, "before it serves, or in order"


def test_what_was_ignored_or_blocked_by_who_started_it_works_all_the_same(
    plant: Plant, simulator: Simulator
) -> None:
    """A shell without job control ignores SIGINT for `gatewayd run &`; nohup ignores SIGHUP."""
    mapping = plant.mapping(CELL, simulator.port)
    program = (
        "import os, signal, sys; signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM});"
        "[signal.signal(one, signal.SIG_IGN) for one in (signal.SIGINT, signal.SIGHUP)];"
        "os.execv(sys.executable, [sys.executable, '-m', 'gatewayd', 'run', sys.argv[1]])"
    )
    log = plant.directory / "ignored.log"
    for number in (signal.SIGINT, signal.SIGTERM):
        daemon = Process([sys.executable, "-c", program, str(mapping)], log)
        daemon.wait_for_line("listening for Modbus")
        daemon.signal(signal.SIGHUP)
        daemon.wait_for_line("nothing has changed")
        daemon.signal(number)
        assert daemon.wait() == 0
        daemon.kill()


# -- in a terminal --------------------------------------------------------------------------------------------------


@pytest.fixture
def in_terminal(plant: Plant, simulator: Simulator) -> tuple[int, int, Path, Simulator]:
    """In the foreground of a terminal of its own, serving; its log goes to a file."""
    log = plant.directory / "terminal.log"
    log.touch()
    command = [sys.executable, "-m", "gatewayd", "run", str(plant.mapping(CELL, simulator.port))]
    pid, master = pty.fork()
    if pid == 0:
        with log.open("wb") as stream:
            os.dup2(stream.fileno(), 2)
        os.execv(sys.executable, command)  # noqa: S606 - as a shell would
    return pid, master, log, simulator


def _exit_code(pid: int) -> int:
    ended = 0
    code = 0

    def has_ended() -> bool:
        nonlocal ended, code
        ended, code = os.waitpid(pid, os.WNOHANG)
        return ended == pid

    wait_for(has_ended, "the gateway to end")
    return os.waitstatus_to_exitcode(code)


def test_a_terminal_that_is_closed_ends_it_with_fallbacks_however_often_it_says_so(
    plant: Plant, in_terminal: tuple[int, int, Path, Simulator]
) -> None:
    pid, master, log, simulator = in_terminal
    wait_for(lambda: "listening for Modbus" in log.read_text(), "the gateway to listen")
    plc = plant.ready_plc()
    assert plc.write_integers(0, 42) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 42, "the robot to have the value")
    os.kill(pid, signal.SIGSTOP)
    os.close(master)  # the system's SIGHUP
    os.kill(pid, signal.SIGHUP)  # the shell's
    os.kill(pid, signal.SIGCONT)
    assert _exit_code(pid) == 0
    assert simulator.integer("input_int_register_0") == 5
    assert "stopped" in log.read_text()


@pytest.mark.parametrize("key", [b"\x03", b"\x1c"], ids=["Ctrl-C", "Ctrl-backslash"])
def test_keys_that_reach_the_whole_group_while_files_are_read(
    in_terminal: tuple[int, int, Path, Simulator], key: bytes
) -> None:
    pid, master, log, _simulator = in_terminal
    wait_for(lambda: _is_alive(pid) and bool(children(pid)), "the process that reads the files")
    os.write(master, key)
    assert _exit_code(pid) == 0
    os.close(master)
    assert "stopped before anything was served" in log.read_text()
    assert "Traceback" not in log.read_text()


# -- other commands -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments", [["--help"], ["check", "--explain", "all"], ["simulate", "--port", "0"]]
)
def test_ctrl_c_prints_no_traceback_at_any_moment(arguments: list[str]) -> None:
    for step in range(8):
        _interrupt(arguments, 0.02 + step * 0.04)


def _interrupt(arguments: list[str], after: float) -> None:
    """Before its first line it is Python's own start that would be interrupted, and that has a traceback."""
    imports = "import sys; from gatewayd.__main__ import main"
    ours = f"{imports}; sys.argv[1:] = {arguments}; print('ours', flush=True); main()"
    program = subprocess.Popen(
        [sys.executable, "-c", ours], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert program.stdout is not None
    assert program.stdout.readline() == "ours\n"
    due = time.monotonic() + after
    wait_for(lambda: time.monotonic() >= due or program.poll() is not None, "the moment")
    program.send_signal(signal.SIGINT)
    _output, errors = program.communicate(timeout=20)
    assert "Traceback" not in errors, errors
    assert program.returncode in (0, 130, -signal.SIGINT)
