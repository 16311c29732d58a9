"""The one way from mapping files to findings and plans: `check`, `show` and `run` all load through here.

Text -> tree -> typed parts -> expanded cell -> rules -> plan. A plan exists only where no error was found.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gatewayd.mapping.compile import compile_plan
from gatewayd.mapping.compiled import CompiledFile
from gatewayd.mapping.diagnostics import Diagnostic, Severity
from gatewayd.mapping.expand import expand
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.reader import read_document
from gatewayd.mapping.rules.run import check_cell, check_plant
from gatewayd.mapping.source import MAX_BYTES, parse


@dataclass(frozen=True, slots=True)
class Loaded(CompiledFile):
    """One mapping file with what its findings and its plan were made from."""

    cell: ExpandedCell
    """What could be read of the file; empty where nothing could."""

    @property
    def lines(self) -> tuple[str, ...]:
        """The text of the file, for excerpts."""
        return self.cell.document.source.lines


def read_bytes(path: Path) -> bytes:
    """Read a mapping file; what exceeds the size limit is left out, so that `load` refuses it. Raises OSError."""
    with path.open("rb") as file:
        return file.read(MAX_BYTES + 1)


def load(data: bytes, name: str) -> Loaded:
    """Load one file by itself. Never raises, whatever the bytes."""
    return load_together([(name, data)])[0]


def load_together(files: Sequence[tuple[str, bytes]], *, tests: bool = True) -> tuple[Loaded, ...]:
    """Load files (name, bytes) that are to run in one process: what they share is checked too. Never raises.

    `tests`: judge the section `tests:` too. Nothing of it is in a plan.
    """
    cells: list[ExpandedCell] = []
    findings: list[list[Diagnostic]] = []
    for name, data in files:
        document, found = read_document(parse(data, name), tests=tests)
        cell = expand(document)
        cells.append(cell)
        findings.append([*found, *check_cell(cell)])
    positions = {name: index for index, (name, _) in enumerate(files)}
    for finding in check_plant(cells):
        findings[positions[finding.position.file]].append(finding)
    return tuple(
        _finished(name, cell, found) for (name, _), cell, found in zip(files, cells, findings, strict=True)
    )


def _finished(name: str, cell: ExpandedCell, findings: Iterable[Diagnostic]) -> Loaded:
    diagnostics = tuple(sorted(findings, key=lambda finding: (finding.position, finding.rule.id)))
    failed = any(finding.severity is Severity.ERROR for finding in diagnostics)
    return Loaded(name, diagnostics, None if failed else compile_plan(cell), cell)
