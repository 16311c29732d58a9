"""Another process compiles; whatever becomes of it, the gateway hears of it in words."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from gatewayd.mapping import worker
from gatewayd.mapping.compiled import Compiled
from gatewayd.service import compilation
from gatewayd.service.compilation import Compilation, CompilationError

MAPPINGS = sorted((Path(__file__).parents[2] / "mappings").glob("*.yaml"))


def compiled(paths: Sequence[Path]) -> Compiled:
    with Compilation(paths) as one:
        return one.result()


def test_it_comes_to_the_same_as_here() -> None:
    assert compiled(MAPPINGS) == worker.compile_files(map(str, MAPPINGS))


def test_the_environment_and_the_directory_decide_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("gatewayd.py", "ruamel.py", "json.py", "sitecustomize.py"):
        (tmp_path / name).write_text("raise SystemExit(3)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("PYTHONSTARTUP", str(tmp_path / "json.py"))
    monkeypatch.chdir(tmp_path)
    assert compiled(MAPPINGS[:1]).plans


@pytest.mark.parametrize(
    "program, text",
    [
        ("import os; os.kill(os.getpid(), 9)", "ended with signal 9; try `gatewayd check`"),
        ("raise MemoryError", "ended with exit code 1: MemoryError; try `gatewayd check`"),
        ("import sys; sys.exit(3)", "ended with exit code 3; try `gatewayd check`"),
    ],
)
def test_a_process_that_dies_is_told(program: str, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilation, "_BOOT", program)
    with pytest.raises(CompilationError) as caught:
        compiled(MAPPINGS)
    assert str(caught.value) == f"the process that reads the mapping files {text}"


def test_a_process_that_does_not_end_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilation, "_BOOT", "import time; time.sleep(60)")
    monkeypatch.setattr(compilation, "LIMIT", 0.2)
    begin = time.monotonic()
    with pytest.raises(CompilationError, match=r"longer than 0\.2 s"):
        compiled(MAPPINGS)
    assert time.monotonic() - begin < 5


def test_a_process_that_cannot_be_started_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nonexistent/python")
    with pytest.raises(CompilationError, match=r"cannot be started: .*No such file or directory"):
        compiled(MAPPINGS)


def test_it_ends_with_whoever_needed_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilation, "_BOOT", "import time; time.sleep(60)")
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt), Compilation(MAPPINGS):
        raise KeyboardInterrupt
    assert time.monotonic() - begin < 5


async def test_a_cancellation_does_not_wait_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gateway that is told to stop during a reload stops; the thread that waits comes back by itself."""
    monkeypatch.setattr(compilation, "_BOOT", "import time; time.sleep(60)")

    async def reload() -> Compiled:
        with Compilation(MAPPINGS) as one:
            return await asyncio.to_thread(one.result)

    begin = time.monotonic()
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.2):
            await reload()
    await asyncio.get_running_loop().shutdown_default_executor()
    assert time.monotonic() - begin < 5


def test_the_daemon_has_nothing_of_it_in_memory() -> None:
    """Models and YAML were a third of what a gateway needed for the years in which it reads no file."""
    modules = (
        "service.daemon, service.operator, service.reload, service.watchdog, service.startup, "
        "web.launch, web.listener"
    )
    program = f"""
import subprocess
import sys
for name in {modules.split(", ")}:
    __import__("gatewayd." + name)
print(*sorted({{"ruamel", "rich", "can", "gatewayd.mapping.tables", "gatewayd.mapping.loader"}} & sys.modules.keys()))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_it_may_begin_before_it_is_known_what_to_read() -> None:
    with Compilation() as early:
        early.read(MAPPINGS[:1])
        assert early.result() == worker.compile_files([str(MAPPINGS[0])])


def test_more_names_than_a_pipe_holds_are_read(tmp_path: Path) -> None:
    names = [tmp_path / f"{'x' * 200}{number}.yaml" for number in range(400)]
    assert len(compiled(names).unreadable) == len(names)


def test_one_that_was_never_told_what_to_read_ends_with_whoever_started_it() -> None:
    with Compilation() as early:
        process = early._process
    assert process is not None
    assert process.returncode == -9
