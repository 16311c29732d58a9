"""What is sent."""

from __future__ import annotations

import pytest

from gatewayd.dashboard.requests import DashboardRequest, Verb, is_program


def test_a_request_is_the_verb_and_the_program_that_it_loads() -> None:
    assert DashboardRequest(Verb.PLAY).line == "play"
    assert DashboardRequest(Verb.LOAD, "cell/pick.urp").line == "load cell/pick.urp"
    assert DashboardRequest(Verb.LOAD, "x.urp").patience > DashboardRequest(Verb.PLAY).patience


@pytest.mark.parametrize("name", ["pick.urp", "cell 3/pick.urp", "x" * 255])
def test_names_of_programs(name: str) -> None:
    assert is_program(name)


@pytest.mark.parametrize("name", ["", " pick.urp", "a\nplay", "a\x00", "grün.urp", "x" * 256])
def test_names_that_are_none(name: str) -> None:
    assert not is_program(name)
