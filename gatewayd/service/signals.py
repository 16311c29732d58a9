"""What each signal does to `gatewayd run`, from its first line to its last: one table, and the handlers behind it.

A gateway that is killed silently leaves the robot with the last command and no fallback. So no signal that a process
can catch has the system's default effect here, but for faults of the process itself, which say where they happened.

They are blocked in every thread and taken one by one by a thread that waits for nothing else. A handler would run
between any two instructions of the main thread, and forty signals at a time would be forty handlers on one small stack.
What came is carried out by `follow` as soon as the loop turns; before that, `stopping` is what the start asks between
its steps. The process that reads the files inherits the blocked signals.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import threading
from contextlib import suppress
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

FORCED = 130
"""Exit code after a second signal that asks for the end."""


class Effect(Enum):
    """What a signal does."""

    STOP = "the gateway ends in order, with the fallbacks; a second one ends it at once, with exit code 130"
    END = "the gateway ends in order, with the fallbacks; further ones do nothing"
    RELOAD = (
        "the mapping files are read again, once the gateway serves; if its terminal is gone, it ends in order"
    )
    IGNORED = "nothing, but for a line in the log"
    SILENT = "nothing: the call that caused it reports the error"
    FATAL = "the process ends at once, and writes where it was to standard error"
    SYSTEM = "what the system does: nothing, or stop and continue"


TABLE: dict[str, Effect] = {
    "SIGTERM": Effect.STOP,
    "SIGINT": Effect.STOP,
    "SIGQUIT": Effect.STOP,
    "SIGPWR": Effect.END,
    "SIGXCPU": Effect.END,
    "SIGHUP": Effect.RELOAD,
    "SIGUSR1": Effect.IGNORED,
    "SIGUSR2": Effect.IGNORED,
    "SIGALRM": Effect.IGNORED,
    "SIGVTALRM": Effect.IGNORED,
    "SIGPROF": Effect.IGNORED,
    "SIGIO": Effect.IGNORED,
    "SIGSTKFLT": Effect.IGNORED,
    "SIGTSTP": Effect.IGNORED,
    "SIGPIPE": Effect.SILENT,
    "SIGXFSZ": Effect.SILENT,
    "SIGTTIN": Effect.SILENT,
    "SIGTTOU": Effect.SILENT,
    "SIGABRT": Effect.FATAL,
    "SIGBUS": Effect.FATAL,
    "SIGFPE": Effect.FATAL,
    "SIGILL": Effect.FATAL,
    "SIGSEGV": Effect.FATAL,
    "SIGSYS": Effect.FATAL,
    "SIGTRAP": Effect.FATAL,
    "SIGKILL": Effect.SYSTEM,
    "SIGSTOP": Effect.SYSTEM,
    "SIGCHLD": Effect.SYSTEM,
    "SIGCONT": Effect.SYSTEM,
    "SIGURG": Effect.SYSTEM,
    "SIGWINCH": Effect.SYSTEM,
}
"""Signal -> effect. SIGTSTP: a gateway that stands still guards nothing, so Ctrl-Z does not stop it. SIGABRT is also
what the watchdog of the service manager sends: then the place where the gateway hangs stands in the journal."""

_AWAITED = (Effect.STOP, Effect.END, Effect.RELOAD, Effect.IGNORED)
_ENABLED = {"SIGABRT", "SIGBUS", "SIGFPE", "SIGILL", "SIGSEGV"}
"""What `faulthandler.enable` covers."""


def name_of(number: int) -> str:
    """`SIGUSR1`, `SIGRTMIN+3`."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"SIGRTMIN+{number - signal.SIGRTMIN}"


def effect_of(number: int) -> Effect:
    """What the table says; a signal that it does not have (real-time signals) is ignored with a line in the log."""
    return TABLE.get(name_of(number), Effect.IGNORED)


class Signals:
    """The signals of this process. There is one, as there is one process."""

    def __init__(self) -> None:
        self.stopped_by = 0
        """The signal that asked for the end; 0: none has."""
        self._waiting: list[int] = []
        """Signals that `follow` has not carried out, each once."""
        self._may_force = False
        """Whether somebody asked for the end: a further request is a second one."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._carry_out: Callable[[int, Effect], None] | None = None
        self._in_terminal = False

    @property
    def stopping(self) -> bool:
        """Whether the end was asked for."""
        return bool(self.stopped_by)

    def install(self) -> None:
        """Give every signal its effect, whatever the parent process has set. To be called before there are threads."""
        self._in_terminal = _is_terminal()
        awaited = {number for number in signal.valid_signals() if effect_of(number) in _AWAITED}
        signal.pthread_sigmask(signal.SIG_SETMASK, awaited)
        threading.Thread(target=self._wait, args=(awaited,), name="signals", daemon=True).start()
        for number in signal.valid_signals():
            if effect_of(number) is Effect.SILENT:
                signal.signal(number, signal.SIG_IGN)
        _say_where_faults_happen()

    def follow(self, loop: asyncio.AbstractEventLoop, carry_out: Callable[[int, Effect], None]) -> None:
        """Have `carry_out` called in `loop` with each signal that is not silent, those before this call included."""
        self._loop, self._carry_out = loop, carry_out
        self._pass_on()

    def leave(self) -> None:
        """The loop ends: nothing is passed on any more. A second signal still forces."""
        self._loop = None

    # -- the thread ----------------------------------------------------------------------------------------------

    def _wait(self, awaited: set[signal.Signals | int]) -> None:
        while True:
            self._arrived(signal.sigwait(awaited))

    def _arrived(self, number: int) -> None:
        effect = effect_of(number)
        if effect is Effect.RELOAD and self._in_terminal and not _is_terminal():
            # Whoever closes the terminal in which it runs wants it gone. The shell and the system both say so: that is
            # no second signal.
            effect = Effect.END
        if effect is Effect.STOP:
            if self._may_force:
                os._exit(FORCED)
            self._may_force = True
        if self.stopped_by:
            return
        if effect in (Effect.STOP, Effect.END):
            self.stopped_by = number
        if number in self._waiting:
            return
        self._waiting.append(number)
        loop = self._loop
        if loop is not None:
            with suppress(RuntimeError):  # it was closed meanwhile
                loop.call_soon_threadsafe(self._pass_on)

    # -- the loop --------------------------------------------------------------------------------------------------

    def _pass_on(self) -> None:
        while self._waiting and self._carry_out is not None:
            number = self._waiting.pop(0)
            self._carry_out(number, Effect.END if number == self.stopped_by else effect_of(number))


def _is_terminal() -> bool:
    try:
        return os.isatty(0)
    except OSError:
        return False


def _say_where_faults_happen() -> None:
    """Have the place of a fault written to standard error; then it ends the process, as the system has it."""
    if sys.stderr is None:
        return
    faults = [number for number in signal.valid_signals() if effect_of(number) is Effect.FATAL]
    for number in faults:
        signal.signal(number, signal.SIG_DFL)
    with suppress(OSError, ValueError, RuntimeError):  # no standard error to write to
        faulthandler.enable()
        for number in faults:
            if name_of(number) not in _ENABLED:
                faulthandler.register(number, chain=True)


SIGNALS = Signals()
"""Those of this process; without effect before `install`."""
