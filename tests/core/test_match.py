"""What counts as the same in a new definition; what becomes of it is in test_succession.py."""

from __future__ import annotations

from dataclasses import replace

from gatewayd.core.definition import OPERATOR, CellDefinition, Writer
from gatewayd.core.match import Match, at

START, LAMP, PART, FORCE, SPEED, PATH = range(6)
PLC, HMI = range(2)
MOTION = 4


def renamed(definition: CellDefinition, index: int) -> CellDefinition:
    variables = list(definition.variables)
    variables[index] = replace(variables[index], name="renamed")
    return replace(definition, variables=tuple(variables))


def test_the_same_definition_goes_on_whole(press: CellDefinition) -> None:
    match = Match(press, press)
    assert match.variables == {index: index for index in range(len(press.variables))}
    assert match.locks == {index: index for index in range(len(press.locks))}
    assert match.inputs_without_successor() == []
    assert match.force_goes_on(START)


def test_a_renamed_input_is_another_one_in_the_same_register(press: CellDefinition) -> None:
    match = Match(press, renamed(press, SPEED))
    assert SPEED not in match.variables
    assert MOTION not in match.locks, "it has another member"
    assert not match.force_goes_on(PATH)
    assert list(match.due({SPEED})) == [SPEED]
    assert match.inputs_without_successor() == []


def test_writers_go_on_by_name_and_the_operator_always(press: CellDefinition) -> None:
    match = Match(press, replace(press, writers=(Writer("other"), *press.writers)))
    assert (match.writers[PLC], match.writers[OPERATOR]) == (PLC + 1, OPERATOR)
    assert match.may_keep(START, OPERATOR)
    assert not match.may_keep(START, PLC), "the owners in the new definition are others"


def test_indices_of_what_is_gone_and_of_nothing() -> None:
    assert [at({1: 2}, index) for index in (1, 3, None)] == [2, None, None]
