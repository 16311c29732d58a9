from __future__ import annotations

import json

from gatewayd.doctor.report import CheckLine, DoctorReport, advice_text, as_json, line_text
from gatewayd.links.examination import Observation, Outcome

SLOW = Observation("data", Outcome.WARNING, "90 Hz instead of 125 Hz", "busy", "ask for less")
REFUSED = Observation("port", Outcome.PROBLEM, "refused", "off", "switch it on")
WELL = Observation.well("name", "fine")
SKIPPED = Observation("claims", Outcome.SKIPPED, "not asked")


def report(*lines: CheckLine) -> DoctorReport:
    return DoctorReport(("a.yaml",), lines=list(lines))


def test_problems_come_before_warnings_and_else_the_order_of_the_checks_holds() -> None:
    late = Observation("port", Outcome.PROBLEM, "taken")
    found = report(
        CheckLine("a", "robot", SLOW), CheckLine("a", "robot", REFUSED), CheckLine("a", "modbus", late)
    )
    assert [advice.observation for advice in found.advice] == [REFUSED, late, SLOW]


def test_the_same_of_several_cells_is_one_advice() -> None:
    found = report(
        CheckLine("a", "robot", REFUSED), CheckLine("b", "robot", REFUSED), CheckLine("b", "x", REFUSED)
    )
    assert [(advice.cells, advice.link) for advice in found.advice] == [(("a", "b"), "robot"), (("b",), "x")]


def test_what_to_do_is_told_with_cause_and_remedy() -> None:
    found = report(
        CheckLine("a", "robot", WELL), CheckLine("a", "robot", REFUSED), CheckLine("", "gateway", SLOW)
    )
    assert list(advice_text(found)) == [
        "What to do, the most important first:",
        "  1. a, robot: refused",
        "     cause:  off",
        "     remedy: switch it on",
        "  2. gateway: 90 Hz instead of 125 Hz",
        "     cause:  busy",
        "     remedy: ask for less",
        "3 checks: 1 problem, 1 warning",
    ]


def test_a_well_cell_needs_nothing() -> None:
    assert list(advice_text(report(CheckLine("a", "robot", WELL), CheckLine("a", "robot", SKIPPED)))) == [
        "1 check, 1 not made: nothing to do"
    ]


def test_texts_from_outside_cannot_steer_the_terminal() -> None:
    said = Observation("text", Outcome.PROBLEM, "a\x1b[2Jb\n", "c\x1b", "d\x1b")
    found = report(CheckLine("a", "robot", said))
    assert "".join(line_text(found.lines[0])) == "  robot     text            problem  a\\x1b[2Jb\\n"
    assert "\x1b" not in "".join(advice_text(found))
    assert "\x1b" not in as_json(found)


def test_the_document_has_everything() -> None:
    found = report(CheckLine("a", "robot", WELL), CheckLine("", "gateway", SLOW))
    found.unreadable = (("b.yaml", "No such file or directory"),)
    assert json.loads(as_json(found)) == {
        "version": 1,
        "well": False,
        "files": ["a.yaml"],
        "unreadable": [{"file": "b.yaml", "reason": "No such file or directory"}],
        "checks": [
            {
                "cell": "a", "link": "robot", "check": "name", "outcome": "ok", "text": "fine",
                "cause": None, "remedy": None,
            },
            {
                "cell": None, "link": "gateway", "check": "data", "outcome": "warning",
                "text": "90 Hz instead of 125 Hz", "cause": "busy", "remedy": "ask for less",
            },
        ],
        "advice": [
            {
                "cells": [], "link": "gateway", "check": "data", "outcome": "warning",
                "text": "90 Hz instead of 125 Hz", "cause": "busy", "remedy": "ask for less",
            }
        ],
    }  # fmt: skip


def test_a_file_that_was_not_read_is_not_well() -> None:
    found = report(CheckLine("a", "robot", WELL))
    assert json.loads(as_json(found))["well"]
    found.unreadable = (("b.yaml", "gone"),)
    assert not json.loads(as_json(found))["well"]
