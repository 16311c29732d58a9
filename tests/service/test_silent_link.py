"""What stands for a link of a cell that another gateway serves."""

from __future__ import annotations

import asyncio

import pytest

from gatewayd.core.cell import Cell
from gatewayd.links.access import AccessError, PlaceRequest
from gatewayd.links.contract import Level
from gatewayd.service.silent_link import SilentLink
from tests.links.standby.cells import planned


def test_it_says_that_it_is_silent() -> None:
    plan = planned()
    link = SilentLink(plan.links["modbus"], Cell(plan.cell))
    health = link.health()
    assert health.name == "Modbus TCP server 127.0.0.1:1502 unit 1"
    assert (health.level, health.words, health.problems) == (
        Level.IDLE,
        "silent: this gateway stands by",
        (),
    )
    assert link.progress is None


def test_nobody_is_asked_by_hand() -> None:
    plan = planned()
    link = SilentLink(plan.links["modbus"], Cell(plan.cell))
    with pytest.raises(AccessError, match="ask the one that serves the cell"):
        asyncio.run(link.ask(PlaceRequest("holding:0")))
