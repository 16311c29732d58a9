"""`gatewayd run` from its options to its exit code.

The mapping files are read by a process of their own, and meanwhile this one imports what will serve: hardly anything is
imported before that process has been started.
"""

from __future__ import annotations

import logging
from collections.abc import Callable

from gatewayd.service import garbage
from gatewayd.service.compilation import Compilation, CompilationError
from gatewayd.service.options import Options
from gatewayd.service.signals import SIGNALS, name_of
from gatewayd.service.startup import Startup, load_plans

STOPPED = 0
NOTHING_TO_RUN = 1
UNREADABLE = 2
DEFECT = 70
"""Worth another attempt, unlike the others: the service manager starts it again."""


def main(
    options: Options, configure: Callable[[], None] = lambda: None, early: Compilation | None = None
) -> int:
    """Read the files and serve what they say until the end is asked for; the exit code.

    `configure` makes the log; it is called once, while the files are being read. `early` is the process that reads
    them, if it has been started already.
    """
    found = _load(options, configure, early)
    if SIGNALS.stopping:
        from gatewayd.logs.records import fields  # noqa: PLC0415 - see `_load`

        logging.getLogger("gatewayd.run").info(
            "stopped before anything was served", extra=fields(signal=name_of(SIGNALS.stopped_by))
        )
        return STOPPED
    if isinstance(found, int):
        return found
    from gatewayd.service import assemble  # noqa: PLC0415 - see `_load`

    garbage.serve()
    assemble.run(found, options)
    return STOPPED


def _load(options: Options, configure: Callable[[], None], early: Compilation | None) -> Startup | int:
    """What there is to serve, or the exit code."""

    def meanwhile() -> None:
        configure()
        _import_what_serves()

    try:
        found = load_plans(options.files, meanwhile, lambda: SIGNALS.stopping, early)
    except CompilationError as error:
        if not SIGNALS.stopping:
            logging.getLogger("gatewayd.startup").error("%s", error)  # noqa: TRY400 - the text says it all
        return DEFECT
    if not found.plans and not found.broken:
        return UNREADABLE
    if not found.plans or (options.strict and (found.broken or found.unreadable)):
        return NOTHING_TO_RUN
    return found


def _import_what_serves() -> None:
    """It takes as long as reading the files. Of links, those that nearly every cell has."""
    import gatewayd.service.assemble  # noqa: F401, PLC0415
    from gatewayd.links.registry import kinds, runtime_of  # noqa: PLC0415

    for kind in kinds():
        if kind.usual:
            runtime_of(kind.key)
