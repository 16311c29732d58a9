"""One connection to a broker at work, and who uses it: a single cell for JSON, an edge node for all of its cells."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Sequence
from typing import Protocol

from gatewayd.links.contract import Link, Passage, Tap
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.loop.retry import keep_running
from gatewayd.mqtt.client import MqttClient
from gatewayd.mqtt.messages import BrokerSettings, Message, Received
from gatewayd.mqtt.packets import Oversized
from gatewayd.report.format import address

LOSS_INTERVAL = 60.0
"""Seconds after which a connection that still fails for the same reason is logged again."""
TICK = 0.05
"""Seconds between two looks at what is due."""
RETRY_PERIOD = 2.0
"""Seconds after which work that ended in a defect is begun again."""

log = logging.getLogger("gatewayd.mqtt")


class Speaker(Protocol):
    """Who says values by a connection and hears commands. Nothing of it may raise."""

    def attach(self, session: BrokerSession) -> None:
        """Speak by this session."""

    def serve(self, links: Sequence[Link], now: float) -> None:
        """Speak for these cells from now on."""

    def goes_on(self, links: Sequence[Link]) -> bool:
        """Whether it can speak for these."""

    async def preparing(self) -> None:
        """A connection is about to be begun."""

    def will(self) -> Message | None:
        """What the broker says when the connection ends without a word."""

    def connected(self, now: float) -> None:
        """The broker is there."""

    def received(self, message: Received, now: float) -> None:
        """A message came."""

    def oversized(self, message: Oversized, now: float) -> None:
        """One came that was too large."""

    def flooded(self, count: int, now: float) -> None:
        """So many messages were not read."""

    def lost(self, reason: str, now: float) -> None:
        """The broker is gone."""

    def tick(self, now: float) -> None:
        """Say what is due."""

    def farewell(self, now: float) -> None:
        """Say good-bye: the connection ends now, and on purpose."""


class BrokerSession:
    """Keeps the connection, and says once why there is none."""

    def __init__(self, settings: BrokerSettings, speaker: Speaker) -> None:
        self.settings = settings
        self.speaker = speaker
        self.client = MqttClient(settings, self)
        self.trouble = "it was not tried yet"
        """Why there is no connection; empty: there is one."""
        self.refused: dict[str, str] = {}
        """Topics that the broker does not send us, and why."""
        self.task: asyncio.Task[None] | None = None
        self._rests = 0
        self._logged: tuple[str, float] | None = None

    @property
    def progress(self) -> int:
        """Moves while the session is at work."""
        return self.client.progress + self._rests

    def goes_on(self, links: Sequence[Link]) -> bool:
        """Whether the connection goes on for these cells."""
        return self.speaker.goes_on(links)

    async def run(self) -> None:
        """Keep at work until cancelled, whatever happens."""
        await keep_running(self._work, log, RETRY_PERIOD, self._rest)

    async def close(self) -> None:
        """Say good-bye and end."""
        if self.client.is_connected:
            self.speaker.farewell(clock.now())
            await self.client.leave()
        if self.task is not None:
            self.task.cancel()
            await asyncio.wait((self.task,))

    def trace(self, tap: Tap | None) -> None:
        """Hand `tap` what passes."""
        if tap is None:
            self.client.tap = None
            return
        peer = address(self.settings.host, self.settings.port)

        def passed(data: bytes, outgoing: bool, own: tuple[str, int] | None) -> None:
            tap(Passage(clock.now(), data, outgoing, peer, address(*own) if own else "", cell=None))

        self.client.tap = passed

    # -- called by the client ----------------------------------------------------------------------------------------

    async def preparing(self) -> None:
        """See ClientUser."""
        await self.speaker.preparing()

    def will(self) -> Message | None:
        """See ClientUser."""
        return self.speaker.will()

    def connected(self) -> None:
        """See ClientUser."""
        self.trouble, self._logged = "", None
        self.refused.clear()
        log.info("connected to the broker", extra=self._fields())
        self.speaker.connected(clock.judged_now())

    def received(self, message: Received) -> None:
        """See ClientUser."""
        self.speaker.received(message, clock.now())

    def oversized(self, message: Oversized) -> None:
        """See ClientUser."""
        self.speaker.oversized(message, clock.now())

    def flooded(self, count: int) -> None:
        """See ClientUser."""
        self.speaker.flooded(count, clock.now())

    def subscription(self, topics: Sequence[str], why: str) -> None:
        """See ClientUser."""
        for topic in topics:
            if not why:
                self.refused.pop(topic, None)
            else:
                self.refused[topic] = why
                log.warning("the broker refuses a subscription", extra=self._fields(topic=topic, reason=why))

    def lost(self, reason: str, *, was_connected: bool) -> None:
        """See ClientUser."""
        now = clock.judged_now()
        self.trouble = reason
        if was_connected:
            self.speaker.lost(reason, now)
        if self._logged is None or self._logged[0] != reason or now - self._logged[1] >= LOSS_INTERVAL:
            self._logged = (reason, now)
            log.warning("no broker", extra=self._fields(reason=reason))

    # -- inside ------------------------------------------------------------------------------------------------------

    async def _work(self) -> None:
        async with asyncio.TaskGroup() as group:
            group.create_task(self.client.run())
            group.create_task(self._look())

    async def _look(self) -> None:
        while True:
            await asyncio.sleep(TICK)
            self.speaker.tick(clock.judged_now())

    def _rest(self) -> None:
        self._rests += 1

    def _fields(self, **more: object) -> dict[str, object]:
        where = address(self.settings.host, self.settings.port)
        return fields(broker=where, client=self.settings.client, **more)
