"""The section `tests:`: what is read of it, and that nothing else depends on it."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.mapping.loader import load, load_together
from gatewayd.mapping.testing import OPERATOR_NAME, action_of, values_of
from gatewayd.mapping.worker import compile_files
from gatewayd.report.diff import compare
from tests.maptest.written import MAPPING, loaded

PLAIN = load(MAPPING.encode(), "cell.yaml")


def found(tests: str) -> list[tuple[str, str]]:
    """Rule and message of all that is found in tests."""
    return [
        (finding.rule.id, finding.message)
        for finding in loaded(tests).diagnostics
        if finding not in PLAIN.diagnostics
    ]


def test_a_step_is_read() -> None:
    (test,) = loaded("a plc:\n  - {after: 3s, by: plc, write: {speed: 5}, refused: held}").cell.document.tests
    step = test.steps[0].spec
    assert (test.name, test.seconds, step.after, step.by, step.refused) == ("a plc", 3.0, 3.0, "plc", "held")
    assert (action_of(step), values_of(step)) == ("write", {"write": {"speed": 5}})


MISTAKES = {
    "no list": ("a: {after: 1s}", "GW110"),
    "no steps": ("a: []", "GW110"),
    "no name": ("'': [{expect: {start: true}}]", "GW113"),
    "unknown key": ("a: [{expects: {start: true}}]", "GW108"),
    "no unit": ("a: [{after: 3}]", "GW112"),
    "no reason": ("a: [{by: plc, write: {start: true}, refused: busy}]", "GW114"),
    "no robot word": ("a: [{robot: gone}]", "GW114"),
    "no value": ("a: [{expect: {start: maybe}}]", "GW110"),
    "no number": ("a: [{expect: {speed: 0x10}}]", "GW111"),
    "no variable name": ("a: [{expect: {'in bits': 1}}]", "GW113"),
    "a family": ("a: [{expect: {recipe: 1}}]", "GW901"),
    "an unknown group": ("a: [{by: plc, take: motoin}]", "GW901"),
    "an unknown owner": ("a: [{owner: {start: plv}}]", "GW902"),
    "an unknown writer alive": ("a: [{after: 1s, alive: [plc, plv], expect: {start: true}}]", "GW902"),
    "a number for a bit": ("a: [{expect: {start: 1}}]", "GW903"),
    "a bit for a number": ("a: [{expect: {speed: true}}]", "GW903"),
    "a fraction for an integer": ("a: [{by: plc, write: {part: 1.5}}]", "GW903"),
    "beyond the type": ("a: [{expect: {part: 3000000000}}]", "GW903"),
    "the owner of an output": ("a: [{owner: {cycles: plc}}]", "GW904"),
    "two actions": ("a: [{lost: plc, robot: lost, expect: {start: true}}]", "GW905"),
    "by without what": ("a: [{by: plc, expect: {start: true}}]", "GW905"),
    "the operator writes": (f"a: [{{by: {OPERATOR_NAME}, write: {{start: true}}}}]", "GW905"),
    "refused what": ("a: [{lost: plc, refused: held, expect: {start: true}}]", "GW905"),
    "alive when": ("a: [{alive: plc, expect: {start: true}}]", "GW905"),
    "repeated what": ("a: [{repeat_for: 1s, expect: {start: true}}]", "GW905"),
    "nothing to fail": ("a: [{robot: lost}]", "GW906"),
}


@pytest.mark.parametrize("tests,rule", MISTAKES.values(), ids=MISTAKES)
def test_mistakes_are_found(tests: str, rule: str) -> None:
    assert [one for one, _message in found(tests)] == [rule]


def test_all_mistakes_of_a_file_are_found_in_one_pass() -> None:
    tests = "a: [{expect: {strat: true}}, {lost: plv}]\nb: [{owner: {start: plv}}]"
    assert [rule for rule, _message in found(tests)] == ["GW901", "GW902", "GW902"]


def test_nothing_that_runs_depends_on_tests() -> None:
    """The plan is the same in every part, and so is the fingerprint; a reload sees no difference."""
    tested = loaded("a plc:\n  - {by: plc, write: {start: true}}")
    assert tested.plan == PLAIN.plan
    assert tested.plan is not None
    assert PLAIN.plan is not None
    assert compare(PLAIN.plan, tested.plan) == compare(PLAIN.plan, PLAIN.plan)


@pytest.mark.parametrize("tests", ["tests: 5", "tests: {a: [{expect: {strat: 1}}]}", "tests: {'': {}}"])
def test_a_mistake_in_a_test_keeps_no_cell_from_being_served(tests: str) -> None:
    text = (MAPPING + tests + "\n").encode()
    (checked,) = load_together([("cell.yaml", text)])
    (served,) = load_together([("cell.yaml", text)], tests=False)
    assert checked.plan is None
    assert served.plan == PLAIN.plan


def test_the_daemon_does_not_read_them(tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    path.write_text(MAPPING + "tests: {a: [{expect: {strat: 1}}]}\n", encoding="utf-8")
    assert len(compile_files([str(path)]).plans) == 1
