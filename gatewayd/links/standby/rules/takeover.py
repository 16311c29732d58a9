"""Rule GW886: what does not wait for a takeover."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.registry import languages
from gatewayd.links.standby.sections import Standby
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.report.format import seconds

TAKEOVERS = (
    # The process ends: the controller frees the inputs at once.
    (2.0, "after a crash"),
    # The process hangs: the service's watchdog ends it after 2 s.
    (4.0, "if the process hangs"),
    # Machine or cable are gone: a controller frees the inputs of a silent client after about 10 s.
    (11.0, "if the machine or its cable is gone"),
)
"""Seconds that a takeover takes at most, and when."""


@cell_rule("GW886", Severity.WARNING)
def standby_outlasts_watchdog(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A takeover that takes longer than something in the plant waits for the gateway."""
    standby = cell.document.part(Standby)
    if standby is None:
        return
    for limit in (limit for kind in languages() for limit in kind.patience(cell.document)):
        outlasting = [f"{seconds(most)} {when}" for most, when in TAKEOVERS if most > limit.seconds]
        if not outlasting:
            continue
        message = (
            f"{limit.what} as early as {seconds(limit.seconds)} after the gateway is gone, and a takeover takes up to "
            f"{', '.join(outlasting)}"
        )
        related = (Related(limit.position, "this waits"),)
        hint = f"{limit.remedy}, or accept that such a takeover stops the program"
        yield rule.at(standby.key, message, hint=hint, related=related)
