"""All tests of a mapping file, each with a plant of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gatewayd.core.definition import CellDefinition
from gatewayd.mapping.diagnostics import FAMILIES, Diagnostic, Severity
from gatewayd.mapping.document import MappingTest
from gatewayd.mapping.loader import Loaded
from gatewayd.maptest.actions import CellNames
from gatewayd.maptest.plant import Plant
from gatewayd.maptest.steps import FailedStep, run_step


@dataclass(frozen=True, slots=True)
class MappingTestOutcome:
    """What became of one test."""

    test: MappingTest
    failures: tuple[FailedStep, ...]
    """All of the first step that failed; the steps behind it were not carried out."""
    seconds: float
    """Simulated time that passed."""

    @property
    def passed(self) -> bool:
        """Whether everything was as it says."""
        return not self.failures


def run_test(definition: CellDefinition, test: MappingTest) -> MappingTestOutcome:
    """Carry out a test that passed its check. Never raises for one that did."""
    plant = Plant(definition)
    names = CellNames(definition)
    failures: list[FailedStep] = []
    for number, step in enumerate(test.steps, 1):
        failures = run_step(plant, names, number, step)
        if failures:
            break
    return MappingTestOutcome(test, tuple(failures), plant.now)


@dataclass(frozen=True, slots=True)
class FileOutcome:
    """What became of the tests of one file."""

    file: str
    """Path as given."""
    cell: str
    """Name of the cell; empty where it could not be read."""
    findings: tuple[Diagnostic, ...]
    """Errors, for which no test of the file was carried out, and warnings about its tests."""
    tests: int
    """Tests that the file has, carried out or not."""
    outcomes: tuple[MappingTestOutcome, ...] = ()

    @property
    def errors(self) -> tuple[Diagnostic, ...]:
        """The findings for which no test was carried out."""
        return tuple(finding for finding in self.findings if finding.severity is Severity.ERROR)

    @property
    def failed(self) -> int:
        """Number of tests that failed."""
        return sum(not outcome.passed for outcome in self.outcomes)


def run_file(loaded: Loaded, chosen: Callable[[str], bool] = lambda _name: True) -> FileOutcome:
    """Carry out the tests of a file whose names are chosen, each by itself; none of a file with errors."""
    tests = loaded.cell.document.tests
    findings = tuple(
        finding
        for finding in loaded.diagnostics
        if finding.severity is Severity.ERROR or finding.rule.family == _FAMILY
    )
    outcomes: tuple[MappingTestOutcome, ...] = ()
    if loaded.plan is not None:
        definition = loaded.plan.cell
        outcomes = tuple(run_test(definition, test) for test in tests if chosen(test.name))
    return FileOutcome(loaded.name, loaded.cell.document.cell, findings, len(tests), outcomes)


_FAMILY = FAMILIES[9]
