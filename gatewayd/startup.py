"""From the files named on the command line to the plans that can be served; what cannot be is said, one line each."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from os.path import isdir
from pathlib import Path

from gatewayd.logs import fields
from gatewayd.mapping.diagnostics import Severity
from gatewayd.mapping.loader import Loaded, load_together, read_bytes
from gatewayd.mapping.plan import Plan

__all__ = ["PATTERN", "Startup", "load_plans", "mapping_files", "state_directory"]

PATTERN = "*.yaml"
"""The files of a configuration directory."""

log = logging.getLogger("gatewayd.startup")


def state_directory(environment: Mapping[str, str]) -> Path:
    """Where to keep what survives a restart: what systemd gives (STATE_DIRECTORY), else the user's own (XDG)."""
    given = environment.get("STATE_DIRECTORY")
    if given:
        return Path(given.partition(":")[0])
    base = environment.get("XDG_STATE_HOME")
    return (Path(base) if base else Path.home() / ".local" / "state") / "gatewayd"


@dataclass(frozen=True, slots=True)
class Startup:
    """What there is to serve."""

    plans: tuple[Plan, ...]
    unreadable: int
    """Files that could not be read."""
    broken: int
    """Files with errors."""


def mapping_files(paths: Iterable[Path]) -> list[Path]:
    """The files meant: a directory stands for its *.yaml files, by name."""
    found: list[Path] = []
    for path in paths:
        # Path.is_dir would raise for a name that no file can have; such a one is told when it is opened.
        if isdir(path):  # noqa: PTH112
            inside = sorted(path.glob(PATTERN))
            if not inside:
                log.error(
                    "no mapping file in the directory", extra=fields(directory=str(path), pattern=PATTERN)
                )
            found.extend(inside)
        else:
            found.append(path)
    return found


def load_plans(paths: Sequence[Path]) -> Startup:
    """Read and check everything; log what cannot be served and why."""
    files: list[tuple[str, bytes]] = []
    unreadable = 0
    for path in mapping_files(paths):
        try:
            files.append((str(path), read_bytes(path)))
        except OSError as error:
            unreadable += 1
            log.error("cannot read the mapping file", extra=fields(file=str(path), reason=error.strerror))  # noqa: TRY400 - the reason says it all
    loaded = load_together(files)
    for one in loaded:
        _tell(one)
    plans = tuple(one.plan for one in loaded if one.plan is not None)
    return Startup(plans, unreadable, len(loaded) - len(plans))


def _tell(loaded: Loaded) -> None:
    for finding in loaded.diagnostics:
        level = logging.ERROR if finding.severity is Severity.ERROR else logging.WARNING
        log.log(
            level,
            finding.message,
            extra=fields(
                at=str(finding.position), rule=f"{finding.rule.id} {finding.rule.slug}", hint=finding.hint
            ),
        )
    if loaded.plan is None:
        log.error(
            "the cell is not served", extra=fields(file=loaded.name, remedy=f"gatewayd check {loaded.name}")
        )
