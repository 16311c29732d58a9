"""Findings as text, JSON and GitHub annotations."""

from __future__ import annotations

import json

from gatewayd.mapping.compiled import Unreadable
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule, Severity
from gatewayd.report.findings import CheckOutcome, as_github, as_json, as_text

_OVERLAP = Rule("GW201", "register-overlap", Severity.ERROR, "two variables share a register", "why")
_OPEN = Rule("GW217", "open-listener", Severity.WARNING, "everybody may connect", "why")


def _error() -> Diagnostic:
    related = (Related(Position("a.yaml", 3, 7), "`x` is here"),)
    return _OVERLAP.at(Position("a.yaml", 4, 9), "`y` lies on `x`", hint="move it to 12", related=related)


def _warning() -> Diagnostic:
    return _OPEN.at(Position("b,1:2.yaml", 1, 1), "100% open\r\nsecond line")


def test_text_names_place_rule_message_and_remedy() -> None:
    """The text form is one line per finding, details indented, a summary at the end."""
    outcome = CheckOutcome(("a.yaml", "b,1:2.yaml"), (_error(), _warning()))
    assert as_text(outcome).splitlines() == [
        "a.yaml:4:9: error GW201 register-overlap: `y` lies on `x`",
        "    a.yaml:3:7: `x` is here",
        "    hint: move it to 12",
        "b,1:2.yaml:1:1: warning GW217 open-listener: 100% open\\r\\nsecond line",
        "",
        "2 files checked: 1 error, 1 warning",
    ]


def test_text_of_a_clean_run_is_one_line() -> None:
    """Nothing found is said, not left silent."""
    assert as_text(CheckOutcome(("a.yaml",), ())) == "1 file checked: no findings\n"


def test_text_lists_unreadable_files() -> None:
    """A file that could not be read has a line with the reason and counts in the summary."""
    outcome = CheckOutcome((), (), (Unreadable("c.yaml", "No such file or directory"),))
    assert as_text(outcome).splitlines() == [
        "c.yaml: cannot be read: No such file or directory",
        "",
        "no files checked, 1 file not readable",
    ]


def test_text_is_coloured_only_on_demand() -> None:
    """Escape sequences appear with `colour` alone."""
    outcome = CheckOutcome(("a.yaml",), (_error(),))
    assert "\x1b" not in as_text(outcome)
    assert "\x1b[31m\x1b[1merror GW201\x1b[0m" in as_text(outcome, colour=True)


def test_text_escapes_control_characters() -> None:
    """What a file says cannot steer the terminal."""
    finding = _OPEN.at(Position("a.yaml", 1, 1), "`\x1b[2J\udc80`")
    line = as_text(CheckOutcome(("a.yaml",), (finding,))).splitlines()[0]
    assert line == r"a.yaml:1:1: warning GW217 open-listener: `\x1b[2J\udc80`"


def test_remarks_stand_before_the_summary() -> None:
    """They are no findings, and change no exit code."""
    outcome = CheckOutcome(("a.yaml",), (), remarks=(("a.yaml", "NaN reaches the robot"),))
    assert as_text(outcome) == "a.yaml: NaN reaches the robot\n1 file checked: no findings\n"


def test_json_is_complete() -> None:
    """The JSON form holds everything that the text form shows."""
    remarks = (("a.yaml", "NaN reaches the robot"),)
    document = json.loads(
        as_json(CheckOutcome(("a.yaml",), (_error(),), (Unreadable("c", "gone"),), remarks))
    )
    assert document == {
        "version": 1,
        "files": ["a.yaml"],
        "errors": 1,
        "warnings": 0,
        "findings": [
            {
                "rule": "GW201",
                "slug": "register-overlap",
                "family": "Modbus",
                "severity": "error",
                "file": "a.yaml",
                "line": 4,
                "column": 9,
                "message": "`y` lies on `x`",
                "hint": "move it to 12",
                "related": [{"file": "a.yaml", "line": 3, "column": 7, "message": "`x` is here"}],
            },
        ],
        "unreadable": [{"file": "c", "reason": "gone"}],
        "remarks": [{"file": "a.yaml", "remark": "NaN reaches the robot"}],
    }


def test_github_annotations_are_escaped() -> None:
    """Percent signs and line ends are escaped in the text, commas and colons in the properties too."""
    outcome = CheckOutcome(("a.yaml",), (_error(), _warning()), (Unreadable("c", "gone"),))
    assert as_github(outcome).splitlines() == [
        (
            "::error file=a.yaml,line=4,col=9,title=GW201 register-overlap::"
            "`y` lies on `x`%0Aa.yaml:3:7: `x` is here%0Ahint: move it to 12"
        ),
        "::warning file=b%2C1%3A2.yaml,line=1,col=1,title=GW217 open-listener::100%25 open\\r\\nsecond line",
        "::error file=c,title=unreadable::gone",
    ]
