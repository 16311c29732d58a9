"""Names, fields and meanings of commands and states."""

from __future__ import annotations

from typing import get_args

from gatewayd.dashboard.requests import Verb
from gatewayd.links.robot.dashboard.variables import (
    MOVING,
    OWN,
    POWERFUL,
    STATES,
    VERBS,
    CommandName,
    StateName,
    field_of,
    meanings_of,
    name_of,
)
from gatewayd.rtde.enums import MEANINGS


def test_the_words_of_the_language_are_those_that_are_carried_out() -> None:
    assert set(get_args(CommandName)) == VERBS.keys()
    assert set(get_args(StateName)) == STATES.keys()
    assert set(VERBS.values()) == set(Verb)
    assert VERBS.keys() >= MOVING
    assert POWERFUL < MOVING
    assert STATES.keys() >= OWN


def test_a_field_has_its_name() -> None:
    assert field_of("play") == "dashboard.play"
    assert name_of(field_of("play")) == "play"


def test_states_mean_what_the_fields_of_packages_mean() -> None:
    assert meanings_of("robot_mode") == MEANINGS["robot_mode"]
    assert meanings_of("program_state") == {1: "stopped", 2: "running", 4: "paused"}
    assert meanings_of("result")[2] == "carried out"
    assert meanings_of("loaded") == {}
