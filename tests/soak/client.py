"""A PLC of the soak run, as a process: writes and reads without end, and comes back by itself whatever happens.

    python -m tests.soak.client HOST SOURCE PORT REGISTER ECHO PAUSE FIELD JOURNAL

Each PAUSE seconds it writes a counter to REGISTER, which is FIELD of the robot, and the shared register, and reads
ECHO. With REGISTER -1 it only reads the status block: a slow poller. What it wrote stands in the file JOURNAL.
"""

from __future__ import annotations

import sys
import time
from contextlib import suppress

from tests.e2e.plc import Plc
from tests.soak.journal import Journal

SHARED = 8
"""Register that both PLCs write: whose lock is free takes it, the other is refused."""
SHARED_FIELD = "input_int_register_2"
_RETRY = 0.1
_MAX = 30_000
_STATUS = 60000


def _cycle(plc: Plc, places: dict[int, str], echo: int, number: int, journal: Journal) -> None:
    plc.read(_STATUS, 64)
    for register, field in places.items():
        journal.note(field, number)
        journal.note(field, number, plc.write_integers(register, number))
        plc.reading_code(echo, 2)


def _main(host: str, source: str, *figures: str) -> None:
    port, register, echo = map(int, figures[:3])
    pause, field, journal = float(figures[3]), figures[4], Journal(figures[5])
    places = {register: field, SHARED: SHARED_FIELD} if register >= 0 else {}
    number = 0
    while True:
        # AssertionError: an exception code that reads should not give; the run sees it by the echo that stands still.
        with suppress(OSError, AssertionError):
            plc = Plc(port, source, host=host)
            try:
                while True:
                    number = number % _MAX + 1
                    _cycle(plc, places, echo, number, journal)
                    time.sleep(pause)
            finally:
                plc.close()
        time.sleep(_RETRY)


if __name__ == "__main__":
    _main(*sys.argv[1:])
