"""A terminal that shows one thing until it is to stop: its keys, and the signals that end it."""

from __future__ import annotations

import os
import re
import select
import signal
from collections.abc import Iterator
from contextlib import contextmanager

_SEQUENCES = {
    "\x1b[A": "up", "\x1b[B": "down", "\x1b[5~": "pgup", "\x1b[6~": "pgdn", "\x1b[H": "home", "\x1b[F": "end",
    "\x1bOA": "up", "\x1bOB": "down", "\x1bOH": "home", "\x1bOF": "end", "\x1b[1~": "home", "\x1b[4~": "end",
    "\x1b": "esc", "\r": "enter", "\n": "enter", "\x7f": "backspace", "\x08": "backspace",
}  # fmt: skip
"""What terminals send for keys that are no characters."""
_KEY = re.compile("|".join(map(re.escape, sorted(_SEQUENCES, key=len, reverse=True))) + "|.", re.DOTALL)


def keys(descriptor: int, patience: float) -> Iterator[str]:
    """What was typed, waiting for `patience` seconds at most: characters, and names of other keys."""
    if not select.select([descriptor], [], [], patience)[0]:
        return
    data = os.read(descriptor, 1024)
    if not data:
        # The terminal is gone.
        yield "\x03"
        return
    for key in _KEY.findall(data.decode(errors="ignore")):
        yield _SEQUENCES.get(key, key)


@contextmanager
def raw(descriptor: int) -> Iterator[None]:
    """Give every key at once and without echo; as before at the end."""
    import termios
    import tty

    former = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        yield
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, former)


@contextmanager
def ending_on_signals() -> Iterator[None]:
    """SIGTERM and SIGHUP end what is inside as Ctrl-C does."""

    def interrupt(_number: int, _frame: object) -> None:
        raise KeyboardInterrupt

    former = {number: signal.signal(number, interrupt) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)
