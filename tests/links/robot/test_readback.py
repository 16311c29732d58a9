"""When a read-back is a difference; the comparison as a whole is in tests/links/robot/test_inputs.py."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.definition import Direction, ValueKind, Variable
from gatewayd.links.robot.inputs import ClaimedInputs
from gatewayd.links.robot.readback import Echo, Package, ReadBack, same
from gatewayd.links.robot.transfer import InputTransfer
from gatewayd.rtde.claims import InputRecipe
from gatewayd.rtde.fields import Series
from gatewayd.rtde.messages import ControllerVersion
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.session import Session
from gatewayd.rtde.types import DataType

FIELD = "input_int_register_0"
VARIABLE = Variable(1, "number", Direction.INPUT, ValueKind.INT, FIELD)
RECIPE = Recipe((FIELD,), (DataType.INT32,))
TRANSFER = InputTransfer((VARIABLE,), RECIPE.names, RECIPE.slots)


def read(back: ReadBack, sent: int, held: int, now: float) -> None:
    back.compare(TRANSFER, (sent,), Package((held,), [0.0], (), 0.0, now))


def test_same_knows_nan_and_lengths() -> None:
    assert same((1, math.nan), (1.0, math.nan))
    assert not same((1,), (2,))
    assert not same((1,), (1, 2))


def test_the_round_trip_is_measured_and_fades() -> None:
    back = ReadBack(RECIPE.slots, 0.01)
    back.note(FIELD, (0,), 0.0, is_sent=False)
    read(back, 0, 0, 0.0)
    back.note(FIELD, (1,), 1.0, is_sent=True)
    read(back, 1, 0, 1.1)
    read(back, 1, 1, 1.4)
    assert back.round_trip == 1.4 - 1.0
    back.note(FIELD, (2,), 2.0, is_sent=True)
    read(back, 2, 2, 2.0)
    assert 0.3 < back.round_trip < 0.4


def test_what_was_adopted_or_foreign_measures_nothing() -> None:
    back = ReadBack(RECIPE.slots, 0.01)
    back.note(FIELD, (0,), 0.0, is_sent=False)
    read(back, 0, 0, 5.0)
    back.note(FIELD, (1,), 6.0, is_sent=True)
    read(back, 1, 99, 7.0)
    read(back, 1, 1, 16.0)
    assert back.round_trip == 0.01


def test_a_field_that_changes_faster_than_is_remembered_is_not_judged() -> None:
    back = ReadBack(RECIPE.slots, 5.0)
    for step in range(3000):
        back.note(FIELD, (step,), step * 0.001, is_sent=True)
    found = back.compare(TRANSFER, (2999,), Package((99999,), [0.0], (), 0.0, 3.0))
    assert not found.differ
    assert not found.is_settled


FIELDS = (FIELD, "input_double_register_0")
PAIR = Recipe(FIELDS, (DataType.INT32, DataType.DOUBLE))
VARIABLES = (VARIABLE, Variable(2, "real", Direction.INPUT, ValueKind.FLOAT, FIELDS[1]))
VALUES = st.tuples(st.integers(0, 2), st.sampled_from([0.0, 1.5, math.nan]))
STEPS = st.lists(
    st.tuples(
        st.sampled_from([0.002, 0.1, 0.6]),
        st.one_of(
            st.tuples(st.just("send"), VALUES),
            st.tuples(st.just("see"), VALUES),
            st.tuples(st.just("see what was sent"), st.integers(0, 5)),
            st.tuples(st.just("give"), st.integers(0, 1)),
        ),
    ),
    max_size=40,
)


@given(STEPS)
def test_a_recipe_compared_as_a_whole_is_judged_as_its_fields_are(steps: list[tuple[float, Any]]) -> None:
    """One side knows where packages have the whole recipe, the other compares field by field."""
    agreed = Session(
        ControllerVersion(5, 20, 0, 0), Series.E, 2, 0.002, PAIR, {"all": InputRecipe("all", 1, PAIR)}, ()
    )
    quick, thorough = ClaimedInputs(VARIABLES, agreed), ClaimedInputs(VARIABLES, agreed)
    for inputs in (quick, thorough):
        inputs.adopt(agreed, (0, 0.0), 0.0)
    (recipe,) = thorough._recipes
    recipe.echo = None
    now, values, given_at, differing = 0.0, [0, 0.0], [-math.inf, -math.inf], set[int]()
    sent: list[tuple[Any, ...]] = [(0, 0.0)]
    for pause, (what, detail) in steps:
        now += pause
        if what == "send":
            values[:] = [
                value if at > -math.inf else old
                for value, old, at in zip(detail, values, given_at, strict=True)
            ]
            due = list(quick.due(values, given_at, differing, now))
            assert repr(due) == repr(list(thorough.due(values, given_at, differing, now)))
            for package in due:
                quick.sent(package, now)
                thorough.sent(package, now)
                sent.append(package.values)
        elif what == "give":
            given_at[detail] = now
        else:
            flat = detail if what == "see" else sent[max(-1 - detail, -len(sent))]
            found = [
                inputs.compare(Package(flat, given_at, differing, 0.0, now)) for inputs in (quick, thorough)
            ]
            assert repr((found[0].differ, found[0].agree, found[0].follow)) == repr(
                (found[1].differ, found[1].agree, found[1].follow)
            )
            differing = (differing | found[0].differ.keys()) - found[0].agree
            for index, value in found[0].follow.items():
                values[index] = value


def test_a_whole_recipe_measures_its_round_trip_from_the_package_that_it_reads_back() -> None:
    back, echo = ReadBack(RECIPE.slots, 0.01), Echo(slice(0, 1))
    echo.note((0,), 0.0, is_sent=False)

    def shown(value: int, now: float) -> bool:
        return back.is_echoed(echo, Package((value,), [0.0], (), 0.0, now))

    assert shown(0, 0.5)
    echo.note((1,), 1.0, is_sent=True)
    assert shown(0, 1.1)
    assert shown(1, 1.25)
    assert back.round_trip == 0.25
    assert not shown(7, 1.3)
    assert not shown(0, 9.0), "too old to be in flight"
