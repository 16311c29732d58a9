"""A PLC of the soak run, as a process: writes and reads without end, and comes back by itself whatever happens.

    python -m tests.soak.client HOST SOURCE PORT REGISTER ECHO PAUSE

Each PAUSE seconds it writes a counter to REGISTER and the shared register, and reads ECHO. With REGISTER -1 it only
reads the status block: a slow poller.
"""

from __future__ import annotations

import sys
import time
from contextlib import suppress

from tests.e2e.plc import Plc

__all__ = ["SHARED"]

SHARED = 8
"""Register that both PLCs write: whose lock is free takes it, the other is refused."""
_RETRY = 0.1
_GREATEST = 30_000
_STATUS = 60000


def _cycle(plc: Plc, register: int, echo: int, number: int) -> None:
    plc.read(_STATUS, 64)
    if register >= 0:
        plc.write_integers(register, number)
        plc.write_integers(SHARED, number)
        plc.reading_code(echo, 2)


def _main(host: str, source: str, *figures: str) -> None:
    port, register, echo = map(int, figures[:3])
    pause = float(figures[3])
    number = 0
    while True:
        # AssertionError: an exception code that reads should not give; the run sees it by the echo that stands still.
        with suppress(OSError, AssertionError):
            plc = Plc(port, source, host=host)
            try:
                while True:
                    number = number % _GREATEST + 1
                    _cycle(plc, register, echo, number)
                    time.sleep(pause)
            finally:
                plc.close()
        time.sleep(_RETRY)


if __name__ == "__main__":
    _main(*sys.argv[1:])
