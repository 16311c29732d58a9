"""An edge node on a real broker, by paho: the thinnest loop that can run one."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from typing import Any

import pytest

from gatewayd.sparkplug.actions import CommandReceived, CommandRefused, EdgeNodeUser, SparkplugMessage
from gatewayd.sparkplug.declarations import MetricValue, QualityCode
from gatewayd.sparkplug.edge_node import EdgeNode, EdgeNodeSettings
from tests.e2e.processes import wait_for
from tests.peers.mosquitto import Mosquitto
from tests.sparkplug.conformance.bench import GROUP, LATHE, NODE, PRESS, VERSION

paho = pytest.importorskip("paho.mqtt.client")
_DISCONNECT_WITH_WILL = 4


def utc(now: float) -> int:
    """Milliseconds of UTC of a time of the monotonic clock."""
    return round((time.time() - time.monotonic() + now) * 1000)


class LiveNode(EdgeNodeUser):
    """Connects by itself, and again when the connection is gone. Nothing happens but within `until`."""

    def __init__(self, broker: Mosquitto, *, version: int = 4, next_bd_seq: int = 0, **settings: Any) -> None:
        self.broker = broker
        self.commands: list[CommandReceived] = []
        self.refused: list[CommandRefused] = []
        self.host_states: list[bool] = []
        self.ignored_messages: list[tuple[str, str]] = []
        self.left: list[str] = []
        self.decide: Callable[[CommandReceived], bool] = lambda _command: True
        self.node = EdgeNode(
            EdgeNodeSettings(GROUP, NODE, **settings),
            self,
            utc,
            metrics=[VERSION],
            devices=[PRESS, LATHE],
            next_bd_seq=next_bd_seq,
        )
        self._version = version
        self._client: Any = None
        self._retry_at = 0.0

    # -- the node's user ---------------------------------------------------------------------------------------------

    def send(self, message: SparkplugMessage) -> bool:
        self._client.publish(message.topic, message.payload, message.qos, message.retain)
        return True

    def subscribe(self, filters: tuple[str, ...]) -> None:
        self._client.subscribe([(one, 1) for one in filters])

    def unsubscribe(self, filters: tuple[str, ...]) -> None:
        self._client.unsubscribe(list(filters))

    def leave(self, reason: str) -> None:
        self.left.append(reason)
        self._disconnect()

    def command(self, command: CommandReceived) -> None:
        self.commands.append(command)
        names = [name for name, _ in command.values]
        if self.decide(command):
            now = time.monotonic()
            self.node.values(
                command.device, {name: MetricValue(value, now) for name, value in command.values}, now
            )
        else:
            self.node.show(command.device, names, time.monotonic())

    def command_refused(self, refused: CommandRefused) -> None:
        self.refused.append(refused)

    def host_changed(self, *, is_online: bool) -> None:
        self.host_states.append(is_online)

    def ignored(self, topic: str, reason: str) -> None:
        self.ignored_messages.append((topic, reason))

    # -- at work -----------------------------------------------------------------------------------------------------

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Work until it holds."""

        def holds() -> bool:
            self._work()
            return condition()

        wait_for(holds, what)

    def set(self, device: str = "press-3", quality: QualityCode = QualityCode.GOOD, **values: Any) -> float:
        """Values of now; `speed` is `Motion/speed`."""
        now = time.monotonic()
        named = {"Motion/speed" if name == "speed" else name: value for name, value in values.items()}
        self.node.values(
            device, {name: MetricValue(value, now, quality) for name, value in named.items()}, now
        )
        return now

    def close(self) -> None:
        """Say good-bye and go."""
        self.node.close(time.monotonic())
        self._disconnect()

    def drop(self) -> None:
        """Let the connection go without a word."""
        self._client.socket().shutdown(socket.SHUT_RDWR)

    def _work(self) -> None:
        now = time.monotonic()
        if self._client is None:
            if now >= self._retry_at:
                self._connect(now)
            return
        if self._client.loop(0.005) != paho.MQTT_ERR_SUCCESS:
            self._gone()
        else:
            self.node.tick(time.monotonic())

    def _connect(self, now: float) -> None:
        self._retry_at = now + 0.2
        will = self.node.will(now)
        five = self._version == 5
        options = {} if five else {"clean_session": True}
        protocol = paho.MQTTv5 if five else paho.MQTTv311
        client = paho.Client(paho.CallbackAPIVersion.VERSION2, "edge", protocol=protocol, **options)
        client.will_set(will.topic, will.payload, will.qos, will.retain)
        client.on_connect = self._accepted
        client.on_message = self._message
        self.node.connecting()
        try:
            client.connect(self.broker.host, self.broker.port, **({"clean_start": True} if five else {}))
        except OSError:
            return
        self._client = client

    def _accepted(
        self, _client: object, _data: object, _flags: object, reason: Any, _properties: object
    ) -> None:
        assert not reason.is_failure, reason
        self.node.connected(time.monotonic())

    def _message(self, _client: object, _data: object, message: Any) -> None:
        self.node.receive(message.topic, message.payload, time.monotonic(), is_retained=message.retain)

    def _disconnect(self) -> None:
        if self._version == 5:
            code = paho.ReasonCode(paho.PacketTypes.DISCONNECT, identifier=_DISCONNECT_WITH_WILL)
            self._client.disconnect(code)
        else:
            self._client.disconnect()
        # It sends a packet at a time, the DISCONNECT last.
        for _ in range(500):
            if self._client.loop(0.005) != paho.MQTT_ERR_SUCCESS:
                break
        self._gone()

    def _gone(self) -> None:
        self._client = None
        self.node.lost(time.monotonic())
