"""The `gatewayd` command: runs the command line and turns whatever goes wrong into one line and an exit code."""

from __future__ import annotations

import os
import sys
import traceback
from pathlib import Path

import click

from gatewayd.cli import command

__all__ = ["main"]

INTERNAL_ERROR = 70
"""Exit code of a defect of gatewayd itself (EX_SOFTWARE of sysexits.h)."""
INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells count it: 128 + SIGINT."""
READER_GONE = 1
"""Exit code when the reader of a pipe went away; click's own, wherever in the output that is noticed."""


def main() -> None:
    """Run `sys.argv` and exit. GATEWAYD_TRACEBACK=1 shows where an internal error came from."""
    try:
        result = command.main(prog_name="gatewayd", standalone_mode=False)
        sys.stdout.flush()
    except click.ClickException as problem:
        problem.show()
        sys.exit(problem.exit_code)
    except (KeyboardInterrupt, click.Abort):
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        _forget_stdout()
        sys.exit(READER_GONE)
    except Exception as defect:  # noqa: BLE001 - the last line of defence: no traceback reaches a user
        _report(defect)
        sys.exit(INTERNAL_ERROR)
    sys.exit(result if isinstance(result, int) else 0)


def _forget_stdout() -> None:
    """Point stdout at nothing, so that the interpreter's own flush at exit does not complain."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _report(defect: Exception) -> None:
    if os.environ.get("GATEWAYD_TRACEBACK") == "1":
        traceback.print_exception(defect)
    place = traceback.extract_tb(defect.__traceback__)[-1]
    what = " ".join(f"{type(defect).__name__}: {defect}".split())
    print(  # noqa: T201 - logging may be what failed
        f"gatewayd: internal error: {what} ({Path(place.filename).name}:{place.lineno}); please report with the log",
        file=sys.stderr,
    )


if __name__ == "__main__":
    main()
