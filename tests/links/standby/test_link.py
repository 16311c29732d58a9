"""Two links that talk to each other over the loopback interface, and bytes of others."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path

import pytest

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Claim, Context, Level
from gatewayd.links.standby.declaration import ROLE_WORD
from gatewayd.links.standby.link import PEER_READY, StandbyLink
from gatewayd.links.standby.roles import StandbyRole
from gatewayd.links.standby.runtime import RUNTIME
from gatewayd.loop import clock
from tests.links.standby.cells import planned


def free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Pair:
    """Two links of one cell. `duty` is asked as the daemon does it."""

    def __init__(self, state: Path, options: str = "", others: str = "") -> None:
        ports = free_udp_port(), free_udp_port()
        self.claims = [Claim.REFUSED, Claim.REFUSED]
        self.plans = [
            planned(f"{{peer: '127.0.0.1:{there}', listen: '127.0.0.1:{here}'{more}}}")
            for here, there, more in ((*ports, options), (*reversed(ports), others or options))
        ]
        self.cells = [Cell(plan.cell) for plan in self.plans]
        self.links = [
            made(plan.links["standby"], cell, Context(clock.now(), state / str(number)))
            for number, (plan, cell) in enumerate(zip(self.plans, self.cells, strict=True))
        ]
        self.ports = ports

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(10):
            while not condition():
                for link, claim in zip(self.links, self.claims, strict=True):
                    link.duty(claim, clock.now())
                await asyncio.sleep(0.005)

    def figure(self, number: int, name: str) -> object:
        return self.links[number].health().figures[name]


def made(plan: object, cell: Cell, context: Context) -> StandbyLink:
    return RUNTIME.make(plan, cell, context)  # type: ignore[arg-type]


def work(pair: Pair, scenario: Callable[[], Awaitable[None]]) -> None:
    async def run() -> None:
        tasks = [asyncio.create_task(link.run()) for link in pair.links]
        try:
            await scenario()
        finally:
            for task in tasks:
                task.cancel()
                with suppress(asyncio.CancelledError):
                    await task

    asyncio.run(run())


def test_one_serves_and_knows_that_the_other_is_ready(tmp_path: Path) -> None:
    pair = Pair(tmp_path)

    async def scenario() -> None:
        pair.claims[0] = Claim.HELD
        await pair.until(lambda: pair.figure(0, "peer_ready") is True)
        await pair.until(lambda: pair.figure(1, "peer_role") == "active")
        assert (pair.figure(0, "role"), pair.figure(1, "role")) == ("active", "standing by")
        assert [link.health().level for link in pair.links] == [Level.GOOD, Level.IDLE]
        assert pair.links[0].health().problems == ()
        await pair.until(
            lambda: pair.cells[0].health.words[ROLE_WORD] == StandbyRole.ACTIVE.value + PEER_READY
        )
        assert pair.links[0].hand_over(clock.now()) == ""
        pair.claims[0] = Claim.UNASKED
        await pair.until(lambda: pair.figure(0, "role") == "leaving")
        pair.claims[1] = Claim.HELD
        await pair.until(lambda: pair.figure(1, "role") == "active")

    work(pair, scenario)
    assert all(link.progress > 0 for link in pair.links)


def test_a_gateway_that_is_gone_is_missed_and_found_again(tmp_path: Path) -> None:
    pair = Pair(tmp_path)

    async def scenario() -> None:
        other = asyncio.create_task(made(pair.plans[1].links["standby"], pair.cells[1], context).run())
        await pair.until(lambda: pair.figure(0, "peer_role") is not None)
        other.cancel()
        with suppress(asyncio.CancelledError):
            await other
        await pair.until(lambda: pair.figure(0, "peer_role") is None)
        (problem,) = pair.links[0].health().problems
        assert problem == "the other gateway is not heard: nobody would take over from this one"

    context = Context(clock.now(), tmp_path)
    pair.links, pair.claims = pair.links[:1], pair.claims[:1]
    work(pair, scenario)


def test_another_mapping_is_a_problem_of_both(tmp_path: Path) -> None:
    pair = Pair(tmp_path, others=", grace: 3s")

    async def scenario() -> None:
        await pair.until(lambda: all(pair.figure(number, "mismatch") for number in (0, 1)))
        await pair.until(lambda: pair.figure(0, "role") == "mismatched")
        assert "install the same file on both and reload" in pair.links[0].health().problems[0]
        pair.plans[1] = pair.plans[0].with_links(standby=pair.plans[1].links["standby"])
        pair.cells[1] = Cell(pair.plans[0].cell)
        pair.links[1].rebind(pair.plans[1].links["standby"], pair.cells[1], clock.now())
        await pair.until(lambda: pair.figure(0, "role") == "standing by")

    work(pair, scenario)


def test_strangers_are_not_heard(tmp_path: Path) -> None:
    """The kernel drops what does not come from the peer's own address and port."""
    pair = Pair(tmp_path)

    async def scenario() -> None:
        await pair.until(lambda: pair.figure(0, "peer_role") is not None)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            for data in (b"", b"GWSB", bytes(28), b"x" * 1400):
                stranger.sendto(data, ("127.0.0.1", pair.ports[0]))
        await pair.until(lambda: pair.links[0].progress > 8)
        assert pair.figure(0, "strange") == 0

    work(pair, scenario)


def test_a_port_that_is_taken_is_tried_again(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    pair = Pair(tmp_path)

    async def scenario() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.bind(("127.0.0.1", pair.ports[0]))
            task = asyncio.create_task(pair.links[0].run())
            async with asyncio.timeout(5):
                while not caplog.records:  # noqa: ASYNC110
                    await asyncio.sleep(0.01)
        assert "cannot talk to the other gateway" in pair.links[0].health().problems[0]
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task

    asyncio.run(scenario())


def test_file_and_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(tmp_path))
    own = {"192.0.2.11"}
    monkeypatch.setattr("gatewayd.links.standby.link.own_addresses", lambda: frozenset(own))
    plan = planned()
    link = made(plan.links["standby"], Cell(plan.cell), Context(0.0, tmp_path))
    file = tmp_path / "standby-press-3"
    assert not link.duty(Claim.REFUSED, 100.0).serve
    assert file.read_text() == "1\n"
    assert not link.duty(Claim.HELD, 100.1).serve
    assert file.read_text() == "0\n"
    own.add("192.0.2.50")
    assert link.duty(Claim.HELD, 100.2).serve
    own.remove("192.0.2.50")
    assert not link.duty(Claim.HELD, 100.3).serve
    assert file.read_text() == "1\n"
    link.duty(Claim.UNASKED, 106.0)
    link.duty(Claim.HELD, 106.1)
    assert file.read_text() == "0\n"
    asyncio.run(link.close())
    assert file.read_text() == "1\n"


def test_a_machine_that_is_neither_of_the_two(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    plan = planned("{peer: ['192.0.2.11:2930', '192.0.2.12:2930']}")
    link = made(plan.links["standby"], Cell(plan.cell), Context(0.0, tmp_path))

    async def scenario() -> None:
        task = asyncio.create_task(link.run())
        async with asyncio.timeout(5):
            while not caplog.records:  # noqa: ASYNC110
                await asyncio.sleep(0.01)
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task

    asyncio.run(scenario())
    assert "this machine has neither of the two addresses of `peer`" in link.health().problems[0]
