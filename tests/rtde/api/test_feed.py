"""From the calls of a client to state, events and waiting."""

from __future__ import annotations

import asyncio

import pytest

from gatewayd.rtde.api.errors import ConnectFailedError, ConnectionLostError, TypesDifferError
from gatewayd.rtde.api.events import (
    AttemptFailedEvent,
    ConnectedEvent,
    ErrorEvent,
    LostEvent,
    SetUpEvent,
    StartedEvent,
)
from gatewayd.rtde.api.feed import ConnectionState, RobotFeed
from gatewayd.rtde.api.retry import Retry
from gatewayd.rtde.api.wanted import wanted
from gatewayd.rtde.loss import Loss, LossReason
from gatewayd.rtde.messages import ControllerVersion
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.session import Session
from gatewayd.rtde.strange import Oddity, StrangePackage
from gatewayd.rtde.types import DataType

OUTPUTS = Recipe(("timestamp", "robot_mode"), (DataType.DOUBLE, DataType.INT32))
SESSION = Session(ControllerVersion(5, 12, 0, 0), None, 2, 0.002, OUTPUTS, {}, ())
REFUSED = Loss(LossReason.REFUSED, "refused", retry_in=0.05)
CLOSED = Loss(LossReason.CLOSED, "closed", started=True)


def feed(reconnect: Retry | None = None) -> RobotFeed:
    return RobotFeed(wanted(["robot_mode"], {}, 0), reconnect, running=True, buffer=10)


async def test_a_session_and_its_end() -> None:
    one = feed()
    one.begin(Retry(connect_attempts=2))
    states = [one.state]
    one.session_lost(REFUSED)
    one.connected(("127.0.0.1", 1), ("::1", 2))
    states.append(one.state)
    one.session_started(SESSION)
    states.append(one.state)
    assert [state.name for state in states] == ["CONNECTING", "INITIALISING", "RUNNING"]
    one.values((1.0, 7), 5.0)
    assert one.latest is not None
    assert one.latest.robot_mode == 7
    one.strange(StrangePackage(Oddity.LAYOUT, 85, "odd"))
    with pytest.raises(ConnectionLostError):
        one.session_lost(CLOSED)
    gone: list[object] = [one.session, one.latest]
    assert gone == [None, None]
    kinds = [type(each) for each in one.events.take()]
    assert kinds == [AttemptFailedEvent, ConnectedEvent, SetUpEvent, StartedEvent, ErrorEvent, LostEvent]


async def test_the_first_session_fails_by_another_error() -> None:
    one = feed()
    one.begin(Retry(connect_attempts=1))
    with pytest.raises(ConnectFailedError) as failure:
        one.session_lost(REFUSED)
    assert failure.value.loss is REFUSED


async def test_what_is_waited_for_is_asked_again_when_something_happens() -> None:
    one = feed()
    one.begin(Retry())
    waiting = asyncio.create_task(one.until(lambda: one.session, 5))
    await asyncio.sleep(0)
    one.session_started(SESSION)
    assert await waiting is SESSION
    in_vain = asyncio.create_task(one.until(lambda: one.last_text, 5))
    await asyncio.sleep(0)
    one.give_up(ConnectionLostError("gone"), ConnectionState.LOST)
    with pytest.raises(ConnectionLostError, match="gone"):
        await in_vain
    idle = feed()
    with pytest.raises(TimeoutError):
        await idle.until(lambda: None, 0.001)
    assert not idle._waiters.waiting


async def test_another_type_than_declared_ends_the_client() -> None:
    one = RobotFeed(wanted({"robot_mode": "BOOL"}, {}, 0), None, running=True, buffer=10)
    with pytest.raises(TypesDifferError):
        one.session_started(SESSION)
