from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit
from gatewayd.links.modbus_server.limits import (
    STALLED_AFTER,
    idle_timeout,
    overdue,
)
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.session import UnitAccess
from gatewayd.links.modbus_server.writers import Accesses
from tests.links.modbus_server.conftest import NOW, PLC

PlanOf = Callable[..., ModbusPlan]


@dataclass(eq=False)
class Used:
    """As much of a connection as limits look at."""

    last_request: float = NOW
    stalled_since: float | None = None
    accesses: Accesses = field(default_factory=dict)


@pytest.fixture
def owning(unit: Unit, index_of: Callable[[str], int]) -> Accesses:
    """Accesses of a connection that holds a lock."""
    requester = Requester(PLC, connection=7)
    assert unit.cell.request(requester, index_of("part"), NOW) is None
    return {1: UnitAccess(unit, requester)}


def test_the_most_generous_unit_counts(plan_of: PlanOf) -> None:
    plans = [plan_of(idle_timeout=5.0), plan_of(idle_timeout=2.0)]
    assert idle_timeout(plans) == 5.0
    assert idle_timeout([*plans, plan_of(idle_timeout=None)]) is None
    assert idle_timeout([]) is None


def test_silence_ends_a_connection_that_holds_nothing(owning: Accesses) -> None:
    assert overdue(Used(), 5.0, NOW + 5.0) == ""
    assert overdue(Used(), 5.0, NOW + 5.1) == "no request for 5 s"
    assert overdue(Used(), None, NOW + 3600.0) == ""
    assert overdue(Used(accesses=owning), 5.0, NOW + 5.1) == ""


def test_unread_answers_end_any_connection(owning: Accesses) -> None:
    stalled = Used(stalled_since=NOW, accesses=owning)
    assert overdue(stalled, None, NOW + STALLED_AFTER) == ""
    assert overdue(stalled, None, NOW + STALLED_AFTER + 0.1) == "did not read its answers for 5 s"
