"""The connections to brokers that the cells of a daemon use: one for each client of a broker."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Link, Prepared, SharedPart, Tap
from gatewayd.links.mqtt.json_link import JsonLink
from gatewayd.links.mqtt.link import MqttLink
from gatewayd.links.mqtt.session import BrokerSession
from gatewayd.loop import clock
from gatewayd.mapping.plan import Plan
from gatewayd.mqtt.messages import BrokerSettings
from gatewayd.report.format import address


class _NothingToPrepare:
    """There is nothing to take back: a broker that is away keeps no mapping from being served."""

    def commit(self) -> None:
        """See Prepared."""

    async def abort(self) -> None:
        """See Prepared."""


class Brokers(SharedPart):
    """All connections of the daemon."""

    def __init__(self) -> None:
        self._sessions: dict[BrokerSettings, BrokerSession] = {}
        self.state = Path()
        """Directory of what is kept across restarts."""
        self._group: asyncio.TaskGroup | None = None
        self._ending: set[asyncio.Task[None]] = set()
        self._tap: Tap | None = None

    async def run(self) -> None:
        """Keep all connections at work until cancelled."""
        async with asyncio.TaskGroup() as group:
            self._group = group
            try:
                for session in self._sessions.values():
                    self._begin(session)
                await asyncio.get_running_loop().create_future()
            finally:
                self._group = None

    def progress(self) -> Mapping[str, int]:
        """Of each connection."""
        return {_name(session): session.progress for session in self._sessions.values()}

    def gap(self, since: float, now: float) -> None:
        """What waits in a socket may be old."""
        for session in self._sessions.values():
            session.client.gap(since, now)

    def trace(self, tap: Tap | None) -> None:
        """All packets of all connections."""
        self._tap = tap
        for session in self._sessions.values():
            session.trace(tap)

    async def prepare(self, plans: Sequence[Plan]) -> Prepared:
        """Nothing can fail."""
        return _NothingToPrepare()

    def serve(self, links: Sequence[Link], successors: Mapping[Cell, Cell]) -> None:
        """Have a connection for each cell with JSON and for each edge node, and no other."""
        wanted: dict[BrokerSettings, list[MqttLink]] = {}
        for link in links:
            assert isinstance(link, MqttLink)
            wanted.setdefault(link.plan.broker, []).append(link)
        for settings, session in list(self._sessions.items()):
            if not session.goes_on(wanted.get(settings, ())):
                del self._sessions[settings]
                self._end(session)
        for settings, members in wanted.items():
            known = self._sessions.get(settings)
            if known is None:
                self._sessions[settings] = known = self._session(settings, members)
                self._begin(known)
            known.speaker.serve(members, clock.now())

    def _session(self, settings: BrokerSettings, links: Sequence[MqttLink]) -> BrokerSession:
        first = links[0]
        if isinstance(first, JsonLink):
            session = BrokerSession(settings, first)
        else:
            # See MqttRuntime.make.
            from gatewayd.links.mqtt.node import SparkplugNode  # noqa: PLC0415

            session = BrokerSession(settings, SparkplugNode(links, self.state))
        session.trace(self._tap)
        session.speaker.attach(session)
        return session

    async def close(self) -> None:
        """Say good-bye to all."""
        sessions = list(self._sessions.values())
        self._sessions.clear()
        await asyncio.gather(*(session.close() for session in sessions), *self._ending)

    def _begin(self, session: BrokerSession) -> None:
        if self._group is not None and session.task is None:
            session.task = self._group.create_task(session.run(), name=f"broker {session.settings.client}")

    def _end(self, session: BrokerSession) -> None:
        """Let it go in the background: a broker that does not answer holds up no reload."""
        if session.task is None:
            return
        ending = asyncio.create_task(session.close())
        self._ending.add(ending)
        ending.add_done_callback(self._ending.discard)


def _name(session: BrokerSession) -> str:
    settings = session.settings
    return f"broker {address(settings.host, settings.port)} as {settings.client}"
