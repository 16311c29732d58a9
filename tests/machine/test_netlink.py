"""What questions and answers of all kinds have in common; tests of routes and interfaces ask the kernel itself."""

from __future__ import annotations

import errno
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.machine import netlink


def test_a_question_has_its_length_kind_and_number() -> None:
    assert netlink.question(18, b"body", 7) == struct.pack("=IHHII", 20, 18, 1, 7, 0) + b"body"


def test_an_answer_is_taken_apart() -> None:
    assert netlink.answer(struct.pack("=IHHII", 20, 16, 0, 7, 0) + b"body") == (7, 0, b"body")


def test_a_refusal_has_its_number() -> None:
    refusal = struct.pack("=IHHIIi", 36, 2, 0, 7, 0, -errno.EPERM)
    assert netlink.answer(refusal).error == errno.EPERM


def test_an_answer_that_was_cut_is_no_answer() -> None:
    with pytest.raises(struct.error):
        netlink.answer(struct.pack("=IHHII", 20, 2, 0, 7, 0))


@given(st.lists(st.tuples(st.integers(0, 0x3FFF), st.binary(max_size=20))))
def test_attributes_are_read_as_they_were_written(pairs: list[tuple[int, bytes]]) -> None:
    written = b"".join(netlink.attribute(kind, data) for kind, data in pairs)
    assert list(netlink.attributes(written)) == pairs


@given(st.binary(max_size=100))
def test_reading_attributes_ends_whatever_they_are(data: bytes) -> None:
    assert len(list(netlink.attributes(data))) <= len(data) / 4


@pytest.mark.parametrize("data, number", [(None, None), (b"\1\0\0", None), (struct.pack("=IH", 9, 1), 9)])
def test_a_word_is_there_or_not(data: bytes | None, number: int | None) -> None:
    assert netlink.word(data) == number
