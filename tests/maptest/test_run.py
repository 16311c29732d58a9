"""Whole files: what is carried out, and how long it takes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from gatewayd.core.definition import Direction, ValueKind, Variable
from gatewayd.mapping.loader import load
from gatewayd.mapping.testing import ROBOT_WORDS
from gatewayd.maptest.actions import CellNames
from gatewayd.maptest.plant import Plant
from gatewayd.maptest.run import run_file
from gatewayd.maptest.steps import owner_of, quality_of, run_step, value_of
from tests.maptest.written import loaded, outcome, plant

MAPPINGS = sorted((Path(__file__).parents[2] / "mappings").glob("*.yaml"))


@pytest.mark.parametrize("path", MAPPINGS, ids=lambda path: path.name)
def test_the_tests_of_shipped_mappings_pass(path: Path) -> None:
    result = run_file(load(path.read_bytes(), str(path)))
    failed = [(str(one.position), one.message) for found in result.outcomes for one in found.failures]
    assert failed == []


def test_nothing_of_a_file_with_errors_is_carried_out() -> None:
    result = run_file(loaded("a:\n  - {expect: {start: true}}\nb:\n  - {expect: {strat: true}}"))
    assert [finding.rule.id for finding in result.errors] == ["GW901"]
    assert (result.outcomes, result.tests) == ((), 2)


def test_warnings_about_tests_are_told_and_stop_nothing() -> None:
    """Those about the mapping itself are for `gatewayd check`."""
    result = run_file(loaded("a:\n  - {after: 1s}"))
    assert [finding.rule.id for finding in result.findings] == ["GW906"]
    assert [one.passed for one in result.outcomes] == [True]


def test_only_some_are_carried_out() -> None:
    text = "a plc:\n  - {expect: {start: true}}\na lost plc:\n  - {expect: {start: false}}"
    result = run_file(loaded(text), lambda name: "lost" in name)
    assert [one.test.name for one in result.outcomes] == ["a lost plc"]
    assert result.failed == 0


def test_each_test_begins_anew() -> None:
    text = "a:\n  - {by: plc, write: {start: true}}\nb:\n  - {expect: {start: false}, owner: {start: free}}"
    assert [one.passed for one in run_file(loaded(text)).outcomes] == [True, True]


def test_a_hundred_steps_are_carried_out() -> None:
    """Simulated time costs none: 300 s of it here."""
    steps = ["{by: plc, write: {start: true}}", "{after: 6s, expect: {start: false}}"] * 50
    (one,) = outcome(*steps).outcomes
    assert (one.passed, one.seconds) == (True, 300.0)


# -- whatever the steps are -------------------------------------------------------------------------------------------

DEFINITION = plant().cell.definition
INPUTS = [variable for variable in DEFINITION.variables if variable.direction is Direction.INPUT]
OUTPUTS = [variable for variable in DEFINITION.variables if variable.direction is Direction.OUTPUT]
WRITERS = [writer.name for writer in DEFINITION.writers]
INTEGERS = st.integers(0, 6)


def value(variable: Variable) -> st.SearchStrategy[Any]:
    if variable.kind is ValueKind.BOOL:
        return st.booleans()
    return INTEGERS if variable.kind is ValueKind.INT else st.integers(-4, 404).map(lambda n: n / 4)


def values(variables: list[Variable]) -> st.SearchStrategy[dict[str, Any]]:
    one = st.sampled_from(variables).flatmap(lambda found: st.tuples(st.just(found.name), value(found)))
    return st.lists(one, min_size=1, max_size=3).map(dict)


def name(variables: list[Variable]) -> st.SearchStrategy[str]:
    return st.sampled_from([variable.name for variable in variables])


def requests(by: st.SearchStrategy[str]) -> st.SearchStrategy[dict[str, Any]]:
    locks = st.one_of(name(INPUTS), st.just("motion"))
    return st.one_of(
        st.fixed_dictionaries({"by": by, "take": locks}), st.fixed_dictionaries({"by": by, "release": locks})
    )


PHASES = (Phase.explicit, Phase.reuse, Phase.generate)
"""Sequences are short enough to be read as they come; shrinking them takes minutes."""
WRITER = st.sampled_from(WRITERS)
STEPS = st.lists(
    st.one_of(
        st.fixed_dictionaries({"by": WRITER, "write": values([*INPUTS, *OUTPUTS])}),
        st.fixed_dictionaries({"by": WRITER, "write": values(INPUTS), "repeat_for": st.just("400ms")}),
        requests(st.one_of(WRITER, st.just("operator"))),
        st.fixed_dictionaries({"lost": WRITER}),
        st.fixed_dictionaries({"connected": WRITER}),
        st.fixed_dictionaries({"robot": st.one_of(st.sampled_from(ROBOT_WORDS), values(OUTPUTS[:3]))}),
        st.fixed_dictionaries({"program": st.sampled_from(["stopped", "playing", "paused"])}),
        st.fixed_dictionaries({"force": values([*INPUTS, *OUTPUTS])}),
        st.fixed_dictionaries({"unforce": name([*INPUTS, *OUTPUTS])}),
        st.fixed_dictionaries({"unavailable": name([*INPUTS, *OUTPUTS])}),
        st.fixed_dictionaries({"available": name([*INPUTS, *OUTPUTS])}),
        st.fixed_dictionaries({"after": st.sampled_from(["10ms", "300ms", "2s", "5s"]), "alive": WRITER}),
    ),
    max_size=12,
)


def written(step: dict[str, Any]) -> str:
    """A step as YAML."""
    return "{" + ", ".join(f"{key}: {_yaml(found)}" for key, found in step.items()) + "}"


def _yaml(found: Any) -> str:
    if isinstance(found, dict):
        return "{" + ", ".join(f"'{key}': {_yaml(inner)}" for key, inner in found.items()) + "}"
    return str(found).lower() if isinstance(found, bool) else repr(found)


def carried_out(steps: list[dict[str, Any]]) -> Plant:
    """The plant after these steps, by the same code, whatever is refused."""
    one = plant()
    names = CellNames(one.cell.definition)
    if steps:
        (test,) = loaded(
            "it works:\n" + "\n".join(f"  - {written(step)}" for step in steps)
        ).cell.document.tests
        for number, part in enumerate(test.steps, 1):
            run_step(one, names, number, part)
    return one


def state(one: Plant) -> dict[str, Any]:
    """What `expect`, `owner` and `quality` say of everything."""
    indices = {variable.name: index for index, variable in enumerate(DEFINITION.variables)}
    return {
        "expect": {name: value_of(one, index) for name, index in indices.items()},
        "owner": {found.name: owner_of(one, indices[found.name]) for found in INPUTS},
        "quality": {name: quality_of(one, index) for name, index in indices.items()},
    }


@settings(max_examples=30, deadline=None, phases=PHASES)
@given(STEPS)
def test_whatever_happens_expecting_what_is_so_passes(steps: list[dict[str, Any]]) -> None:
    """No sequence of steps raises; each one that is refused says so; and what the core holds is what is expected."""
    one = carried_out(steps)
    found = loaded(f"it works:\n  - {written(state(one))}")
    assert [finding.message for finding in found.diagnostics if finding.rule.id.startswith("GW9")] == []
    (test,) = found.cell.document.tests
    assert run_step(one, CellNames(one.cell.definition), 1, test.steps[0]) == []


@settings(max_examples=15, deadline=None, phases=PHASES)
@given(STEPS)
def test_a_test_has_the_same_outcome_every_time(steps: list[dict[str, Any]]) -> None:
    assert state(carried_out(steps)) == state(carried_out(steps))
