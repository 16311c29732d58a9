"""Edge nodes without robots, many in one process: `fleet_nodes.py HOST PORT COUNT METRICS PERIOD`.

Each has a connection of its own, kept by what keeps that of a gateway (`links.mqtt.session`), and the edge node of
`gatewayd.sparkplug`. Its one device changes all its metrics once in PERIOD seconds; the last metric is the moment of
the change, in nanoseconds of this machine's monotonic clock. Commands come as lines on standard input, answers are
JSON: `hour` (let an hour pass, and change nothing any more), anything else (the state).
"""

from __future__ import annotations

import asyncio
import gc
import json
import logging
import sys
import time
from collections.abc import Sequence

import gatewayd.links.mqtt.session as link_session
import gatewayd.mqtt.client as mqtt_client
from gatewayd.links.contract import Link
from gatewayd.links.mqtt.session import BrokerSession
from gatewayd.loop import clock
from gatewayd.loop.clock import ClockedLoop
from gatewayd.mqtt.messages import BrokerSettings, Message, Received
from gatewayd.mqtt.packets import Oversized
from gatewayd.sparkplug.actions import CommandReceived, CommandRefused, SparkplugMessage
from gatewayd.sparkplug.datatypes import MetricType
from gatewayd.sparkplug.declarations import DeviceDeclaration, MetricDeclaration, MetricValue
from gatewayd.sparkplug.edge_node import EdgeNode, EdgeNodeSettings
from gatewayd.sparkplug.history import HistoryLimits

GROUP, DEVICE, SENT, HOST = "bench", "cell", "sent", "host"
HOUR, STEP = 3600.0, 60.0
"""Seconds without a broker that are simulated, and between two changes in them."""
LIMITS = HistoryLimits(size=10_000, age=HOUR + 600)
FEW, PAUSE = 100, 0.5
"""More nodes than so many look less often whether something is due, seconds: each gateway has one alone."""


class Node:
    """An edge node, as the user of its state machine."""

    def __init__(self, number: int, host: str, port: int, metrics: int) -> None:
        names = [f"value {index}" for index in range(metrics)]
        declared = [MetricDeclaration(name, MetricType.DOUBLE) for name in names]
        device = DeviceDeclaration(DEVICE, (*declared, MetricDeclaration(SENT, MetricType.INT64)))
        settings = EdgeNodeSettings(GROUP, f"node-{number}", HOST, history=LIMITS)
        self.ahead = 0.0
        """Seconds by which its clock was moved on."""
        self.bytes = self.messages = 0
        self.begun = 0.0
        """When the present connection began."""
        self.edge = EdgeNode(settings, self, lambda at: int((at + self._to_utc) * 1000), devices=(device,))
        self._to_utc = time.time() - clock.now()
        self._names = names
        self._count = 0.0
        broker = BrokerSettings(host, port, f"gatewayd-bench-{number}")
        self.session = BrokerSession(broker, Speech(self))

    def now(self) -> float:
        return clock.now() + self.ahead

    def change(self) -> None:
        """All metrics have other values."""
        now = self.now()
        self._count += 1.0
        values: dict[str, MetricValue] = {name: MetricValue(self._count, now) for name in self._names}
        self.edge.values(DEVICE, {**values, SENT: MetricValue(time.monotonic_ns(), now)}, now)

    # -- EdgeNodeUser ------------------------------------------------------------------------------------------------

    def send(self, message: SparkplugMessage) -> bool:
        taken = self.session.client.publish(
            Message(message.topic, message.payload, message.qos, message.retain)
        )
        self.messages += taken
        self.bytes += taken * (len(message.topic) + len(message.payload))
        return taken

    def subscribe(self, filters: tuple[str, ...]) -> None:
        self.session.client.subscribe(filters, 1)

    def unsubscribe(self, filters: tuple[str, ...]) -> None:
        self.session.client.unsubscribe(filters)

    def command(self, command: CommandReceived) -> None:
        """No metric is writable."""

    def command_refused(self, refused: CommandRefused) -> None:
        """Nobody asks."""

    def host_changed(self, *, is_online: bool) -> None:
        """The edge node does what is needed."""

    def ignored(self, topic: str, reason: str) -> None:
        """Nobody asks."""

    def leave(self, reason: str) -> None:
        self.session.client.reconnect(reason)


class WithoutCells:
    """What a Speaker is asked about cells, for one that has none."""

    def attach(self, session: BrokerSession) -> None:
        """It knows its session."""

    def serve(self, links: Sequence[Link], now: float) -> None:
        """There are none."""

    def goes_on(self, links: Sequence[Link]) -> bool:
        return True

    async def preparing(self) -> None:
        """Nothing is kept on a disk."""


class Speech(WithoutCells):
    """What the session of a node calls."""

    def __init__(self, node: Node) -> None:
        self._node = node

    def will(self) -> Message:
        found = self._node.edge.will(self._node.now())
        self._node.edge.connecting()
        return Message(found.topic, found.payload, found.qos, found.retain)

    def connected(self, now: float) -> None:
        self._node.begun = time.monotonic()
        self._node.edge.connected(self._node.now())

    def received(self, message: Received, now: float) -> None:
        self._node.edge.receive(
            message.topic, message.payload, self._node.now(), is_retained=message.retained
        )

    def oversized(self, message: Oversized, now: float) -> None:
        """Nobody sends such."""

    def flooded(self, count: int, now: float) -> None:
        """Nobody sends as many to it."""

    def lost(self, reason: str, now: float) -> None:
        self._node.edge.lost(self._node.now())

    def tick(self, now: float) -> None:
        self._node.edge.tick(self._node.now())

    def farewell(self, now: float) -> None:
        self._node.edge.close(self._node.now())


class Nodes:
    """All of them."""

    def __init__(self, nodes: list[Node], period: float) -> None:
        self._nodes, self._period = nodes, period
        self._running = True
        """Whether values change."""

    async def change(self) -> None:
        """Spread evenly over the period."""
        due, turn = clock.now(), 0
        while True:
            due += self._period / len(self._nodes)
            await asyncio.sleep(max(0.0, due - clock.now()))
            if self._running:
                self._nodes[turn % len(self._nodes)].change()
            turn += 1

    async def obey(self) -> None:
        """Carry out commands until standard input ends."""
        reader = asyncio.StreamReader()
        await asyncio.get_running_loop().connect_read_pipe(
            lambda: asyncio.StreamReaderProtocol(reader), sys.stdin
        )
        while line := await reader.readline():
            if line.strip() == b"hour":
                await self._hour()
            print(json.dumps(self._state()), flush=True)

    async def _hour(self) -> None:
        """An hour in which everything goes on as always, but that it passes quickly."""
        self._running = False
        for number in range(int(HOUR / STEP)):
            for node in self._nodes:
                node.ahead += STEP
                node.change()
                node.edge.tick(node.now())
                if number % 10 == 0:
                    await asyncio.sleep(0)

    def _state(self) -> dict[str, object]:
        nodes = self._nodes
        return {
            "connected": sum(node.session.client.is_connected for node in nodes),
            "begun": sorted(node.begun for node in nodes),
            "messages": sum(node.messages for node in nodes),
            "bytes": sum(node.bytes for node in nodes),
            "stored": sum(len(node.edge.history) for node in nodes),
            "dropped": sum(node.edge.history.dropped for node in nodes),
        }


async def _main(host: str, port: int, count: int, metrics: int, period: float) -> None:
    if count > FEW:
        link_session.TICK = mqtt_client.STEP = PAUSE  # type: ignore[attr-defined]
    nodes = [Node(number, host, port, metrics) for number in range(count)]
    gc.freeze()
    running = Nodes(nodes, period)
    print("nodes", flush=True)
    tasks = [
        asyncio.create_task(work) for work in (*(node.session.run() for node in nodes), running.change())
    ]
    await running.obey()
    for task in tasks:
        task.cancel()


if __name__ == "__main__":
    logging.disable()
    _host, *_numbers = sys.argv[1:]
    with asyncio.Runner(loop_factory=ClockedLoop) as runner:
        _port, _count, _metrics = map(int, _numbers[:3])
        runner.run(_main(_host, _port, _count, _metrics, float(_numbers[3])))
