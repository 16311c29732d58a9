"""The link itself."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping
from typing import Any

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.core.requester import Requester
from gatewayd.links.contract import Context, Level, Link, LinkHealth, LinkRuntime
from gatewayd.loop import clock
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address

from .plan import LinesPlan


class LinesLink(Link, asyncio.DatagramProtocol):
    """Sends all values every period and takes `{"write": {name: value}}`, which it answers."""

    title = "lines link"
    plan: LinesPlan

    def __init__(self, plan: LinesPlan, cell: Cell) -> None:
        self.plan = plan
        self._cell = cell
        self._transport: asyncio.DatagramTransport | None = None
        self._turns = self._sent = self._taken = 0

    @property
    def progress(self) -> int:
        """Counts periods."""
        return self._turns

    @property
    def reachable(self) -> bool:
        """While the socket is there."""
        return self._transport is not None

    async def run(self) -> None:
        """Send until cancelled."""
        loop = asyncio.get_running_loop()
        self._transport, _ = await loop.create_datagram_endpoint(lambda: self, local_addr=self.plan.listen)
        try:
            while True:
                self._turns += 1
                self._send()
                await asyncio.sleep(self.plan.period)
        finally:
            self._transport.close()
            self._transport = None

    def departing(self, plan: LinkPlan | None, after: CellDefinition) -> Mapping[Requester, str]:
        """Writers would have to send elsewhere."""
        return {} if plan else {Requester(writer): "its socket ends" for _peer, writer in self.plan.writers}

    def release(self, plan: LinkPlan | None, after: CellDefinition, now: float) -> None:
        """They are lost with the socket."""
        for requester, why in self.departing(plan, after).items():
            self._cell.writer_disconnected(requester, now, why, at_once=True)

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """The same socket for another plan."""
        assert isinstance(plan, LinesPlan)
        self.plan, self._cell = plan, cell

    def health(self) -> LinkHealth:
        """Whether the socket is there."""
        figures = {"sent": self._sent, "lines": {"out": self._sent, "in": self._taken}}
        level, words = (Level.GOOD, "sending") if self.reachable else (Level.BAD, "no socket")
        problems = () if self.reachable else (f"lines: {address(*self.plan.listen)} cannot be had",)
        return LinkHealth(f"lines {address(*self.plan.listen)}", level, words, "", problems, figures)

    def datagram_received(self, data: bytes, peer: tuple[str | Any, int]) -> None:
        """A line came."""
        self._taken += 1
        try:
            wanted = dict(json.loads(data)["write"])
        except (ValueError, KeyError, TypeError):
            return
        indices = {name: index for index, name in self.plan.names}
        changes = [Change(indices[name], value) for name, value in wanted.items() if name in indices]
        writer = dict(self.plan.writers).get(peer[0])
        refusal = self._cell.write(Requester(writer, peer=peer[0]), changes, clock.now())
        answer = {"refused": refusal.reason.text if refusal is not None else None}
        assert self._transport is not None
        self._transport.sendto(json.dumps(answer).encode(), peer)

    def _send(self) -> None:
        values = self._cell.image.values
        line = json.dumps({name: values[index] for index, name in self.plan.names})
        assert self._transport is not None
        self._transport.sendto(line.encode(), self.plan.to)
        self._sent += 1
        self._cell.health.words["lines_sent"] = self._sent & 0xFFFF


class LinesRuntime(LinkRuntime):
    """Makes the link."""

    def make(self, plan: LinkPlan, cell: Cell, context: Context) -> LinesLink:
        """A link without a socket."""
        assert isinstance(plan, LinesPlan)
        return LinesLink(plan, cell)


RUNTIME = LinesRuntime()
