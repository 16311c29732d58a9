"""Findings as people and programs read them: text, JSON, GitHub annotations."""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.mapping.compiled import Unreadable
from gatewayd.mapping.diagnostics import Diagnostic, Position, Severity
from gatewayd.report.format import counted
from gatewayd.report.printable import json_document, printable

_BOLD, _RED, _YELLOW, _DIM, _PLAIN = "\x1b[1m", "\x1b[31m", "\x1b[33m", "\x1b[2m", "\x1b[0m"
_TINT = {Severity.ERROR: _RED, Severity.WARNING: _YELLOW}


@dataclass(frozen=True, slots=True)
class CheckOutcome:
    """What one run of `gatewayd check` found in all its files."""

    files: tuple[str, ...]
    """Files that were read, in the order of the command line."""
    findings: tuple[Diagnostic, ...]
    """By file, line and column."""
    unreadable: tuple[Unreadable, ...] = ()
    remarks: tuple[tuple[str, str], ...] = ()
    """File, and what its conversions do to numbers, as declared."""

    @property
    def errors(self) -> int:
        """Number of findings that keep the gateway from starting."""
        return sum(finding.severity is Severity.ERROR for finding in self.findings)

    @property
    def warnings(self) -> int:
        """Number of findings that do not."""
        return len(self.findings) - self.errors


def as_text(outcome: CheckOutcome, *, colour: bool = False) -> str:
    """One line `file:line:col: severity GWnnn slug: message` per finding, details indented; a summary line."""
    lines: list[str] = []
    for finding in outcome.findings:
        lines.extend(finding_lines(finding, colour=colour))
    lines.extend(printable(f"{item.name}: cannot be read: {item.reason}") for item in outcome.unreadable)
    if lines:
        lines.append("")
    lines.extend(printable(f"{name}: {remark}") for name, remark in outcome.remarks)
    lines.append(_summary(outcome))
    return "\n".join(lines) + "\n"


def as_json(outcome: CheckOutcome) -> str:
    """One JSON document: `version`, `files`, `errors`, `warnings`, `findings`, `unreadable`, `remarks`.

    A finding has `rule`, `slug`, `family`, `severity`, `file`, `line`, `column`, `message`, `hint` (or null)
    and `related`, a list of `file`, `line`, `column`, `message`. Keys are only ever added within a version.
    """
    document = {
        "version": 1,
        "files": list(outcome.files),
        "errors": outcome.errors,
        "warnings": outcome.warnings,
        "findings": [finding_object(finding) for finding in outcome.findings],
        "unreadable": [{"file": item.name, "reason": item.reason} for item in outcome.unreadable],
        "remarks": [{"file": name, "remark": remark} for name, remark in outcome.remarks],
    }
    return json_document(document)


def as_github(outcome: CheckOutcome) -> str:
    """Workflow commands that GitHub shows as annotations at the lines of a pull request."""
    lines = [_annotation(finding) for finding in outcome.findings]
    lines.extend(
        f"::error file={_property(item.name)},title=unreadable::{_data(printable(item.reason))}"
        for item in outcome.unreadable
    )
    return "".join(f"{line}\n" for line in lines)


def finding_lines(finding: Diagnostic, *, colour: bool = False) -> list[str]:
    """One finding as text: its line, and below it, indented, related places and the hint."""
    rule = finding.rule
    place, label = printable(str(finding.position)), f"{rule.severity.value} {rule.id}"
    if colour:
        place = f"{_BOLD}{place}{_PLAIN}"
        label = f"{_TINT[rule.severity]}{_BOLD}{label}{_PLAIN}"
    lines = [f"{place}: {label} {rule.slug}: {printable(finding.message)}"]
    details = [f"    {printable(f'{item.position}: {item.message}')}" for item in finding.related]
    if finding.hint is not None:
        details.append(f"    hint: {printable(finding.hint)}")
    lines.extend(f"{_DIM}{detail}{_PLAIN}" if colour else detail for detail in details)
    return lines


def _summary(outcome: CheckOutcome) -> str:
    parts = [f"{counted(len(outcome.files), 'file')} checked"]
    if outcome.unreadable:
        parts.append(f"{counted(len(outcome.unreadable), 'file')} not readable")
    found = [counted(outcome.errors, "error")] if outcome.errors else []
    if outcome.warnings:
        found.append(counted(outcome.warnings, "warning"))
    if not outcome.files:
        return ", ".join(parts)
    return f"{', '.join(parts)}: {', '.join(found) or 'no findings'}"


def finding_object(finding: Diagnostic) -> dict[str, object]:
    """One finding as `as_json` has it."""
    return {
        "rule": finding.rule.id,
        "slug": finding.rule.slug,
        "family": finding.rule.family,
        "severity": finding.severity.value,
        **_place(finding.position),
        "message": finding.message,
        "hint": finding.hint,
        "related": [{**_place(item.position), "message": item.message} for item in finding.related],
    }


def _place(position: Position) -> dict[str, object]:
    return {"file": position.file, "line": position.line, "column": position.column}


def _annotation(finding: Diagnostic) -> str:
    position, rule = finding.position, finding.rule
    text = [finding.message, *(f"{item.position}: {item.message}" for item in finding.related)]
    if finding.hint is not None:
        text.append(f"hint: {finding.hint}")
    body = "\n".join(map(printable, text))
    return (
        f"::{rule.severity.value} file={_property(position.file)},line={position.line},col={position.column},"
        f"title={_property(f'{rule.id} {rule.slug}')}::{_data(body)}"
    )


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(printable(text)).replace(":", "%3A").replace(",", "%2C")
