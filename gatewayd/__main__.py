"""The `gatewayd` command: runs the command line and turns whatever goes wrong into one line and an exit code.

Little is imported before the signals have their effects: what takes long is imported by `_run`.
"""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, NoReturn

from gatewayd.service import garbage, standard_streams
from gatewayd.service.signals import SIGNALS
from gatewayd.service.standard_streams import OutputError

if TYPE_CHECKING:
    from gatewayd.service.compilation import Compilation

INTERNAL_ERROR = 70
"""Exit code of a defect of gatewayd itself (EX_SOFTWARE of sysexits.h)."""
INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells count it: 128 + SIGINT."""
READER_GONE = 1
"""Exit code when the reader of a pipe went away; click's own, wherever in the output that is noticed."""
UNWRITTEN = 1
"""Exit code when standard output was closed or is full."""


def main() -> NoReturn:
    """Run `sys.argv` and exit. GATEWAYD_TRACEBACK=1 shows where an internal error came from."""
    is_daemon = sys.argv[1:2] == ["run"]
    garbage.begin()
    standard_streams.prepare()
    if is_daemon:
        SIGNALS.install()
    else:
        sys.unraisablehook = _interrupt_again
    try:
        code = _run()
    except KeyboardInterrupt:
        code = INTERRUPTED
    if is_daemon:
        _leave(code)
    # From here on nothing is left to be interrupted: Ctrl-C ends the process, and prints nothing.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    garbage.end()
    sys.exit(code)


def _run() -> int:
    """The exit code of the command."""
    try:
        code = _command()
        sys.stdout.flush()
    except BrokenPipeError:
        standard_streams.forget_output()
        return READER_GONE
    except OutputError as error:
        standard_streams.forget_output()
        print(f"gatewayd: cannot write the output: {error.strerror}", file=sys.stderr)  # noqa: T201 - as click does
        return UNWRITTEN
    except Exception as defect:  # noqa: BLE001 - the last line of defence: no traceback reaches a user
        if _was_interrupted(defect):
            return INTERRUPTED
        _report(defect)
        return INTERNAL_ERROR
    return code


def _command() -> int:
    if not _reads_files(sys.argv[1:]):
        return _carried_out(None)
    from gatewayd.service.compilation import Compilation

    with Compilation() as early:
        return _carried_out(early)


def _reads_files(arguments: list[str]) -> bool:
    """Whether a daemon is to start. The process that reads its files takes longest: it begins before all else."""
    return arguments[:1] == ["run"] and len(arguments) > 1 and not {"-h", "--help"}.intersection(arguments)


def _carried_out(early: Compilation | None) -> int:
    import click

    from gatewayd.cli import command

    try:
        result = command.main(prog_name="gatewayd", standalone_mode=False, obj=early)
    except click.ClickException as problem:
        problem.show()
        return problem.exit_code
    except click.Abort:
        return INTERRUPTED
    return result if isinstance(result, int) else 0


def _was_interrupted(defect: BaseException) -> bool:
    """Whether Ctrl-C is behind it: Python 3.11 makes a RuntimeError of one that falls into a `__set_name__`."""
    cause = defect.__cause__
    return cause is not None and (isinstance(cause, KeyboardInterrupt) or _was_interrupted(cause))


def _interrupt_again(lost: sys.UnraisableHookArgs) -> None:
    """Ctrl-C fell into a callback of Python, from which nothing can be raised: let it come once more."""
    if lost.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(lost)
        return
    import threading

    main_thread = threading.main_thread().ident
    assert main_thread is not None
    later = threading.Timer(0.01, signal.pthread_kill, (main_thread, signal.SIGINT))
    later.daemon = True
    later.start()


def _leave(code: int) -> NoReturn:
    """End without the interpreter's own end, which would give every signal its deadly default back."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):
            stream.flush()
    os._exit(code)


def _report(defect: Exception) -> None:
    import traceback
    from pathlib import Path

    from gatewayd.report.printable import printable

    if os.environ.get("GATEWAYD_TRACEBACK") == "1":
        traceback.print_exception(defect)
    place = traceback.extract_tb(defect.__traceback__)[-1]
    what = printable(" ".join(f"{type(defect).__name__}: {defect}".split()))
    print(  # noqa: T201 - logging may be what failed
        f"gatewayd: internal error: {what} ({Path(place.filename).name}:{place.lineno}); please report with the log",
        file=sys.stderr,
    )


if __name__ == "__main__":
    main()
