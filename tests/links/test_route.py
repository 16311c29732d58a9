from __future__ import annotations

import errno
import os

import pytest

from gatewayd.links import route
from gatewayd.links.examination import Outcome
from gatewayd.links.route import described, look_up_route
from gatewayd.machine.routes import Route


@pytest.mark.parametrize(
    "route, outcome, text",
    [
        (Route("lo", "127.0.0.1", is_local=True), Outcome.OK, "192.0.2.9 is this machine"),
        (Route("eth0", "192.0.2.7"), Outcome.OK, "by eth0 from 192.0.2.7"),
        (Route("", ""), Outcome.OK, "by an interface"),
        (
            Route("eth0", "192.0.2.7", "192.0.2.1"),
            Outcome.NOTE,
            "by eth0 from 192.0.2.7 through 192.0.2.1: the robot is in another network",
        ),
        (
            Route("eth0", "192.0.2.7", has_link=False),
            Outcome.PROBLEM,
            "by eth0 from 192.0.2.7, but eth0 has no link",
        ),
    ],
)
def test_a_route_in_words(route: Route, outcome: Outcome, text: str) -> None:
    found = described(route, "192.0.2.9", "the robot")
    assert (found.outcome, found.text) == (outcome, text)
    assert bool(found.remedy) is outcome.is_finding


def refuse(number: int) -> Route:
    raise OSError(number, os.strerror(number))


@pytest.mark.parametrize(
    "number, outcome, text",
    [
        (errno.ENETUNREACH, Outcome.PROBLEM, "this machine has no route to 192.0.2.9"),
        (errno.EAFNOSUPPORT, Outcome.SKIPPED, "the kernel was not asked: "),
    ],
)
def test_no_route_is_a_problem_and_a_sandbox_is_none(
    monkeypatch: pytest.MonkeyPatch, number: int, outcome: Outcome, text: str
) -> None:
    monkeypatch.setattr(route, "route_to", lambda _address: refuse(number))
    (found,) = look_up_route("192.0.2.9", "the robot")
    assert found.outcome is outcome
    assert found.text.startswith(text)


def test_this_machine_is_found() -> None:
    (found,) = look_up_route("127.0.0.1", "the robot")
    assert found.text == "127.0.0.1 is this machine"
