"""What is said of a pair before it is needed."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from gatewayd.links.examination import Outcome, RunningCell, Surroundings
from gatewayd.links.standby.doctor import EXAMINATION, heard, who_is_who
from tests.links.standby.cells import pair, planned

TWO = "{peer: ['192.0.2.11:2930', '192.0.2.12:2930'], address: 192.0.2.50}"
LINK = {"role": "standing by", "peer_role": "active", "mismatch": False, "address": "192.0.2.50"}


@pytest.mark.parametrize(
    "own, outcome",
    [
        ({"192.0.2.11"}, Outcome.OK),
        ({"192.0.2.11", "192.0.2.12"}, Outcome.PROBLEM),
        ({"192.0.2.99"}, Outcome.PROBLEM),
    ],
)
def test_which_of_the_two_this_machine_is(own: set[str], outcome: Outcome) -> None:
    assert [found.outcome for found in who_is_who(pair(TWO), own)] == [outcome]


@pytest.mark.parametrize(
    "change, outcomes",
    [
        ({}, [Outcome.OK]),
        ({"peer_role": None}, [Outcome.PROBLEM]),
        ({"mismatch": True}, [Outcome.PROBLEM]),
        ({"role": "active", "address_here": False}, [Outcome.OK, Outcome.PROBLEM]),
    ],
)
def test_what_the_running_gateway_hears(change: dict[str, Any], outcomes: list[Outcome]) -> None:
    assert [found.outcome for found in heard({**LINK, **change})] == outcomes


def test_without_a_running_gateway_nothing_is_known() -> None:
    assert [found.outcome for found in heard(None)] == [Outcome.SKIPPED]


def test_whole() -> None:
    plan = planned("{peer: '127.0.0.2:2930'}")
    status = {
        "name": "press-3",
        "links": [{"name": "standby", "title": "two gateways"}],
        "standby": {"role": "active", "peer_role": "standing by"},
    }

    async def examine() -> list[str]:
        around = Surroundings((RunningCell("socket", status),))
        return [found.text async for found in EXAMINATION.examine(plan.links["standby"], plan.cell, around)]

    assert "this gateway is active, the other one standing by" in asyncio.run(examine())
