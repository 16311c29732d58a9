"""Results as people and programs read them."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET

from gatewayd.mapping.compiled import Unreadable
from gatewayd.maptest.report import RunReport, as_json, as_junit, file_text, summary
from gatewayd.maptest.run import run_file
from tests.maptest.written import loaded

TESTS = """\
a <lost> plc:
  - {by: plc, write: {start: true}}
  - {lost: plc, expect: {start: true}}
a held "value":
  - {by: plc, write: {part: 4}}
  - {lost: plc, expect: {part: 4}}
"""
FILE = run_file(loaded(TESTS))
BROKEN = run_file(loaded("a:\n  - {expect: {strat: true}}"))
REPORT = RunReport((FILE, BROKEN), (Unreadable("no.yaml", "No such file or directory"),))


def test_text_names_what_failed() -> None:
    failed, hint = file_text(FILE, verbose=False).splitlines()
    assert failed.startswith(
        'cell.yaml:30:35: failed: "a <lost> plc": step 2: expected start true, is false ('
    )
    assert hint == "    hint: a release gives the robot its `on_release`: clear"


def test_verbose_text_names_what_passed() -> None:
    last = file_text(FILE, verbose=True).splitlines()[-1]
    assert last == 'cell.yaml:31:3: passed: "a held "value"" (0 s simulated)'


def test_text_of_a_file_with_errors_is_that_of_check() -> None:
    text = file_text(BROKEN, verbose=False)
    assert text.startswith(
        "cell.yaml:29:17: error GW901 test-unknown-variable: there is no variable `strat`\n"
    )


def test_summary_counts() -> None:
    assert summary(REPORT) == (
        "no.yaml: cannot be read: No such file or directory\n"
        "2 tests carried out, 1 passed, 1 failed, 1 file with errors, 1 file not readable\n"
    )
    assert summary(RunReport(())) == "no tests carried out\n"


def test_json_has_it_all() -> None:
    document = json.loads(as_json(REPORT))
    assert {key: document[key] for key in ("version", "tests", "passed", "failed")} == {
        "version": 1, "tests": 2, "passed": 1, "failed": 1,
    }  # fmt: skip
    first, broken = document["files"]
    assert [test["passed"] for test in first["tests"]] == [False, True]
    (failure,) = first["tests"][0]["failures"]
    assert (failure["step"], failure["line"], failure["column"]) == (2, 30, 35)
    assert broken["findings"][0]["rule"] == "GW901"
    assert document["unreadable"] == [{"file": "no.yaml", "reason": "No such file or directory"}]


def test_junit_is_xml_with_the_same_counts() -> None:
    root = ET.fromstring(as_junit(REPORT))  # noqa: S314 - our own
    assert (root.get("tests"), root.get("failures"), root.get("errors")) == ("4", "1", "2")
    assert [suite.get("name") for suite in root] == ["cell.yaml", "cell.yaml", "no.yaml"]
    case = root[0][0]
    assert (case.get("name"), case.get("classname"), case.get("line")) == ("a <lost> plc", "press-3", "28")
    failure = case.find("failure")
    assert failure is not None
    assert failure.text is not None
    assert "cell.yaml:30:35" in failure.text
    assert root[0][1].find("failure") is None
    assert [case.find("error") is not None for suite in root[1:] for case in suite] == [True, True]
