"""Bounds of handshakes: how many, how long, and how much of the loop's time."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from ipaddress import ip_address

import pytest

from gatewayd.links.modbus_server import handshakes
from gatewayd.links.modbus_server.handshakes import MAX_HANDSHAKES, MAX_OF_PEER, Handshakes
from gatewayd.links.modbus_server.peers import Address, PeerEventKind
from gatewayd.loop import clock


@dataclass(eq=False)
class Peer:
    address: Address | None
    steps: list[Peer] = field(default_factory=list)

    def step(self) -> None:
        self.steps.append(self)

    def fail(self, kind: PeerEventKind, reason: str) -> None:
        raise AssertionError(f"{kind} {reason}: only the listener ends one")


def peer(number: int) -> Peer:
    return Peer(ip_address(f"10.0.{number >> 8}.{number & 255}"))


def test_the_oldest_of_a_crowded_address_makes_room() -> None:
    under_way = Handshakes()
    own = [peer(1) for _ in range(MAX_OF_PEER)]
    assert [under_way.begin(each, 0.0) for each in own] == [None] * MAX_OF_PEER
    newcomer = peer(1)
    assert under_way.begin(newcomer, 1.0) is own[0]
    assert under_way.end(own[0])
    assert not under_way.end(own[0])
    assert len(under_way) == MAX_OF_PEER


def test_when_all_are_taken_the_greediest_address_makes_room() -> None:
    under_way = Handshakes()
    greedy = [peer(1), peer(1)]
    others = [peer(number) for number in range(2, MAX_HANDSHAKES)]
    for each in (*others, *greedy):
        assert under_way.begin(each, 0.0) is None
    assert under_way.begin(peer(9999), 1.0) is greedy[0]


def test_those_that_took_too_long() -> None:
    under_way = Handshakes()
    first, second = peer(1), peer(2)
    under_way.begin(first, 0.0)
    under_way.begin(second, 3.0)
    assert under_way.overdue(handshakes.PATIENCE) == []
    assert under_way.overdue(handshakes.PATIENCE + 0.1) == [first]
    under_way.stood_still(3.0)
    assert under_way.overdue(handshakes.PATIENCE + 0.1) == []


async def test_one_step_at_a_time_and_a_pause_that_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter(range(100))
    pauses: list[float] = []
    loop = asyncio.get_running_loop()
    monkeypatch.setattr(clock, "now", lambda: float(next(now)))

    def call_later(delay: float, turn: object) -> asyncio.Handle:
        pauses.append(delay)
        return loop.call_soon(turn)  # type: ignore[arg-type]

    monkeypatch.setattr(loop, "call_later", call_later)
    under_way, steps = Handshakes(), list[Peer]()
    peers = [Peer(ip_address("10.0.0.1"), steps) for _ in range(3)]
    for each in peers:
        under_way.begin(each, 0.0)
        under_way.ready(each)
    under_way.ready(peers[0])
    await asyncio.sleep(0)
    assert len(steps) == 1
    for _ in range(5):
        await asyncio.sleep(0)
    assert steps == peers
    assert pauses == [handshakes.PAUSE, handshakes.PAUSE], "each step took a second"


async def test_after_the_end_nothing_is_called() -> None:
    under_way = Handshakes()
    first, second = peer(1), peer(2)
    for each in (first, second):
        under_way.begin(each, 0.0)
        under_way.ready(each)
    under_way.end(first)
    under_way.close()
    await asyncio.sleep(0.01)
    assert first.steps == second.steps == []
    assert len(under_way) == 0
