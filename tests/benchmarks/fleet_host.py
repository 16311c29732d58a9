"""A host application that hears all edge nodes: `fleet_host.py HOST PORT`. It decodes every message.

Commands come as lines on standard input: `state` (what came, and begin anew), `look` (the same, and go on), `rebirth`
(ask every node that it knows, and begin anew). Answers are JSON.
"""

from __future__ import annotations

import asyncio
import json
import logging
import sys
import time
from collections import Counter

from gatewayd.links.mqtt.session import BrokerSession
from gatewayd.loop.clock import ClockedLoop
from gatewayd.mqtt.messages import BrokerSettings, Message, Received
from gatewayd.mqtt.packets import Oversized
from gatewayd.sparkplug.datatypes import MetricType, encode_value
from gatewayd.sparkplug.declarations import REBIRTH
from gatewayd.sparkplug.payload import Metric, Payload, decode_payload, encode_payload
from gatewayd.sparkplug.topics import MessageType, SparkplugTopic, parse_topic
from tests.benchmarks.fleet_nodes import GROUP, HOST, WithoutCells

ALL = f"spBv1.0/{GROUP}/#"


class Host(WithoutCells):
    """A Speaker that listens."""

    def __init__(self, host: str, port: int) -> None:
        self.session = BrokerSession(BrokerSettings(host, port, "host"), self)
        self.session.client.read_rate = 1e6  # the values of all nodes
        self.known: set[str] = set()
        """Edge nodes that were ever born."""
        self._began = 0
        self._next: dict[str, int] = {}
        """Edge node -> sequence number of its next message."""
        self._forget()

    def _forget(self) -> None:
        self.counts: Counter[str] = Counter()
        self.born: dict[str, float] = {}
        """Edge node -> when it was born first since then."""
        self.delays: list[float] = []
        self.gaps = self.historical = 0
        self.last = 0.0
        """When the last historical value came."""

    # -- Speaker -----------------------------------------------------------------------------------------------------

    def will(self) -> Message:
        self._began = int(time.time() * 1000)
        return self._message(is_online=False)

    def connected(self, now: float) -> None:
        self.session.client.subscribe([ALL])
        self.session.client.publish(self._message(is_online=True))

    def _message(self, *, is_online: bool) -> Message:
        """A STATE message."""
        content = json.dumps({"online": is_online, "timestamp": self._began})
        topic = str(SparkplugTopic(MessageType.STATE, host=HOST))
        return Message(topic, content.encode(), 1, retain=True)

    def received(self, message: Received, now: float) -> None:
        arrived = time.monotonic()
        topic = parse_topic(message.topic)
        assert topic is not None
        payload = decode_payload(message.payload)
        self.counts[topic.type.value] += 1
        if topic.type is MessageType.NBIRTH:
            self.known.add(topic.node)
            self.born.setdefault(topic.node, arrived)
        if topic.type in (MessageType.NDEATH, MessageType.NCMD):
            return
        assert payload.seq is not None
        if topic.type is not MessageType.NBIRTH and self._next.get(topic.node) != payload.seq:
            self.gaps += 1
        self._next[topic.node] = (payload.seq + 1) % 256
        if topic.type is MessageType.DDATA:
            self._data(payload, arrived)

    def _data(self, payload: Payload, arrived: float) -> None:
        last = payload.metrics[-1]
        if last.is_historical:
            self.historical += len(payload.metrics)
            self.last = arrived
        elif last.value is not None and isinstance(last.value.content, int):
            self.delays.append(arrived - last.value.content / 1e9)

    def oversized(self, message: Oversized, now: float) -> None:
        """Nobody sends such."""

    def flooded(self, count: int, now: float) -> None:
        """Nobody sends as many to it."""

    def lost(self, reason: str, now: float) -> None:
        """It comes again."""

    def tick(self, now: float) -> None:
        """Nothing is due."""

    def farewell(self, now: float) -> None:
        """It goes."""

    # -- commands ----------------------------------------------------------------------------------------------------

    async def obey(self) -> None:
        """Carry out commands until standard input ends."""
        reader = asyncio.StreamReader()
        await asyncio.get_running_loop().connect_read_pipe(
            lambda: asyncio.StreamReaderProtocol(reader), sys.stdin
        )
        while line := await reader.readline():
            if line.strip() == b"rebirth":
                self._ask_for_births()
            print(json.dumps(self._state()), flush=True)
            if line.strip() != b"look":
                self._forget()

    def _ask_for_births(self) -> None:
        control = Metric(
            name=REBIRTH, datatype=MetricType.BOOLEAN, value=encode_value(MetricType.BOOLEAN, value=True)
        )
        command = encode_payload(Payload(int(time.time() * 1000), (control,)))
        for node in sorted(self.known):
            topic = str(SparkplugTopic(MessageType.NCMD, GROUP, node))
            self.session.client.publish(Message(topic, command))

    def _state(self) -> dict[str, object]:
        return {
            "connected": self.session.client.is_connected,
            "counts": self.counts,
            "born": sorted(self.born.values()),
            "delays": self.delays,
            "gaps": self.gaps,
            "historical": self.historical,
            "last": self.last,
            "now": time.monotonic(),
        }


async def _main(host: str, port: int) -> None:
    application = Host(host, port)
    print("host", flush=True)
    task = asyncio.create_task(application.session.run())
    await application.obey()
    task.cancel()


if __name__ == "__main__":
    logging.disable()
    with asyncio.Runner(loop_factory=ClockedLoop) as runner:
        runner.run(_main(sys.argv[1], int(sys.argv[2])))
