"""Rules GW9xx: whether a test can be carried out, and whether it can fail."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final, TypeAlias

from gatewayd.core.definition import Direction, Value, ValueKind
from gatewayd.mapping.diagnostics import Diagnostic, Rule, Severity
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.mapping.source import shown
from gatewayd.mapping.testing import (
    ACTIONS,
    EXPECTATIONS,
    FREE,
    OPERATOR_NAME,
    REFUSABLE,
    REQUESTS,
    StepSpec,
    action_of,
    values_of,
)
from gatewayd.report.wording import alternatives, did_you_mean, number, seconds

MAX_TESTS: Final = 1000
MAX_SECONDS: Final = 3600.0
"""Simulated time of one test."""
_NAMED: Final = (
    "write",
    "robot",
    "force",
    "unforce",
    "unavailable",
    "available",
    "expect",
    "owner",
    "quality",
)
"""Keys that name variables."""
_LOCKS: Final = ("take", "release")
"""Keys that name variables or groups."""
_WRITERS: Final = ("alive", "lost", "connected")
_SIDES: Final = {
    "robot": (Direction.OUTPUT, "the robot shows outputs", "let a writer write it: `by: plc, write: ...`"),
    "take": (Direction.INPUT, "only an input has a lock", "name an input"),
    "release": (Direction.INPUT, "only an input has a lock", "name an input"),
    "owner": (Direction.INPUT, "only an input has an owner", "name an input"),
}
"""Keys that hold for variables of one direction."""
_Step: TypeAlias = Part[StepSpec]


def _steps(cell: ExpandedCell) -> Iterator[_Step]:
    return (step for test in cell.document.tests for step in test.steps)


def _by_name(cell: ExpandedCell) -> Mapping[str, ExpandedVariable]:
    return {variable.name: variable for variable in cell.variables}


def _names(step: _Step, keys: Iterable[str]) -> Iterator[tuple[str, str | int, str]]:
    """Key, what stands under it (a name, or a position in a list), and the name."""
    for key in keys:
        found = getattr(step.spec, key)
        if isinstance(found, dict):
            yield from ((key, name, name) for name in found)
        elif isinstance(found, tuple):
            yield from ((key, position, name) for position, name in enumerate(found))


@cell_rule("GW901")
def test_unknown_variable(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A test that names a variable or group that the mapping does not have."""
    if not cell.document.tests:
        return
    declared = cell.document.declared("variables")
    broken = declared - {variable.part.name for variable in cell.variables}
    names = list(_by_name(cell))
    groups = {lock.name for lock in cell.locks if lock.group is not None}
    for step in _steps(cell):
        for key, place, name in _names(step, (*_NAMED, *_LOCKS)):
            known = [*names, *groups] if key in _LOCKS else names
            if name in known or name.partition("[")[0] in broken:
                continue
            family = name in declared
            message = f"`{name}` is several variables" if family else f"there is no variable `{name}`"
            hint = f"name one of them in quotes: '{name}[0]'" if family else "`gatewayd show` lists them"
            where = step.key_at(key, place) if isinstance(place, str) else step.at(key, place)
            yield rule.at(where, message, hint=hint if family else did_you_mean(name, known, hint))


@cell_rule("GW902")
def test_unknown_writer(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A test that names a writer that the mapping does not have."""
    writers = sorted(cell.document.declared("writers"))
    for step in _steps(cell):
        named = list(_names(step, _WRITERS))
        owners: dict[str, str] = step.spec.owner or {}
        known = {"by": [*writers, OPERATOR_NAME], "owner": [*writers, OPERATOR_NAME, FREE]}
        named += [("by", "", step.spec.by)] if step.spec.by is not None else []
        named += [("owner", variable, name) for variable, name in owners.items()]
        for key, place, name in named:
            choices = known.get(key, writers)
            if name not in choices:
                where = step.at(key, place) if place != "" else step.at(key)
                otherwise = f"write {alternatives(choices)}" if choices else "declare it in `writers:`"
                yield rule.at(
                    where, f"there is no writer `{name}`", hint=did_you_mean(name, choices, otherwise)
                )


@cell_rule("GW903")
def test_value(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A value in a test that the variable can never have."""
    variables = _by_name(cell)
    for step in _steps(cell):
        for key, values in values_of(step.spec).items():
            for name, value in values.items():
                variable = variables.get(name)
                meant = _meant(variable, value, may_be_refused=key in REFUSABLE) if variable else None
                if variable is not None and meant is not None:
                    text = str(value).lower() if isinstance(value, bool) else number(value)
                    message = f"`{name}` ({variable.target}, {variable.type}) cannot be {text}"
                    yield rule.at(step.at(key, name), message, hint=f"write {meant}")


def _meant(variable: ExpandedVariable, value: Value, *, may_be_refused: bool) -> str | None:
    """What should stand in the place of `value`; None: it fits, or it is tried whether it is refused."""
    if variable.kind is ValueKind.BOOL:
        return None if isinstance(value, bool) else "true or false"
    if isinstance(value, bool):
        return "a number"
    if variable.kind is ValueKind.FLOAT or variable.low is None or variable.high is None:
        return None
    if value != int(value):
        return f"a whole number from {variable.low} to {variable.high}"
    fits = may_be_refused or variable.low <= value <= variable.high
    return None if fits else f"a whole number from {variable.low} to {variable.high}"


@cell_rule("GW904")
def test_wrong_side(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A test that lets the robot show an input, or asks for the owner of an output."""
    variables = _by_name(cell)
    for step in _steps(cell):
        for key, place, name in _names(step, _SIDES):
            variable = variables.get(name)
            direction, why, hint = _SIDES[key]
            if variable is not None and variable.direction is not direction:
                where = step.key_at(key, place) if isinstance(place, str) else step.at(key, place)
                message = f"`{name}` is an {variable.direction.value}, but {why}"
                yield rule.at(where, message, hint=hint)


@cell_rule("GW905")
def test_step_incomplete(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A step of a test in which several things happen, or a part is missing."""
    for step in _steps(cell):
        for key, applies, message, hint in _FAULTS:
            if applies(step.spec):
                yield rule.at(step.at(key) if key else step.at(), message, hint=hint)
                break
        else:
            yield from _several(rule, step)


def _several(rule: Rule, step: _Step) -> Iterator[Diagnostic]:
    happening = [key for key in step.spec.model_fields_set if key in ACTIONS]
    if len(happening) > 1:
        first, second = sorted(happening, key=step.key_at)[:2]
        message = f"`{first}` and `{second}` both happen in this step, and nothing says which comes first"
        yield rule.at(step.key_at(second), message, hint="make two steps of it")


_FAULTS: Final[tuple[tuple[str, Callable[[StepSpec], bool], str, str], ...]] = (
    (
        "by",
        lambda step: step.by is not None and action_of(step) not in REQUESTS,
        "the step does not say what this writer does",
        "add `write: {...}`, `take: ...` or `release: ...`",
    ),
    (
        "by",
        lambda step: step.by == OPERATOR_NAME and step.write is not None,
        f"the {OPERATOR_NAME} does not write",
        "write `force: {...}` without `by`",
    ),
    (
        "",
        lambda step: step.by is None and action_of(step) in REQUESTS,
        "the step does not say who does it",
        "add `by:` and the name of a writer",
    ),
    (
        "refused",
        lambda step: step.refused is not None and action_of(step) not in REFUSABLE,
        "nothing in this step can be refused",
        f"let it stand in the step with {alternatives(REFUSABLE)}",
    ),
    (
        "alive",
        lambda step: step.alive is not None and step.after is None,
        "`alive` is about the time of `after`",
        "add `after: 1s`, or remove it",
    ),
    (
        "repeat_for",
        lambda step: step.repeat_for is not None and step.write is None,
        "only a write is repeated",
        "add `write: {...}`, or write `after` for time that passes",
    ),
)
"""Key (empty: the whole step), whether a step has the fault, what it is, and the remedy."""


@cell_rule("GW906", Severity.WARNING)
def test_cannot_fail(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A test in which nothing is expected and nobody asks for anything."""
    for test in cell.document.tests:
        keys = {key for step in test.steps for key in step.spec.model_fields_set}
        if not keys.intersection((*EXPECTATIONS, *REFUSABLE, *_LOCKS)):
            message = f"the test `{shown(test.name)}` cannot fail"
            yield rule.at(test.position, message, hint="add what has to be so: `expect: {start: false}`")


@cell_rule("GW907")
def test_too_long(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """More tests, or a test of more simulated time, than is carried out."""
    tests = cell.document.tests
    if len(tests) > MAX_TESTS:
        message = f"the file has {len(tests)} tests, the limit is {MAX_TESTS}"
        yield rule.at(
            tests[MAX_TESTS].position, message, hint="put some of them into the file of another cell"
        )
    for test in tests:
        if test.seconds > MAX_SECONDS:
            message = (
                f"the steps of this test take {seconds(test.seconds)}, the limit is {seconds(MAX_SECONDS)}"
            )
            hint = "split it, or wait for less: leases and time-outs end to the tick of 20 ms"
            yield rule.at(test.position, message, hint=hint)
