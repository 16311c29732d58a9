"""Another mapping for a running gateway: read, check, compare, refuse what is unsafe, swap.

Reading and checking happen in another process, beside the running cells. The swap itself is one step without waiting,
so that it lies between two packages and two requests. Whatever goes wrong before it, the old mapping runs on.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.links.contract import PrepareError
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.loop.retry import reason_of
from gatewayd.mapping.compiled import Compiled
from gatewayd.mapping.diagnostics import Diagnostic
from gatewayd.mapping.plan import Plan
from gatewayd.report.diff import Changes, as_text, compare
from gatewayd.report.format import counted
from gatewayd.service.compilation import Compilation, CompilationError
from gatewayd.service.daemon import Daemon
from gatewayd.service.objections import objections_of_change, objections_of_removal
from gatewayd.service.startup import log_findings, mapping_files, misnamed

SETTLING_TIME = 0.5
"""Seconds for which a swap waits for a link that is about to know more, a robot's that has just claimed registers."""
_SHOWN = 3
"""Reasons that the one-line summary has."""

log = logging.getLogger("gatewayd.reload")


class Result(Enum):
    """How a reload ended."""

    APPLIED = "applied"
    UNCHANGED = "unchanged"
    """The files mean what is running already."""
    REFUSED = "refused"
    """Unsafe now, and not accepted."""
    FAILED = "failed"
    """A file has errors or cannot be read, something shared cannot be had, or a defect."""

    @property
    def is_good(self) -> bool:
        """Whether what runs now is what the files say."""
        return self in (Result.APPLIED, Result.UNCHANGED)


@dataclass(frozen=True, slots=True)
class CellObjection:
    """What stands against it in one cell."""

    cell: str
    objection: Objection

    @property
    def text(self) -> str:
        """With the kind by which it is accepted."""
        return f"{self.cell}: {self.objection.text} [{self.objection.kind}]"

    def as_object(self) -> dict[str, str]:
        """For JSON."""
        return {"cell": self.cell, "kind": self.objection.kind.value, "text": self.objection.text}


@dataclass(frozen=True, slots=True)
class ReloadOutcome:
    """What a reload came to."""

    result: Result
    reasons: tuple[str, ...] = ()
    """Why it was refused or failed; of an applied one what is to be known."""
    changes: tuple[str, ...] = ()
    """What is or would be different, one line for each cell."""
    swap: float = 0.0
    """Seconds that the swap itself took."""
    details: tuple[str, ...] = ()
    """The changes one by one, as `gatewayd diff` shows them."""
    objections: tuple[CellObjection, ...] = ()
    """What stands against it; of an applied one, what was accepted."""

    @property
    def text(self) -> str:
        """One sentence, for STATUS, log and terminal."""
        reasons = "; ".join(self.reasons[:_SHOWN])
        if len(self.reasons) > _SHOWN:
            reasons += f"; and {len(self.reasons) - _SHOWN} more"
        changes = "; ".join(self.changes)
        match self.result:
            case Result.UNCHANGED:
                return "reload: nothing has changed" + (f" (but {reasons})" if reasons else "")
            case Result.APPLIED:
                return f"reloaded: {changes}" + (f" (but {reasons})" if reasons else "")
            case Result.REFUSED:
                accept = "".join(f" --accept {kind}" for kind in self.kinds)
                return f"reload refused, the old mapping runs on: {reasons} (gatewayd reload{accept} applies it anyway)"
        return f"reload failed, the old mapping runs on: {reasons}"

    @property
    def kinds(self) -> tuple[ObjectionKind, ...]:
        """The kinds of its objections, in the order of their table."""
        found = {each.objection.kind for each in self.objections}
        return tuple(kind for kind in ObjectionKind if kind in found)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the service manager shows until the next reload: why this one was not done, or what it left behind."""
        return (self.text,) if not self.result.is_good or self.reasons else ()

    @property
    def exit_code(self) -> int:
        """0 if what runs now is what the files say, else 1."""
        return 0 if self.result.is_good else 1

    def as_object(self) -> dict[str, object]:
        """For JSON: `result`, `text`, `reasons`, `changes`, `objections`, `details`, `swap_ms`."""
        return {
            "result": self.result.value,
            "text": self.text,
            "reasons": list(self.reasons),
            "changes": list(self.changes),
            "objections": [each.as_object() for each in self.objections],
            "details": list(self.details),
            "swap_ms": round(self.swap * 1000, 3),
        }


class Reloader:
    """Reloads the mapping files at `paths` (files or directories) into `daemon`, one reload after another.

    `began` and `ended` are called around each reload.
    """

    def __init__(
        self,
        daemon: Daemon,
        paths: Sequence[Path],
        began: Callable[[], None] = lambda: None,
        ended: Callable[[ReloadOutcome], None] = lambda _outcome: None,
    ) -> None:
        self.last: ReloadOutcome | None = None
        """What the last reload came to."""
        self._daemon = daemon
        self._paths = tuple(paths)
        self._began = began
        self._ended = ended
        self._busy = asyncio.Lock()
        self._asked = asyncio.Event()

    def ask(self) -> None:
        """Reload soon, by `run`; asking again before it begins changes nothing. For signal handlers."""
        self._asked.set()

    async def run(self) -> None:
        """Do what `ask` asks for, until cancelled."""
        while True:
            await self._asked.wait()
            self._asked.clear()
            await self.reload()

    async def reload(self, *, force: bool = False, accept: Collection[ObjectionKind] = ()) -> ReloadOutcome:
        """Read, check, compare and swap. Never raises but for a cancellation.

        `accept`: kinds of objections that are none now; `force`: all of them.
        """
        async with self._busy:
            self._began()
            outcome = ReloadOutcome(Result.FAILED, ("it was interrupted",))
            try:
                outcome = await self._reload(frozenset(ObjectionKind if force else accept))
            except Exception as error:
                log.exception("internal error")
                outcome = ReloadOutcome(Result.FAILED, (f"internal error: {error!r}",))
            finally:
                self.last = outcome
                self._ended(outcome)
        level = logging.INFO if outcome.result.is_good else logging.ERROR
        took = {"swap_ms": f"{outcome.swap * 1000:.1f}"} if outcome.result is Result.APPLIED else {}
        log.log(level, outcome.text, extra=fields(**took))
        return outcome

    async def _reload(self, accept: frozenset[ObjectionKind]) -> ReloadOutcome:
        files = await asyncio.to_thread(mapping_files, self._paths)
        if not files:
            return ReloadOutcome(Result.FAILED, (f"no mapping file in {', '.join(map(str, self._paths))}",))
        try:
            with Compilation(files) as compilation:
                compiled = await asyncio.to_thread(compilation.result)
        except CompilationError as error:
            return ReloadOutcome(Result.FAILED, (str(error),))
        log_findings(compiled.files)
        reasons = tuple(_reasons(compiled))
        if reasons:
            return ReloadOutcome(Result.FAILED, reasons)
        plans = compiled.plans
        problems = await self._daemon.shared.refresh()
        differences = self._compare(plans)
        if not differences:
            return ReloadOutcome(Result.UNCHANGED, problems)
        outcome = await self._swap(plans, differences, accept)
        summaries = (change if isinstance(change, str) else change.summary for change in differences)
        return replace(
            outcome,
            reasons=(*outcome.reasons, *problems),
            changes=tuple(summaries),
            details=tuple(_details(differences)),
        )

    async def _swap(
        self, plans: Sequence[Plan], differences: Sequence[Changes | str], accept: frozenset[ObjectionKind]
    ) -> ReloadOutcome:
        refusal = _refused(self._objections(plans, differences), accept)
        if refusal is not None:
            return refusal
        try:
            prepared = await self._daemon.shared.prepare(self._daemon.served(plans))
        except PrepareError as error:
            return ReloadOutcome(Result.FAILED, (reason_of(error),))
        await self._settle()
        # From here to the swap nothing waits: what is owned now is owned in the swap.
        accepted = self._objections(plans, differences)
        refusal = _refused(accepted, accept)
        if refusal is not None or not self._daemon.running:
            await prepared.abort()
            return refusal or ReloadOutcome(Result.FAILED, ("the gateway stops",))
        now = clock.now()
        stranded = self._daemon.swap(plans, now, prepared)
        left = tuple(f"the robot keeps what it holds in {name}" for name in stranded)
        return ReloadOutcome(Result.APPLIED, left, objections=accepted, swap=clock.now() - now)

    def _compare(self, plans: Sequence[Plan]) -> list[Changes | str]:
        """What differs, by cell; a cell that is new or gone in one sentence."""
        running = {runtime.plan.cell.name: runtime.plan for runtime in self._daemon.runtimes}
        found: list[Changes | str] = []
        for plan in plans:
            former = running.pop(plan.cell.name, None)
            if former is None:
                found.append(f"{plan.cell.name}: new cell, {counted(len(plan.cell.variables), 'variable')}")
                continue
            changes = compare(former, plan)
            if changes:
                found.append(changes)
        found.extend(f"{name}: cell removed" for name in running)
        return found

    def _objections(
        self, plans: Sequence[Plan], differences: Sequence[Changes | str]
    ) -> tuple[CellObjection, ...]:
        runtimes = {runtime.plan.cell.name: runtime for runtime in self._daemon.runtimes}
        found: list[CellObjection] = []
        for changes in differences:
            if isinstance(changes, Changes):
                name = changes.old.cell.name
                found += (CellObjection(name, each) for each in objections_of_change(runtimes[name], changes))
        for name in sorted(runtimes.keys() - {plan.cell.name for plan in plans}):
            found += (CellObjection(name, each) for each in objections_of_removal(runtimes[name]))
        disturbed = self._daemon.shared.disturbs(self._daemon.served(plans))
        found += (CellObjection(cell.definition.name, each) for cell, each in disturbed)
        return tuple(found)

    async def _settle(self) -> None:
        """Wait for links that are about to know more, so that last fallbacks can still be sent."""
        end = clock.now() + SETTLING_TIME
        while clock.now() < end and not all(  # noqa: ASYNC110
            link.settled for runtime in self._daemon.runtimes for link in runtime.links.values()
        ):
            await asyncio.sleep(0.002)


def _details(differences: Sequence[Changes | str]) -> Iterator[str]:
    for changes in differences:
        if isinstance(changes, str):
            yield changes
        else:
            yield from as_text(changes).splitlines()


def _refused(objections: Sequence[CellObjection], accept: frozenset[ObjectionKind]) -> ReloadOutcome | None:
    """The refusal, if some objection is not accepted."""
    left = tuple(each for each in objections if each.objection.kind not in accept)
    return ReloadOutcome(Result.REFUSED, tuple(each.text for each in left), objections=left) if left else None


def _reasons(compiled: Compiled) -> Iterator[str]:
    """Why not all of it can be served."""
    for unread in compiled.unreadable:
        yield f"{unread.name} cannot be read: {unread.reason}"
    for file in compiled.files:
        yield from map(_line, file.errors)
    for source, reason in misnamed(compiled.plans):
        yield f"{source}: {reason}"


def _line(finding: Diagnostic) -> str:
    """With the remedy: a person who reloads looks at no log."""
    hint = f"; {finding.hint}" if finding.hint else ""
    return f"{finding.position}: {finding.rule.id} {finding.rule.slug}: {finding.message}{hint}"
