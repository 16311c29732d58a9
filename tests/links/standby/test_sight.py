"""What is believed of the other gateway."""

from __future__ import annotations

from dataclasses import replace

from gatewayd.links.standby.heartbeat import Heartbeat
from gatewayd.links.standby.roles import StandbyRole
from gatewayd.links.standby.sight import GONE_AFTER, Sight

OURS, THEIRS = 11, 22
SAID = Heartbeat(StandbyRole.ACTIVE, connected=True, ready=False, fingerprint=7, number=THEIRS, echo=OURS)


def seen(heartbeat: Heartbeat = SAID, now: float = 100.0) -> Sight:
    sight = Sight(OURS, 7)
    sight.heard(heartbeat, now)
    return sight


def test_what_repeats_our_number_is_believed() -> None:
    sight = seen()
    assert (sight.role(100.1), sight.alive(100.1), sight.connected(100.1)) == (StandbyRole.ACTIVE, True, True)
    assert not sight.ready(100.1)
    assert sight.echo == THEIRS


def test_who_does_not_hear_us_is_not_believed_and_counted() -> None:
    sight = seen(replace(SAID, echo=99))
    assert sight.role(100.0) is None
    assert (sight.strange, sight.echo) == (1, THEIRS)


def test_a_gateway_that_has_just_started_is_answered() -> None:
    """It cannot know our number yet: the answer has its own, so that the next one does."""
    sight = seen(replace(SAID, echo=0))
    assert (sight.role(100.0), sight.strange, sight.echo) == (None, 0, THEIRS)


def test_a_forged_heartbeat_does_not_change_what_the_other_gateway_hears() -> None:
    """Who only knows address and port cannot repeat our number, and must not take theirs out of our heartbeats."""
    sight = seen()
    sight.heard(replace(SAID, number=666, echo=0), 100.1)
    sight.heard(replace(SAID, number=667, echo=1), 100.1)
    assert (sight.echo, sight.strange) == (THEIRS, 1)
    assert sight.alive(100.2)


def test_two_that_knew_each_other_find_each_other_again_when_one_starts_anew() -> None:
    ours, anew = seen(), Sight(33, 7)
    anew.heard(replace(SAID, number=OURS, echo=ours.echo), 200.0)
    assert not anew.alive(200.0)
    ours.heard(replace(SAID, number=33, echo=anew.echo), 200.0)
    assert ours.alive(200.0)
    anew.heard(replace(SAID, number=OURS, echo=ours.echo), 200.1)
    assert anew.alive(200.1)


def test_our_own_words_are_none_of_the_other_gateway() -> None:
    sight = seen(replace(SAID, number=OURS))
    assert (sight.alive(100.0), sight.strange) == (False, 1)


def test_no_heartbeat_at_all_is_counted() -> None:
    sight = Sight(OURS, 7)
    sight.heard(None, 100.0)
    assert (sight.strange, sight.alive(100.0)) == (1, False)


def test_silence_and_a_refusal_mean_that_it_is_gone() -> None:
    sight = seen()
    assert sight.alive(100.0 + GONE_AFTER - 0.01)
    assert not sight.alive(100.0 + GONE_AFTER)
    sight.heard(SAID, 101.0)
    sight.refused()
    assert not sight.alive(101.0)
    sight.heard(SAID, 101.1)
    assert sight.alive(101.1)


def test_another_mapping_is_remembered_beyond_its_life() -> None:
    sight = seen(replace(SAID, fingerprint=8, ready=True))
    assert sight.differs
    assert not sight.ready(100.0)
    assert not sight.alive(200.0)
    assert sight.differs
    sight.heard(SAID, 201.0)
    assert not sight.differs
