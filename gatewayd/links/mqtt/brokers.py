"""The connections to brokers that the cells of a daemon use: one for each client of a broker."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Link, Prepared, PrepareError, SharedPart, Tap
from gatewayd.links.mqtt.link import MqttLink
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.links.mqtt.session import BrokerSession
from gatewayd.mapping.plan import Plan
from gatewayd.mqtt.client import NotInstalledError, load_library
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
        self._sessions: dict[MqttLink, BrokerSession] = {}
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
        """Have the library."""
        if any(plan.of(MqttPlan) for plan in plans):
            try:
                await load_library()
            except NotInstalledError as error:
                raise PrepareError(str(error)) from error
        return _NothingToPrepare()

    def serve(self, links: Sequence[Link], successors: Mapping[Cell, Cell]) -> None:
        """Have a connection for each of these, and no other."""
        wanted = [link for link in links if isinstance(link, MqttLink)]
        for link, session in list(self._sessions.items()):
            if link not in wanted:
                del self._sessions[link]
                self._end(session)
        for link in wanted:
            if link not in self._sessions:
                session = BrokerSession(link.plan.broker, link)
                session.trace(self._tap)
                link.session = session
                self._sessions[link] = session
                self._begin(session)

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
