"""Lines of one connection, in whatever pieces they come."""

from __future__ import annotations

import itertools
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.dashboard.dialogue import MAX_LINE, Dialogue, DialogueError


def greeted() -> Dialogue:
    dialogue = Dialogue()
    assert dialogue.receive(b"Connected: Universal Robots Dashboard Server\n") is not None
    return dialogue


def test_the_greeting_comes_first_and_is_awaited() -> None:
    dialogue = Dialogue()
    with pytest.raises(ValueError, match="still due"):
        dialogue.ask("play")
    assert dialogue.receive(b"Connected: ") is None
    assert dialogue.receive(b"Universal\r\n") == "Connected: Universal"
    assert not dialogue.is_awaiting


@given(st.lists(st.integers(1, 20)))
def test_an_answer_in_pieces_is_one_answer(cuts: list[int]) -> None:
    dialogue, data = greeted(), b"Robotmode: RUNNING\n"
    assert dialogue.ask("robotmode") == b"robotmode\n"
    places = [0, *sorted({cut for cut in cuts if cut < len(data)}), len(data)]
    answers = [dialogue.receive(data[a:b]) for a, b in itertools.pairwise(places)]
    assert answers[-1] == "Robotmode: RUNNING"
    assert not any(answers[:-1])


def test_what_was_not_asked_for_is_refused() -> None:
    with pytest.raises(DialogueError, match="unasked"):
        greeted().receive(b"Stopped\n")


def test_two_answers_to_one_request_are_refused() -> None:
    dialogue = greeted()
    dialogue.ask("play")
    with pytest.raises(DialogueError, match="two answers"):
        dialogue.receive(b"Starting program\nStopped\n")


def test_a_line_without_end_is_bounded() -> None:
    dialogue = greeted()
    dialogue.ask("play")
    for _ in range(MAX_LINE):
        assert dialogue.receive(b"x") is None
    with pytest.raises(DialogueError, match="1024"):
        dialogue.receive(b"x")


@pytest.mark.parametrize("text", ["play\nstop", "load \x00", "load ä.urp", "load a\r"])
def test_a_request_is_one_line(text: str) -> None:
    with pytest.raises(ValueError, match="one line"):
        greeted().ask(text)


@given(st.lists(st.binary(max_size=64), max_size=40))
def test_no_bytes_do_anything_else_than_end_it(pieces: list[bytes]) -> None:
    dialogue = Dialogue()
    with suppress(DialogueError):
        for piece in pieces:
            line = dialogue.receive(piece)
            if line is not None:
                assert "\n" not in line
                dialogue.ask("robotmode")
