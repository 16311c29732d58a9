from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.modbus.client.polling import NEVER
from gatewayd.modbus.client.requests import ExceptionAnswer, TimedOut, write_register
from gatewayd.modbus.client.writes import MAX_KEYS, MAX_TRIES, RETRY_AFTER, PartWrite, WriteOrder, WriteQueue

SILENCE = TimedOut(0.3)


def order(value: int) -> WriteOrder:
    return write_register(0, value.to_bytes(2))


def drain(queue: WriteQueue) -> list[tuple[object, WriteOrder]]:
    found = []
    while queue.due < NEVER:
        found.append(queue.take(0))
        queue.confirmed()
    return found


@given(st.lists(st.tuples(st.sampled_from("abcd"), st.integers(0, 9))))
def test_newest_of_each_key_in_the_order_in_which_they_were_asked_for(asked: list[tuple[str, int]]) -> None:
    queue = WriteQueue()
    for key, value in asked:
        queue.put(key, order(value), None, 0)
    last = {key: place for place, (key, _) in enumerate(asked)}
    expected = [(key, order(value)) for place, (key, value) in enumerate(asked) if last[key] == place]
    assert drain(queue) == expected


def test_one_is_underway_at_a_time() -> None:
    queue = WriteQueue()
    queue.put("a", order(1), None, 0)
    queue.put("b", order(2), None, 0)
    queue.take(0)
    assert queue.due == NEVER
    queue.confirmed()
    assert queue.take(0) == ("b", order(2))


def test_unanswered_write_goes_again_before_what_was_asked_for_later() -> None:
    queue = WriteQueue()
    queue.put("a", order(1), None, 0)
    queue.put("b", order(2), None, 0)
    queue.take(5)
    assert not queue.failed(SILENCE, 5)
    assert queue.due == 5 + RETRY_AFTER
    assert queue.take(6) == ("a", order(1))


def test_newer_write_takes_the_place_of_an_unanswered_one() -> None:
    queue = WriteQueue()
    queue.put("a", order(1), None, 0)
    queue.take(0)
    queue.put("a", order(2), None, 0)
    assert not queue.failed(SILENCE, 0)
    assert drain(queue) == [("a", order(2))]


def test_write_that_is_never_answered_is_given_up() -> None:
    queue = WriteQueue()
    queue.put("a", order(1), None, 0)
    queue.put("b", order(2), None, 0)
    outcomes = []
    for _ in range(MAX_TRIES):
        assert queue.take(0)[0] == "a"
        outcomes.append(queue.failed(SILENCE, 0))
    assert outcomes == [False] * (MAX_TRIES - 1) + [True]
    queue.take(0)
    assert not queue.failed(SILENCE, 0), "another key has tries of its own"


@pytest.mark.parametrize(
    "code, given_up", [(1, True), (2, True), (3, True), (4, True), (5, False), (6, False), (0x0B, False)]
)
def test_refusal_is_final_unless_the_unit_is_busy(code: int, given_up: bool) -> None:
    queue = WriteQueue()
    queue.put("a", order(1), None, 0)
    queue.take(0)
    assert queue.failed(ExceptionAnswer(code), 0) is given_up
    assert len(queue) == (not given_up)


def test_repeats_until_another_write_has_the_key() -> None:
    queue = WriteQueue()
    queue.put("a", order(1), 2.0, 10)
    queue.take(10)
    queue.confirmed()
    assert queue.due == 12
    assert queue.take(12.5) == ("a", order(1))
    queue.confirmed()
    assert queue.due == 14.5
    queue.put("a", order(2), None, 13)
    queue.take(13)
    queue.confirmed()
    assert queue.due == NEVER


def test_refused_write_is_repeated_all_the_same() -> None:
    queue = WriteQueue()
    queue.put("a", order(1), 2.0, 10)
    queue.take(10)
    assert queue.failed(ExceptionAnswer(2), 10)
    assert queue.due == 12


def test_cancel_and_clear_leave_nothing() -> None:
    queue = WriteQueue()
    queue.put("a", order(1), 1.0, 0)
    queue.put("b", order(2), 1.0, 0)
    queue.cancel("a")
    assert queue.clear() == 1
    assert queue.due == NEVER


@pytest.mark.parametrize("is_lost", [False, True])
def test_write_underway_is_not_tried_again_after_clear(is_lost: bool) -> None:
    queue = WriteQueue()
    queue.put("a", order(1), None, 0)
    queue.take(0)
    queue.clear()
    if is_lost:
        queue.put_back()
    else:
        assert queue.failed(SILENCE, 0)
    assert queue.due == NEVER


def test_lost_write_goes_again_as_if_it_had_not_been_sent() -> None:
    queue = WriteQueue()
    queue.put("a", order(1), None, 0)
    queue.put("b", order(2), None, 0)
    queue.take(0)
    queue.put_back()
    assert drain(queue) == [("a", order(1)), ("b", order(2))]


def test_queue_is_bounded() -> None:
    queue = WriteQueue()
    for key in range(MAX_KEYS):
        queue.put(key, order(1), None, 0)
    with pytest.raises(ValueError, match="4096"):
        queue.put("one more", order(1), None, 0)


@given(st.integers(0, 0xFFFF), st.integers(0, 0xFFFF), st.integers(0, 0xFFFF))
def test_part_changes_its_bits_only(register: int, mask: int, value: int) -> None:
    merged = PartWrite(0, mask, value).merged(register)
    assert merged & mask == value & mask
    assert merged & ~mask == register & ~mask
