"""Mapping files are read, checked and compiled by a process of their own, which ends with its work.

Nobody else ends it: signals, which a terminal and a service manager send to it as well, do not reach it. When this
process is gone, however that came, it ends too.

What is needed for that would be a third of the gateway's memory, and on its loop or beside it the work would take time
from the robots. Whatever a file does to that process, the gateway goes on with the mapping it has.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, Self

import gatewayd

if TYPE_CHECKING:
    from pathlib import Path

    from gatewayd.mapping.compiled import Compiled

LIMIT = 20.0
"""Seconds that all files together may take; hundreds take two."""

_BOOT = """
import gc, os, sys, threading
gc.disable()
sys.path.insert(0, sys.argv.pop(1))
from gatewayd.mapping.worker import main, names_from
names = names_from(sys.stdin.buffer)
threading.Thread(target=lambda: os.read(0, 1) or os._exit(1), daemon=True).start()
main(names)
sys.stdout.flush()
os._exit(0)
"""
"""Isolated (-I), so that no environment variable and no directory decides what is imported; this very gatewayd is.
What lives for a moment needs no collection of garbage, and is not taken apart at its end. Standard input ends when who
started it ends."""
_LOOK = 0.05
"""Seconds between two looks whether the result is still wanted."""
_ROOT = os.path.dirname(os.path.dirname(gatewayd.__file__))  # noqa: PTH120 - pathlib takes 3 ms to import


class CompilationError(Exception):
    """The process could not do its work; the text says what became of it, and what to do."""


class Compilation:
    """Files on their way to plans: the process runs from the beginning, and not beyond the end of the `with`.

    Most of its time goes into importing what reads, so it may be started before it is known which files are meant.
    """

    def __init__(self, names: Iterable[Path] | None = None) -> None:
        """Where there can be no such process, `result` says so: at an early start there is no log yet."""
        self._process: subprocess.Popen[bytes] | None = None
        self._failure: Exception | None = None
        self._asked = self._ended = False
        try:
            self._process, self._lifeline = _start()
        except (OSError, ValueError) as error:
            self._failure = error
        if names is not None:
            self.read(names)

    def read(self, names: Iterable[Path]) -> None:
        """Say which files are meant; to be called once, unless it was said at the beginning."""
        if self._process is None:
            return
        lines = "".join(f"{os.fsencode(name).hex()}\n" for name in names)
        with suppress(BrokenPipeError):  # what became of it, `result` tells
            _write(self._lifeline, f"{lines}\n".encode())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        if self._process is None or self._ended:
            return
        self._ended = True
        # Whoever waits in `result`, maybe in another thread, comes back by this and closes the pipes.
        self._process.kill()
        os.close(self._lifeline)
        if not self._asked:
            self._process.communicate()

    def result(self, given_up: Callable[[], bool] = lambda: False) -> Compiled:
        """What the files come to. Waits until it is `given_up`; to be called once. Raises CompilationError."""
        import pickle  # noqa: PLC0415 - while the other process works

        from gatewayd.mapping.compiled import Compiled  # noqa: PLC0415

        self._asked = True
        process = self._process
        if process is None:
            text = f"the process that reads the mapping files cannot be started: {self._failure}"
            raise CompilationError(text) from self._failure
        answer, errors = _communicate(process, given_up)
        if process.returncode:
            last = errors.decode("utf-8", "replace").strip().rpartition("\n")[2]
            raise CompilationError(
                f"the process that reads the mapping files ended with {_ending(process.returncode)}"
                f"{f': {last}' if last else ''}; try `gatewayd check`"
            )
        compiled = pickle.loads(answer)  # noqa: S301 - written by our own code in our own process
        assert isinstance(compiled, Compiled)
        return compiled


def _communicate(process: subprocess.Popen[bytes], given_up: Callable[[], bool]) -> tuple[bytes, bytes]:
    """Output and errors of the process, once it has ended."""
    until = time.monotonic() + LIMIT
    while True:
        try:
            return process.communicate(timeout=_LOOK)
        except subprocess.TimeoutExpired:
            late = time.monotonic() >= until
            if not late and not given_up():
                continue
        process.kill()
        process.communicate()
        raise CompilationError(
            f"reading the mapping files takes longer than {LIMIT:g} s: does `gatewayd check` end?"
            if late
            else "reading the mapping files was given up"
        )


def _write(descriptor: int, data: bytes) -> None:
    while data:
        data = data[os.write(descriptor, data) :]


def _start() -> tuple[subprocess.Popen[bytes], int]:
    """The process, and the descriptor by which it learns what to read, and whose end is its end too."""
    theirs, ours = os.pipe()
    # It inherits what this thread blocks: from its first instruction on no signal reaches it.
    former = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    try:
        process = subprocess.Popen(  # noqa: S603 - this interpreter, and what stands above
            [sys.executable, "-I", "-c", _BOOT, _ROOT],
            stdin=theirs,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
    except BaseException:
        os.close(ours)
        raise
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, former)
        os.close(theirs)
    return process, ours


def _ending(code: int) -> str:
    return f"signal {-code}" if code < 0 else f"exit code {code}"
