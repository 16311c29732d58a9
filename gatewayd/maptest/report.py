"""What became of tests, for people and for programs: text, JSON, JUnit's XML."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass

from gatewayd.mapping.compiled import Unreadable
from gatewayd.maptest.run import FileOutcome, MappingTestOutcome
from gatewayd.maptest.steps import FailedStep
from gatewayd.report.findings import finding_lines, finding_object
from gatewayd.report.format import counted, seconds
from gatewayd.report.printable import json_document, printable


@dataclass(frozen=True, slots=True)
class RunReport:
    """One run of `gatewayd test`."""

    files: tuple[FileOutcome, ...]
    """In the order of the command line."""
    unreadable: tuple[Unreadable, ...] = ()

    @property
    def passed(self) -> int:
        """Number of tests that passed."""
        return self.carried_out - self.failed

    @property
    def failed(self) -> int:
        """Number of tests that failed."""
        return sum(file.failed for file in self.files)

    @property
    def carried_out(self) -> int:
        """Number of tests that passed or failed."""
        return sum(len(file.outcomes) for file in self.files)

    @property
    def broken(self) -> int:
        """Number of files with errors."""
        return sum(bool(file.errors) for file in self.files)


def file_text(file: FileOutcome, *, verbose: bool) -> str:
    """The findings and failures of one file, each with place and hint; with `verbose` what passed too."""
    lines = [line for finding in file.findings for line in finding_lines(finding)]
    for outcome in file.outcomes:
        lines.extend(line for failure in outcome.failures for line in _failure_lines(outcome, failure))
        if verbose and outcome.passed:
            place, name = printable(str(outcome.test.position)), printable(outcome.test.name)
            lines.append(f'{place}: passed: "{name}" ({seconds(outcome.seconds)} simulated)')
    if not file.tests and not file.errors:
        lines.append(printable(f"{file.file}: has no tests (`tests:`)"))
    return "".join(f"{line}\n" for line in lines)


def summary(report: RunReport) -> str:
    """What could not be read, and a line with the counts."""
    lines = [f"{item.name}: cannot be read: {item.reason}" for item in report.unreadable]
    return "".join(f"{printable(line)}\n" for line in (*lines, _counts(report)))


def _counts(report: RunReport) -> str:
    parts = [f"{counted(report.carried_out, 'test')} carried out"]
    if report.carried_out:
        parts.append(f"{report.passed} passed, {report.failed} failed")
    if report.broken:
        parts.append(f"{counted(report.broken, 'file')} with errors")
    if report.unreadable:
        parts.append(f"{counted(len(report.unreadable), 'file')} not readable")
    return ", ".join(parts)


def as_json(report: RunReport) -> str:
    """One JSON document: `version`, `files`, `tests`, `passed`, `failed`, `unreadable`; keys are only ever added.

    A file has `file`, `cell`, `findings` as `gatewayd check` has them, and `tests`: `name`, `line`, `column`, `passed`,
    `seconds` (simulated) and `failures`, each with `step`, `line`, `column`, `message` and `hint`.
    """
    return json_document(
        {
            "version": 1,
            "tests": report.carried_out,
            "passed": report.passed,
            "failed": report.failed,
            "files": [
                {
                    "file": file.file,
                    "cell": file.cell,
                    "findings": [finding_object(finding) for finding in file.findings],
                    "tests": [_test_object(outcome) for outcome in file.outcomes],
                }
                for file in report.files
            ],
            "unreadable": [{"file": item.name, "reason": item.reason} for item in report.unreadable],
        }
    )


def as_junit(report: RunReport) -> str:
    """JUnit's XML: a suite for each file, a case for each test; a file with errors is a case `check` in error.

    `time` is simulated seconds, so that the same files give the same document.
    """
    root = ET.Element("testsuites", name="gatewayd test")
    cases = [_suite(file) for file in report.files]
    cases += [_unreadable(item) for item in report.unreadable]
    root.extend(cases)
    for key in ("tests", "failures", "errors"):
        root.set(key, str(sum(int(suite.get(key, "0")) for suite in cases)))
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


# -- inside -----------------------------------------------------------------------------------------------------------


def _failure_text(outcome: MappingTestOutcome, failure: FailedStep) -> str:
    return f'failed: "{printable(outcome.test.name)}": step {failure.step}: {printable(failure.message)}'


def _failure_lines(outcome: MappingTestOutcome, failure: FailedStep) -> Iterator[str]:
    yield f"{printable(str(failure.position))}: {_failure_text(outcome, failure)}"
    yield f"    hint: {printable(failure.hint)}"


def _test_object(outcome: MappingTestOutcome) -> dict[str, object]:
    return {
        "name": outcome.test.name,
        "line": outcome.test.position.line,
        "column": outcome.test.position.column,
        "passed": outcome.passed,
        "seconds": outcome.seconds,
        "failures": [
            {
                "step": failure.step,
                "line": failure.position.line,
                "column": failure.position.column,
                "message": failure.message,
                "hint": failure.hint,
            }
            for failure in outcome.failures
        ],
    }


def _suite(file: FileOutcome) -> ET.Element:
    suite = _empty_suite(
        file.file,
        tests=len(file.outcomes) + bool(file.errors),
        failures=file.failed,
        errors=bool(file.errors),
    )
    if file.errors:
        text = "".join(f"{line}\n" for finding in file.errors for line in finding_lines(finding))
        first = file.errors[0]
        case = ET.SubElement(suite, "testcase", name="check", classname=file.cell or printable(file.file))
        ET.SubElement(case, "error", message=printable(first.message), type=first.rule.slug).text = text
    suite.extend([_case(file, outcome) for outcome in file.outcomes])
    return suite


def _case(file: FileOutcome, outcome: MappingTestOutcome) -> ET.Element:
    case = ET.Element(
        "testcase",
        name=printable(outcome.test.name),
        classname=file.cell,
        file=printable(file.file),
        line=str(outcome.test.position.line),
        time=f"{outcome.seconds:g}",
    )
    if outcome.failures:
        lines = [line for failure in outcome.failures for line in _failure_lines(outcome, failure)]
        message = printable(outcome.failures[0].message)
        ET.SubElement(case, "failure", message=message, type="expectation").text = "\n".join(lines) + "\n"
    return case


def _unreadable(item: Unreadable) -> ET.Element:
    suite = _empty_suite(item.name, tests=1, failures=0, errors=1)
    case = ET.SubElement(suite, "testcase", name="check", classname=printable(item.name))
    ET.SubElement(case, "error", message=printable(item.reason), type="unreadable")
    return suite


def _empty_suite(name: str, *, tests: int, failures: int, errors: int) -> ET.Element:
    return ET.Element(
        "testsuite", name=printable(name), tests=str(tests), failures=str(failures), errors=str(int(errors))
    )
