"""From the bytes of a register list to a mapping that passes the check and says what the list says, or to none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from gatewayd.cli.importing.findings import ImportFinding
from gatewayd.cli.importing.register_list.findings import ListFindings
from gatewayd.cli.importing.register_list.mapping import ListSettings, MadeMapping, mapping_of
from gatewayd.cli.importing.register_list.rows import Counting, ListedPlace, places
from gatewayd.cli.importing.register_list.table import MAX_BYTES, decoded, table
from gatewayd.cli.importing.register_list.variables import lines, owners
from gatewayd.mapping.diagnostics import Diagnostic, Severity
from gatewayd.mapping.loader import Loaded, load
from gatewayd.report.format import counted


@dataclass(frozen=True, slots=True)
class Proposal:
    """What became of a list."""

    text: str | None
    """The mapping; None where there are errors."""
    variables: int
    findings: tuple[ImportFinding, ...]


def proposal(content: bytes, settings: ListSettings, counting: Counting, source: str) -> Proposal:
    """Read the list, make the mapping, check it, and compare it with the list."""
    findings = ListFindings()
    made, loaded = _made(content, settings, counting, source, findings)
    failed = findings.failed or made is None or loaded is None or loaded.plan is None
    if failed or made is None or loaded is None or loaded.plan is None:
        return Proposal(None, 0, tuple(findings.all()))
    return Proposal(made.text, len(loaded.plan.cell.variables), tuple(findings.all()))


def _made(
    content: bytes, settings: ListSettings, counting: Counting, source: str, findings: ListFindings
) -> tuple[MadeMapping | None, Loaded | None]:
    if len(content) > MAX_BYTES:
        findings.error((1, 1), f"more than {MAX_BYTES} bytes", "split the list into several")
        return None, None
    found = places(table(decoded(content, findings), findings), counting, findings)
    if not found and not findings.failed:
        findings.error((1, 1), "no row below the head line", "the list is empty")
    if not findings.failed:
        settings = _with_writers(settings, found, findings)
    listed = lines(found, findings) if not findings.failed else []
    if findings.failed:
        return None, None
    made = mapping_of(listed, settings, source)
    loaded = load(made.text.encode(), source)
    for diagnostic in loaded.diagnostics:
        _report(diagnostic, made, findings)
    if loaded.plan is not None:
        _compare(found, loaded, findings)
    return made, loaded


def _with_writers(
    settings: ListSettings, found: Sequence[ListedPlace], findings: ListFindings
) -> ListSettings:
    """Every owner of the list needs an address; inputs without one belong to the only writer."""
    inputs = [place for place in found if place.is_input]
    if not inputs:
        return replace(settings, writers={})
    named = owners(found)
    missing = [name for name in named if name not in settings.writers]
    for name in missing:
        first = next(place for place in found if name in owners([place]))
        text = f"the address of the writer `{name}` is not known"
        findings.error(first.row.place("owner"), text, f"--writer {name}=ADDRESS")
    if not missing and not settings.writers:
        text = "the PLC writes this, and its address is not known"
        findings.error(inputs[0].row.place("name"), text, "--writer ADDRESS, which names it plc")
    elif not missing and not named and len(settings.writers) > 1:
        text = "the list does not say which writer owns this"
        findings.error(inputs[0].row.place("name"), text, "add a column `owner`, or give one --writer")
    return settings


def _report(diagnostic: Diagnostic, made: MadeMapping, findings: ListFindings) -> None:
    """A finding of the check, at the row that it is about."""
    line = made.rows.get(diagnostic.position.line)
    place = (1, 1) if line is None else line.first.row.place("address")
    text = f"{diagnostic.rule.id} {diagnostic.rule.slug}: {diagnostic.message}"
    report = findings.error if diagnostic.severity is Severity.ERROR else findings.doubt
    report(place, text, diagnostic.hint or "")


def _compare(found: Sequence[ListedPlace], loaded: Loaded, findings: ListFindings) -> None:
    """Row by row: whatever the mapping would say otherwise than the list keeps it from being written."""
    from gatewayd.report.table import rows

    table = [row for row in rows(loaded.cell) if row["address"] is not None]
    for place, row in zip(found, table, strict=False):
        wrong = _difference(place, {**row.places, "name": row.name, "direction": row.direction})
        if wrong:
            findings.error(
                place.row.place("address"),
                f"{wrong}: the mapping cannot say it in one line with its neighbours",
                "give the variables names without an index, or consecutive addresses",
            )
    if len(found) != len(table) and not findings.failed:
        findings.error(
            (1, 1),
            f"{counted(len(found), 'place')} of the list became {len(table)}",
            "report this as a defect",
        )


def _difference(place: ListedPlace, made: Mapping[str, object]) -> str:
    """What the mapping says otherwise, in words; empty if nothing."""
    part = "" if made["bit"] is None else str(made["bit"])
    expected = {
        "name": place.name,
        "direction": "input" if place.is_input else "output",
        "area": place.area,
        "address": place.address,
        "bit": {"high": "8", "low": "0"}.get(place.part, place.part),
        **({"type": place.type} if place.type else {}),
        **({"order": place.order} if place.order and made["order"] else {}),
        **({"scale": place.scale} if place.scale is not None and made["scale"] is not None else {}),
        **({"offset": place.offset} if place.offset is not None and made["offset"] is not None else {}),
    }
    for column, value in expected.items():
        got = part if column == "bit" else made[column]
        if got != value:
            return f"{column} {value} of the list became {got}"
    return ""
