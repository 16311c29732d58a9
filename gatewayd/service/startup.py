"""From the files named on the command line to the plans that can be served; what cannot be is said, one line each.

The process that reads takes longest, so it is started before anything is imported that has to do with its answer.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gatewayd.mapping.files import PATTERNS, files_of
from gatewayd.report.format import counted
from gatewayd.service.compilation import Compilation

if TYPE_CHECKING:
    from gatewayd.mapping.compiled import CompiledFile
    from gatewayd.mapping.plan import Plan

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

    @property
    def notes(self) -> list[str]:
        """What the service manager shows until a reload mends it."""
        count = self.broken + self.unreadable
        return [f"{counted(count, 'mapping file')} not served, see the log"] if count else []


def mapping_files(paths: Iterable[Path]) -> list[Path]:
    """The files meant: a directory stands for its mapping files, by name. One without any is logged."""
    meant = _files_by_path(paths)
    _log_empty(meant)
    return [file for files in meant.values() for file in files]


def _files_by_path(paths: Iterable[Path]) -> dict[Path, list[Path]]:
    meant: dict[Path, list[Path]] = {}
    for path in paths:
        try:
            meant[path] = files_of(path)
        except OSError:
            # It is reported, with its reason, when it is opened.
            meant[path] = [path]
    return meant


def _log_empty(meant: Mapping[Path, Sequence[Path]]) -> None:
    from gatewayd.logs.records import fields  # noqa: PLC0415 - after the process was started

    for path, files in meant.items():
        if not files:
            log.error("no mapping file in the directory", extra=fields(directory=str(path), pattern=PATTERNS))


def load_plans(
    paths: Sequence[Path],
    meanwhile: Callable[[], object] = lambda: None,
    given_up: Callable[[], bool] = lambda: False,
    early: Compilation | None = None,
) -> Startup:
    """Read and check everything; log what cannot be served and why. Raises CompilationError.

    `meanwhile` is called while another process reads, before anything is logged; that ends early once it is `given_up`.
    `early` is such a process that has been started already.
    """
    meant = _files_by_path(paths)
    named = [file for files in meant.values() for file in files]
    if early is not None:
        early.read(named)
    with early or Compilation(named) as compilation:
        meanwhile()
        _log_empty(meant)
        compiled = compilation.result(given_up)
    from gatewayd.logs.records import fields  # noqa: PLC0415 - after the process was started

    for unread in compiled.unreadable:
        log.error("cannot read the mapping file", extra=fields(file=unread.name, reason=unread.reason))
    log_findings(compiled.files)
    wrong = dict(misnamed(compiled.plans))
    for plan, reason in wrong.items():
        log.error("cannot serve the cell", extra=fields(file=plan, reason=reason))
    broken = [file for file in compiled.files if file.plan is None]
    for file in broken:
        remedy = f"gatewayd check {file.name}"
        log.error("the cell is not served", extra=fields(file=file.name, remedy=remedy))
    plans = tuple(plan for plan in compiled.plans if plan.source not in wrong)
    return Startup(plans, len(compiled.unreadable), len(broken) + len(wrong))


def misnamed(plans: Iterable[Plan]) -> Iterator[tuple[str, str]]:
    """Mapping files with a link whose name stands for something else in what the gateway says of a cell, and why."""
    from gatewayd.links.registry import kind_of  # noqa: PLC0415 - after the process was started
    from gatewayd.report.schema import taken_names  # noqa: PLC0415

    for plan in plans:
        names = [
            name
            for name, link in plan.links.items()
            if name in taken_names(has_places=bool(kind_of(link.kind).place))
        ]
        if names:
            yield (
                plan.source,
                f"a link cannot be called {', '.join(names)}: a field of the status has this name",
            )


def log_findings(files: Iterable[CompiledFile]) -> None:
    """Log every finding with its place, rule and remedy."""
    from gatewayd.logs.records import fields  # noqa: PLC0415 - after the process was started
    from gatewayd.mapping.diagnostics import Severity  # noqa: PLC0415

    for finding in (finding for file in files for finding in file.diagnostics):
        level = logging.ERROR if finding.severity is Severity.ERROR else logging.WARNING
        rule = f"{finding.rule.id} {finding.rule.slug}"
        log.log(level, finding.message, extra=fields(at=str(finding.position), rule=rule, hint=finding.hint))
