"""A cell with its robot up, and the interface to it."""

from __future__ import annotations

import pytest

from gatewayd.audit.trail import Audit
from gatewayd.control.api import Api
from gatewayd.core.cell import Cell
from tests.control.served import FixedGateway, Served, bring_up, plan


@pytest.fixture
def press() -> Served:
    plan_of_it = plan()
    served = Served(plan_of_it, Cell(plan_of_it.cell))
    served.cell.tick(0.0)
    bring_up(served.cell, 0.0)
    return served


@pytest.fixture
def gateway(press: Served) -> FixedGateway:
    return FixedGateway([press])


@pytest.fixture
def audit(press: Served) -> Audit:
    found = Audit(wall_clock=lambda: 1_800_000_000.0)
    found.watch(press.cell)
    return found


@pytest.fixture
def api(gateway: FixedGateway, audit: Audit) -> Api:
    return Api(gateway, audit)
