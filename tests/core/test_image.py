from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.definition import (
    CellDefinition,
    Direction,
    Fallback,
    FallbackKind,
    Value,
    ValueKind,
    Variable,
)
from gatewayd.core.image import ProcessImage, Quality

START, PART, SPEED = 0, 2, 4
CYCLES, LEVEL, MODE, ALARM = range(6, 10)


@pytest.fixture
def image(press: CellDefinition) -> ProcessImage:
    return ProcessImage(press.variables)


def test_in_the_beginning_nothing_was_told_and_outputs_show_their_policies(image: ProcessImage) -> None:
    assert image.values == [False, False, 0, 0.0, 0.0, 0, 0, 0.0, 99, False]
    assert set(image.quality) == {Quality.NEVER}
    assert image.unreadable == {ALARM}
    assert image.age(START, 5.0) == image.age(CYCLES, 5.0) == math.inf


def test_losing_what_was_never_told_leaves_it_never(image: ProcessImage) -> None:
    image.inputs_lost()
    image.outputs_lost()
    assert set(image.quality) == {Quality.NEVER}


def test_outputs_share_the_time_of_the_last_package(image: ProcessImage) -> None:
    image.outputs_stored(1.0)
    image.outputs_stored(2.0)
    assert image.times[CYCLES] == -math.inf
    assert (image.age(CYCLES, 5.0), image.age(ALARM, 5.0)) == (3.0, 3.0)
    assert image.unreadable == frozenset()


def test_a_stale_value_keeps_the_time_it_was_told(image: ProcessImage) -> None:
    image.store(START, True, 1.0)
    image.outputs_stored(1.0)
    image.inputs_lost()
    image.outputs_lost()
    assert (image.age(START, 5.0), image.age(LEVEL, 5.0)) == (4.0, 4.0)
    assert (image.quality[START], image.quality[LEVEL]) == (Quality.STALE, Quality.STALE)


def test_an_output_that_is_gone_shows_its_policy_and_no_age(image: ProcessImage) -> None:
    image.outputs_stored(1.0)
    image.values[MODE] = 3
    image.set_available(MODE, available=False)
    image.outputs_stored(2.0)
    assert (image.values[MODE], image.quality[MODE]) == (99, Quality.UNAVAILABLE)
    assert image.time_of(MODE) == -math.inf


def test_an_output_that_comes_back_is_good_with_the_next_package(image: ProcessImage) -> None:
    image.set_available(ALARM, available=False)
    image.outputs_stored(1.0)
    image.set_available(ALARM, available=True)
    assert (image.quality[ALARM], image.quality[CYCLES]) == (Quality.NEVER, Quality.GOOD)
    assert image.unreadable == {ALARM}
    image.outputs_stored(1.1)
    assert image.quality[ALARM] is Quality.GOOD
    assert image.unreadable == frozenset()


def test_what_the_controller_holds_in_a_register_of_somebody_else_is_shown_but_not_good(
    image: ProcessImage,
) -> None:
    image.set_available(PART, available=False)
    image.store(PART, 17, 1.0)
    assert (image.values[PART], image.quality[PART]) == (17, Quality.UNAVAILABLE)
    image.set_available(PART, available=True)
    assert image.quality[PART] is Quality.STALE


# -- what cannot be shown --------------------------------------------------------------------------------------------


def restricted(press: CellDefinition, *indices: int, nan: bool = False) -> ProcessImage:
    """Variables of which a place shows -100..100 only."""
    return ProcessImage(
        [
            replace(variable, shown=(-100.0, 100.0), shows_nan=nan) if index in indices else variable
            for index, variable in enumerate(press.variables)
        ]
    )


@pytest.mark.parametrize("value, fits", [(100.0, True), (-100.0, True), (100.1, False), (math.inf, False)])
def test_an_output_that_a_place_cannot_show_is_not_good(
    press: CellDefinition, value: float, fits: bool
) -> None:
    image = restricted(press, LEVEL)
    for present in (value, 0.0, value):
        image.values[LEVEL] = present
        image.outputs_stored(1.0)
        good = fits or present == 0.0
        assert image.quality[LEVEL] is (Quality.GOOD if good else Quality.OUT_OF_RANGE)
        assert image.values[LEVEL] == present
    assert image.quality[CYCLES] is Quality.GOOD
    assert image.age(LEVEL, 3.0) == 2.0


@pytest.mark.parametrize("nan", [True, False])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_good_where_every_place_can_show_it(
    press: CellDefinition, nan: bool, value: float
) -> None:
    image = restricted(press, LEVEL, SPEED, nan=nan)
    image.values[LEVEL] = value
    image.outputs_stored(1.0)
    image.store(SPEED, value, 1.0)
    expected = Quality.GOOD if nan else Quality.OUT_OF_RANGE
    assert (image.quality[LEVEL], image.quality[SPEED]) == (expected, expected)


def test_a_range_that_shows_no_nan_need_not_be_bounded(press: CellDefinition) -> None:
    level = replace(press.variables[LEVEL], shows_nan=False)
    image = ProcessImage([*press.variables[:LEVEL], level, *press.variables[LEVEL + 1 :]])
    qualities = []
    for value in (1e308, math.inf, math.nan, 0.0):
        image.values[LEVEL] = value
        image.outputs_stored(1.0)
        qualities.append(image.quality[LEVEL])
    assert qualities == [Quality.GOOD, Quality.OUT_OF_RANGE, Quality.OUT_OF_RANGE, Quality.GOOD]


def test_an_input_that_a_place_cannot_show_is_not_good(press: CellDefinition) -> None:
    image = restricted(press, PART)
    image.store(PART, 101, 1.0)
    assert image.quality[PART] is Quality.OUT_OF_RANGE
    image.inputs_lost()
    assert image.quality[PART] is Quality.STALE
    image.store(PART, 99, 2.0)
    assert image.quality[PART] is Quality.GOOD
    image.set_available(PART, available=False)
    image.store(PART, 101, 3.0)
    assert image.quality[PART] is Quality.UNAVAILABLE


def test_stale_and_unavailable_say_more_than_out_of_range(press: CellDefinition) -> None:
    image = restricted(press, LEVEL, CYCLES)
    image.values[LEVEL] = image.values[CYCLES] = 500
    image.set_available(CYCLES, available=False)
    image.outputs_stored(1.0)
    assert (image.quality[LEVEL], image.quality[CYCLES]) == (Quality.OUT_OF_RANGE, Quality.UNAVAILABLE)
    image.outputs_lost()
    assert (image.quality[LEVEL], image.quality[CYCLES]) == (Quality.STALE, Quality.UNAVAILABLE)


def test_an_exception_output_that_cannot_be_shown_cannot_be_read(press: CellDefinition) -> None:
    image = restricted(press, ALARM)
    for value, unreadable in ((True, frozenset[int]()), (1000, {ALARM}), (False, frozenset[int]())):
        image.values[ALARM] = value
        image.outputs_stored(1.0)
        assert image.unreadable == unreadable


# -- valid while the program runs ------------------------------------------------------------------------------------


@pytest.fixture
def program(press: CellDefinition) -> ProcessImage:
    """Every output is valid only while the program runs."""
    return ProcessImage([replace(variable, valid_running=True) for variable in press.variables])


def show(image: ProcessImage, values: list[Value], now: float, *, running: bool) -> None:
    image.uncover()
    image.values[CYCLES:] = values
    image.running = running
    image.outputs_stored(now)


def test_outputs_of_a_program_that_does_not_run_show_their_policies(program: ProcessImage) -> None:
    show(program, [5, 2.5, 3, True], 1.0, running=True)
    assert set(program.quality[CYCLES:]) == {Quality.GOOD}
    assert program.unreadable == frozenset()
    for now in (2.0, 3.0):
        show(program, [6, 3.5, 4, True], now, running=False)
        assert program.values[CYCLES:] == [0, 2.5, 99, True]
        assert set(program.quality[CYCLES:]) == {Quality.NOT_RUNNING}
        assert program.age(LEVEL, 4.0) == 3.0
        assert program.unreadable == {ALARM}
    show(program, [7, 4.5, 5, False], 4.0, running=True)
    assert program.values[CYCLES:] == [7, 4.5, 5, False]
    assert set(program.quality[CYCLES:]) == {Quality.GOOD}
    assert program.age(LEVEL, 4.0) == 0.0


def test_what_is_covered_comes_back_before_the_next_package(program: ProcessImage) -> None:
    """A link spreads the bits of a word only when the word has changed."""
    show(program, [5, 2.5, 3, True], 1.0, running=False)
    assert program.values[CYCLES] == 0
    program.uncover()
    assert program.values[CYCLES:] == [5, 2.5, 3, True]


def test_a_program_that_never_ran_leaves_nothing_that_was_told(program: ProcessImage) -> None:
    show(program, [5, 2.5, 3, True], 1.0, running=False)
    assert program.values[CYCLES:] == [0, 0.0, 99, True]
    assert program.age(LEVEL, 2.0) == math.inf
    program.outputs_lost()
    assert set(program.quality[CYCLES:]) == {Quality.NEVER}


def test_what_is_held_is_never_from_a_program_that_did_not_run(program: ProcessImage) -> None:
    show(program, [5, 2.5, 3, True], 1.0, running=True)
    show(program, [6, 3.5, 4, True], 2.0, running=False)
    program.uncover()
    program.outputs_lost()
    assert (program.values[LEVEL], program.quality[LEVEL]) == (2.5, Quality.STALE)
    assert program.age(LEVEL, 3.0) == 2.0


def test_a_field_that_the_controller_does_not_have_is_unavailable_whatever_runs(
    program: ProcessImage,
) -> None:
    show(program, [5, 2.5, 3, True], 1.0, running=True)
    program.set_available(LEVEL, available=False)
    show(program, [6, 2.5, 4, True], 2.0, running=False)
    assert program.quality[LEVEL] is Quality.UNAVAILABLE


def test_it_may_be_out_of_range_only_while_it_runs(press: CellDefinition) -> None:
    level = replace(press.variables[LEVEL], valid_running=True, shown=(0.0, 1.0))
    image = ProcessImage([*press.variables[:LEVEL], level, *press.variables[LEVEL + 1 :]])
    qualities = []
    for running, value in ((True, 7.0), (False, 7.0), (True, 7.0), (True, 0.5), (False, 0.5), (True, 0.5)):
        show(image, [0, value, 0, False], 1.0, running=running)
        qualities.append(image.quality[LEVEL])
    good, out, off = Quality.GOOD, Quality.OUT_OF_RANGE, Quality.NOT_RUNNING
    assert qualities == [out, off, out, good, off, good]


Step = tuple[str, bool, float]
REPORTED = {Quality.GOOD, Quality.STALE, Quality.OUT_OF_RANGE, Quality.NOT_RUNNING}


def same(one: Value, other: Value) -> bool:
    return one == other or (math.isnan(one) and math.isnan(other))


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["package", "lost", "available", "gone"]),
            st.booleans(),
            st.sampled_from([-200.0, 1.0, 50.0, 101.0, math.nan]),
        ),
        max_size=20,
    )
)
def test_only_what_the_robot_means_and_every_place_shows_is_good(steps: list[Step]) -> None:
    """One output against a naive account of it."""
    variable = Variable(
        1, "level", Direction.OUTPUT, ValueKind.FLOAT, "level",
        on_stale=Fallback(FallbackKind.HOLD), shown=(-100.0, 100.0), shows_nan=False, valid_running=True,
    )  # fmt: skip
    image = ProcessImage([variable])
    available, held, since, quality = True, 0.0, -math.inf, Quality.NEVER
    for now, (step, running, value) in enumerate(steps):
        if step == "package":
            image.uncover()
            if available:
                image.values[0] = value
            image.running = running
            image.outputs_stored(float(now))
            if running:
                since = now
            if available and running:
                held = value
                quality = Quality.GOOD if -100 <= value <= 100 else Quality.OUT_OF_RANGE
            elif available:
                quality = Quality.NOT_RUNNING
        elif step == "lost":
            image.outputs_lost()
            if quality not in (Quality.UNAVAILABLE, Quality.NEVER):
                quality = Quality.STALE if since > -math.inf else Quality.NEVER
        else:
            available = step == "available"
            image.set_available(0, available=available)
            if not available:
                quality = Quality.UNAVAILABLE
            else:
                known = quality in REPORTED and since > -math.inf
                quality = Quality.STALE if known else Quality.NEVER
        assert image.quality[0] is quality
        assert same(image.values[0], held)
