"""Rules GW521 and GW522: who notices that a writer hangs, and keys that nothing lets act."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.registry import languages
from gatewayd.mapping.diagnostics import Diagnostic, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.failsafe import silent_motion
from gatewayd.mapping.rules.ownership import endless_locks
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.mapping.rules.writers import is_supervised, known_by
from gatewayd.report.wording import names_and_more


@cell_rule("GW521", Severity.WARNING)
def unsupervised_writer(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A writer that keeps what it owns when its program hangs."""
    reported = {name for _, name in silent_motion(cell)}
    reported |= {name for _, name in endless_locks(cell)}
    reported |= {named.name for language in languages() for named in language.names_writers(cell.document)}
    for writer in cell.document.writers.values():
        if is_supervised(writer.spec) or writer.name in reported:
            continue
        kept = [
            cell.variables[lock.members[0]].part.name
            for lock in cell.locks
            if lock.lease is None and writer.name in lock.owners
        ]
        if not kept:
            continue
        example = known_by(writer.spec)[0].supervision_example or "timeout: 2s"
        message = (
            f"nobody notices when `{writer.name}` hangs; it keeps {names_and_more(list(dict.fromkeys(kept)))}"
        )
        hint = f"add `{example}` to `{writer.name}`"
        yield rule.at(writer.key, message, hint=hint)


@cell_rule("GW522")
def key_without_effect(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A key that has no effect in this file."""
    yield from _writers(rule, cell)
    takeovers = {lock.name for lock in cell.locks if lock.takeover and len(lock.owners) > 1}
    used = {lock.name for lock in cell.locks if lock.group is not None}
    for group in cell.document.groups.values():
        if group.spec.whole and group.name in used - takeovers:
            message = f"the group `{group.name}` is `whole`, but no owner can take it over from another"
            hint = (
                "name the owners by priority (owner: [plc, hmi]) without `takeover: false`, or remove `whole`"
            )
            yield rule.at(group.key_at("whole"), message, hint=hint)
    for language in languages():
        for position, message, hint in language.without_effect(cell.document):
            yield rule.at(position, message, hint=hint)


def _writers(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    for writer in cell.document.writers.values():
        written = writer.spec.model_fields_set
        if "timeout_counts" in written and writer.spec.timeout is None:
            message = f"the writer `{writer.name}` has `timeout_counts` without `timeout`"
            hint = "add `timeout: 2s`, or remove it"
            yield rule.at(writer.key_at("timeout_counts"), message, hint=hint)
        ends = [language.lost_by for language in known_by(writer.spec)]
        if writer.spec.grace is not None and all(ends):
            message = f"the writer `{writer.name}` has `grace`, but no connection that could end"
            yield rule.at(writer.key_at("grace"), message, hint=f"remove it; {ends[0]}")
