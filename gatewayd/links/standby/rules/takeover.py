"""Rule GW886: what does not wait for a takeover."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.registry import languages
from gatewayd.links.standby.sections import Standby
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.report.format import seconds

AFTER_CRASH = 2.0
"""Seconds that a takeover takes at most when the process ends: the controller frees the inputs at once."""
AFTER_FREEZE = 4.0
"""When the process hangs: the service's watchdog ends it after 2 s."""
AFTER_CUT = 11.0
"""When machine or cable are gone: a controller frees the inputs of a silent client after about 10 s."""


@cell_rule("GW886", Severity.WARNING)
def standby_outlasts_watchdog(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A takeover that takes longer than something in the plant waits for the gateway."""
    standby = cell.document.part(Standby)
    if standby is None:
        return
    for limit in (limit for kind in languages() for limit in kind.patience(cell.document)):
        if limit.seconds >= AFTER_CRASH:
            continue
        message = (
            f"{limit.what} after {seconds(limit.seconds)} without the gateway, and a takeover takes up to "
            f"{seconds(AFTER_CRASH)} after a crash, {seconds(AFTER_FREEZE)} if the process hangs, "
            f"{seconds(AFTER_CUT)} if the machine or its cable is gone"
        )
        related = (Related(limit.position, "this waits"),)
        hint = f"{limit.remedy}, or accept that each takeover stops the program"
        yield rule.at(standby.key, message, hint=hint, related=related)
