"""When the interpreter looks for garbage. Its own habits fit neither a start nor what serves for years after it."""

from __future__ import annotations

import gc

_ALLOCATIONS = 100_000
"""Between two collections while a command starts: importing makes much and drops little."""
_USUAL = gc.get_threshold()


def begin() -> None:
    """A command starts: looking after every few hundred objects of an import took a twelfth of a `check`."""
    gc.set_threshold(_ALLOCATIONS)


def serve() -> None:
    """A daemon has started: what was made by now stays, so no collection looks at it again; new objects as usual."""
    gc.freeze()
    gc.set_threshold(*_USUAL)


def end() -> None:
    """A command has ended: nothing is gained by looking once more through all that has been imported."""
    gc.freeze()
