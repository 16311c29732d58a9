"""The whole look: gateways on this machine, then link by link what each kind says is to be looked at."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator

from gatewayd.control.running import RunningGateways
from gatewayd.doctor.report import CheckLine
from gatewayd.links.examination import Observation, Outcome, Surroundings
from gatewayd.links.registry import examination_of, kinds
from gatewayd.mapping.compiled import CompiledFile
from gatewayd.mapping.diagnostics import Severity
from gatewayd.mapping.plan import Plan
from gatewayd.report.format import counted

GATEWAY = "gateway"
_SERVED = "served"


async def examine(
    plan: Plan, gateways: RunningGateways, *, probe_claims: bool = False
) -> AsyncIterator[CheckLine]:
    """Look at what one cell needs, in the order of the kinds of links."""
    name = plan.cell.name
    for seen in about_gateway(plan, gateways):
        yield CheckLine(name, GATEWAY, seen)
    around = Surroundings(gateways.cells, probe_claims)
    order = [kind.key for kind in kinds()]
    for link, part in sorted(plan.links.items(), key=lambda named: order.index(named[1].kind)):
        examination = examination_of(part.kind)
        if examination is not None:
            async for seen in examination.examine(part, plan.cell, around):
                yield CheckLine(name, link, seen)


def about_machine(gateways: RunningGateways) -> Iterator[CheckLine]:
    """Gateways that gave no answer: what they hold would be taken for somebody else's."""
    for _, reason in gateways.silent:
        cause = "a gateway may run here, and what it holds is taken for somebody else's below"
        remedy = (
            "join the group of the control socket (`ls -l` shows it), use sudo, or name another by --socket"
        )
        yield CheckLine("", GATEWAY, Observation("control socket", Outcome.WARNING, reason, cause, remedy))


def about_mapping(mapping: CompiledFile) -> CheckLine:
    """What `gatewayd check` says of the file."""
    cell = mapping.plan.cell.name if mapping.plan is not None else ""
    errors = sum(finding.severity is Severity.ERROR for finding in mapping.diagnostics)
    warnings = len(mapping.diagnostics) - errors
    check, remedy = "check", f"`gatewayd check {mapping.name}` shows each with its place and a hint"
    if errors:
        text = f"{mapping.name} has {counted(errors, 'error')}: no gateway starts with it"
        return CheckLine(cell, "mapping", Observation(check, Outcome.PROBLEM, text, "see there", remedy))
    if warnings:
        text = f"{counted(warnings, 'warning')}: {remedy}"
        return CheckLine(cell, "mapping", Observation(check, Outcome.NOTE, text))
    return CheckLine(cell, "mapping", Observation.well(check, "no findings"))


def about_gateway(plan: Plan, gateways: RunningGateways) -> Iterator[Observation]:
    """Whether a gateway on this machine serves the cell, and what it says of it."""
    if not gateways.sockets:
        yield Observation.well(_SERVED, "no gateway runs on this machine")
        return
    serving = [cell for cell in gateways.cells if cell.name == plan.cell.name]
    if not serving:
        running = counted(len(gateways.cells), "cell")
        yield Observation(
            _SERVED, Outcome.NOTE, f"the gateway on this machine serves {running}, not this one"
        )
    for cell in serving:
        problems = [str(problem) for problem in cell.status.get("problems", ())]
        if problems:
            text = f"the running gateway reports: {'; '.join(problems)}"
            cause = "see the checks below, and the log"
            yield Observation(
                _SERVED, Outcome.WARNING, text, cause, "`gatewayd status` shows it as it is now"
            )
        else:
            yield Observation.well(_SERVED, f"by the gateway at {cell.socket}, and well")
        if cell.status.get("fingerprint") != f"{plan.cell.fingerprint:08X}":
            text = "the running gateway has another state of this mapping: `gatewayd diff`, `gatewayd reload`"
            yield Observation(_SERVED, Outcome.NOTE, text)
