"""An edge node at work: the cells of one gateway at one broker, as devices with one connection.

What may be said when is the edge node's matter (`gatewayd.sparkplug.edge_node`); here it gets its connection, its
values and its commands, and what has to be kept across restarts.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from gatewayd.links.contract import Link
from gatewayd.links.mqtt.bd_seq import bd_seq_file, read_bd_seq, write_bd_seq
from gatewayd.links.mqtt.commands import MAX_BURST, MAX_RATE
from gatewayd.links.mqtt.plan import MqttPlan, SparkplugPlan
from gatewayd.links.mqtt.session import BrokerSession
from gatewayd.links.mqtt.sparkplug_link import SparkplugLink
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.loop.allowance import Allowance
from gatewayd.loop.retry import reason_of
from gatewayd.loop.threads import in_daemon_thread
from gatewayd.mqtt.messages import Message, Received
from gatewayd.mqtt.packets import Oversized
from gatewayd.sparkplug.actions import CommandReceived, CommandRefused, SparkplugMessage
from gatewayd.sparkplug.edge_node import EdgeNode, EdgeNodeSettings
from gatewayd.sparkplug.history import HistoryLimits
from gatewayd.sparkplug.states import EdgeNodeState

log = logging.getLogger("gatewayd.mqtt")


class SparkplugNode:
    """Speaks by a session, and is what the edge node calls."""

    def __init__(self, links: Sequence[Link], state: Path, wall: Callable[[], float] = time.time) -> None:
        plans = [link.plan for link in links if isinstance(link.plan, MqttPlan)]
        sparkplug = plans[0].sparkplug
        assert sparkplug is not None
        self.session: BrokerSession | None = None
        self._links = _by_device(links)
        self._wall = wall
        self._file = bd_seq_file(state, sparkplug.group, sparkplug.node)
        self._will: Message | None = None
        self._now = self._waited = 0.0
        """Of the message that is served now."""
        self._allowance = Allowance(MAX_BURST, MAX_RATE)
        self.node = EdgeNode(
            EdgeNodeSettings(sparkplug.group, sparkplug.node, sparkplug.primary_host, history=_limits(plans)),
            self,
            self._utc,
            devices=[link.declaration() for link in self._links.values()],
            next_bd_seq=read_bd_seq(self._file),
        )

    def attach(self, session: BrokerSession) -> None:
        """See Speaker."""
        self.session = session

    def goes_on(self, links: Sequence[Link]) -> bool:
        """While there is a device, and the edge node is the same one."""
        found = {(each.group, each.node, each.primary_host) for link in links if (each := _sparkplug(link))}
        mine = self.node.settings
        return found == {(mine.group, mine.node, mine.primary_host)}

    def serve(self, links: Sequence[Link], now: float) -> None:
        """Devices are these from now on."""
        self._links = _by_device(links)
        for link in self._links.values():
            link.session = self.session
        self.node.history.limits = _limits([link.plan for link in self._links.values()])
        self.node.redeclare((), [link.declaration() for link in self._links.values()], now)
        self._say(now)

    # -- Speaker -----------------------------------------------------------------------------------------------------

    async def preparing(self) -> None:
        """See Speaker: the number of the connection after this one is kept before this one is begun."""
        will = self.node.will(clock.now())
        self.node.connecting()
        self._will = Message(will.topic, will.payload, will.qos, will.retain)
        keep = partial(write_bd_seq, self._file, self.node.next_bd_seq)
        try:
            await in_daemon_thread(keep, "sparkplug bdSeq")
        except OSError as error:
            log.warning("cannot keep bdSeq", extra=fields(file=str(self._file), reason=reason_of(error)))

    def will(self) -> Message | None:
        """See Speaker."""
        return self._will

    def connected(self, now: float) -> None:
        """See Speaker."""
        self._say(now)
        self.node.connected(now)
        self.tick(now)

    def received(self, message: Received, now: float) -> None:
        """See Speaker. What the broker sends again counts as retained: nobody knows when it was meant."""
        is_state = message.topic.startswith("spBv1.0/STATE/")
        if not is_state and not self._allowance.take(now):
            self._device_ignores(message.topic, "more than 100 commands a second", now)
            return
        self._now, self._waited = now, message.waited
        again = message.retained or message.again
        self.node.receive(message.topic, message.payload, now, is_retained=again)
        self._waited = 0.0

    def oversized(self, message: Oversized, now: float) -> None:
        """See Speaker."""
        self._device_ignores(message.topic, f"{message.length} bytes are too many for a command", now)

    def flooded(self, count: int, now: float) -> None:
        """See Speaker. Nobody knows which device was meant."""
        for link in self._links.values():
            link.desk.flooded(count, now)

    def lost(self, reason: str, now: float) -> None:
        """See Speaker."""
        self._now = now
        self.node.lost(now)
        for link in self._links.values():
            link.broker_lost(reason, now)

    def farewell(self, now: float) -> None:
        """See Speaker."""
        self._now = now
        self.node.close(now)

    def tick(self, now: float) -> None:
        """See Speaker."""
        self._say(now)
        self.node.tick(now)
        waits = self.node.state is EdgeNodeState.WAITING
        for link in self._links.values():
            link.waits_for_host = waits
            link.kept, link.lost_changes = len(self.node.history), self.node.history.dropped
            link.show_words()

    # -- EdgeNodeUser ------------------------------------------------------------------------------------------------

    def send(self, message: SparkplugMessage) -> bool:
        """See EdgeNodeUser."""
        if self.session is None:
            return False
        sent = Message(message.topic, message.payload, message.qos, message.retain)
        taken = self.session.client.publish(sent)
        link = self._links.get(message.topic.rpartition("/")[2])
        if link is not None:
            link.published += taken
        return taken

    def subscribe(self, filters: tuple[str, ...]) -> None:
        """See EdgeNodeUser."""
        if self.session is not None:
            self.session.client.subscribe(filters, 1)

    def unsubscribe(self, filters: tuple[str, ...]) -> None:
        """See EdgeNodeUser."""
        if self.session is not None:
            self.session.client.unsubscribe(filters)

    def leave(self, reason: str) -> None:
        """See EdgeNodeUser."""
        if self.session is not None:
            self.session.client.reconnect(reason)

    def command(self, command: CommandReceived) -> None:
        """See EdgeNodeUser: carried out or refused, it is answered with the true values."""
        now, link = self._now, self._links.get(command.device)
        if link is None:
            return
        names = [name for name, _value in command.values]
        link.command(dict(command.values), self._waited, now)
        self.node.values(command.device, link.present(names, now), now, keep=False)

    def command_refused(self, refused: CommandRefused) -> None:
        """See EdgeNodeUser."""
        link = self._links.get(refused.device)
        if link is not None:
            link.ignore(f"a command: {refused.reason}", self._now)

    def host_changed(self, *, is_online: bool) -> None:
        """See EdgeNodeUser."""
        if not is_online:
            for link in self._links.values():
                link.host_lost(self._now)

    def ignored(self, topic: str, reason: str) -> None:
        """See EdgeNodeUser."""
        log.debug("message ignored", extra=fields(topic=topic, reason=reason))

    # -- inside ------------------------------------------------------------------------------------------------------

    def _say(self, now: float) -> None:
        """Hand the edge node what is due; it sends it, or keeps it."""
        for device, link in self._links.items():
            first, changed = link.due(now)
            if first:
                # A birth has them; they are no changes that somebody has missed.
                self.node.values(device, first, now, keep=False)
            if changed:
                self.node.values(device, changed, now)

    def _device_ignores(self, topic: str, request: str, now: float) -> None:
        link = self._links.get(topic.rpartition("/")[2])
        if link is not None:
            link.ignore(request, now)

    def _utc(self, moment: float) -> int:
        return round((self._wall() - clock.now() + moment) * 1000)


def _by_device(links: Sequence[Link]) -> dict[str, SparkplugLink]:
    return {link.device: link for link in links if isinstance(link, SparkplugLink)}


def _sparkplug(link: Link) -> SparkplugPlan | None:
    return link.plan.sparkplug if isinstance(link.plan, MqttPlan) else None


def _limits(plans: Sequence[MqttPlan]) -> HistoryLimits:
    """What the cells of an edge node want to be kept, together."""
    kept = [(plan.keep, plan.size) for plan in plans if plan.keep is not None]
    return HistoryLimits(size=sum(size for _, size in kept), age=max((keep for keep, _ in kept), default=0.0))
