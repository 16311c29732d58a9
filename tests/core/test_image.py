from __future__ import annotations

import math

import pytest

from gatewayd.core.definition import CellDefinition
from gatewayd.core.image import ProcessImage, Quality

START, PART = 0, 2
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
    image.outputs_told(1.0)
    image.outputs_told(2.0)
    assert image.times[CYCLES] == -math.inf
    assert (image.age(CYCLES, 5.0), image.age(ALARM, 5.0)) == (3.0, 3.0)
    assert image.unreadable == frozenset()


def test_a_stale_value_keeps_the_time_it_was_told(image: ProcessImage) -> None:
    image.tell(START, True, 1.0)
    image.outputs_told(1.0)
    image.inputs_lost()
    image.outputs_lost()
    assert (image.age(START, 5.0), image.age(LEVEL, 5.0)) == (4.0, 4.0)
    assert (image.quality[START], image.quality[LEVEL]) == (Quality.STALE, Quality.STALE)


def test_an_output_that_is_gone_shows_its_policy_and_no_age(image: ProcessImage) -> None:
    image.outputs_told(1.0)
    image.values[MODE] = 3
    image.set_available(MODE, available=False)
    image.outputs_told(2.0)
    assert (image.values[MODE], image.quality[MODE]) == (99, Quality.UNAVAILABLE)
    assert image.time_of(MODE) == -math.inf


def test_an_output_that_comes_back_is_good_with_the_next_package(image: ProcessImage) -> None:
    image.set_available(ALARM, available=False)
    image.outputs_told(1.0)
    image.set_available(ALARM, available=True)
    assert (image.quality[ALARM], image.quality[CYCLES]) == (Quality.NEVER, Quality.GOOD)
    assert image.unreadable == {ALARM}
    image.outputs_told(1.1)
    assert image.quality[ALARM] is Quality.GOOD
    assert image.unreadable == frozenset()


def test_what_the_controller_holds_in_a_register_of_somebody_else_is_shown_but_not_good(
    image: ProcessImage,
) -> None:
    image.set_available(PART, available=False)
    image.tell(PART, 17, 1.0)
    assert (image.values[PART], image.quality[PART]) == (17, Quality.UNAVAILABLE)
    image.set_available(PART, available=True)
    assert image.quality[PART] is Quality.STALE
