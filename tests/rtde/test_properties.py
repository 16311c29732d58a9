"""Properties: questions and answers in their order, values only where all have one."""

from __future__ import annotations

import struct

import pytest

from gatewayd.rtde.codec import ProtocolError
from gatewayd.rtde.messages import PropertiesReply
from gatewayd.rtde.properties import PropertyQuestions, sort_properties


def test_answers_go_to_the_questions_in_their_order() -> None:
    questions = PropertyQuestions()
    first: list[PropertiesReply] = []
    second: list[PropertiesReply] = []
    assert questions.ask(("a",), first.append)
    assert questions.ask(("b", "c"), second.append)
    one, two = PropertiesReply(("BOOL",), b"\1"), PropertiesReply(("NOT_SET", "BOOL"), b"")
    assert questions.answer(one) == ""
    assert questions.answer(two) == ""
    assert (first, second) == ([one], [two])
    assert questions.answer(one) == "properties that were not asked for"


def test_an_answer_with_another_number_of_types_is_odd_and_answers_nothing() -> None:
    questions = PropertyQuestions()
    answers: list[PropertiesReply] = []
    assert questions.ask(("a", "b"), answers.append)
    assert questions.answer(PropertiesReply(("BOOL",), b"\1")) == "1 type for 2 properties"
    assert answers == []


def test_a_silent_controller_is_not_asked_for_ever() -> None:
    questions = PropertyQuestions()
    assert [questions.ask(("a",), lambda _: None) for _ in range(9)] == [True] * 8 + [False]


def test_values_are_read_by_their_types() -> None:
    reply = PropertiesReply(("UINT64", "VECTOR3D"), struct.pack(">Q3d", 7, 1, 2, 3) + b"more")
    assert sort_properties(("a", "b"), reply) == ({"a": 7, "b": (1.0, 2.0, 3.0)}, {})


def test_one_without_a_value_keeps_all_back() -> None:
    reply = PropertiesReply(("UINT64", "NOT_SET", "STRING"), b"")
    assert sort_properties(("a", "b", "c"), reply) == ({}, {"b": "NOT_SET", "c": "STRING"})


def test_values_that_are_too_short_are_an_error() -> None:
    with pytest.raises(ProtocolError, match="properties with 3 bytes of values, 4 expected"):
        sort_properties(("a",), PropertiesReply(("UINT32",), b"abc"))
