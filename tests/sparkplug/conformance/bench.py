"""An edge node on a bench: time is exact, and Google's Protocol Buffers read what it sends."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from gatewayd.sparkplug.actions import CommandReceived, CommandRefused, EdgeNodeUser, SparkplugMessage
from gatewayd.sparkplug.datatypes import MetricType, Scalar
from gatewayd.sparkplug.declarations import (
    DeviceDeclaration,
    MetricDeclaration,
    MetricProperty,
    MetricValue,
    QualityCode,
)
from gatewayd.sparkplug.edge_node import EdgeNode, EdgeNodeSettings
from gatewayd.sparkplug.topics import MessageType

schema = pytest.importorskip("tests.sparkplug.schema")

EPOCH = 1_700_000_000_000
GROUP, NODE, HOST = "plant", "hall 2", "scada"
MM = MetricProperty("engUnit", MetricType.STRING, "mm")
SPEED = MetricDeclaration("Motion/speed", MetricType.DOUBLE, properties=(MM,))
START = MetricDeclaration("start", MetricType.BOOLEAN, is_writable=True)
PART = MetricDeclaration("part", MetricType.INT16, is_writable=True)
PRESS = DeviceDeclaration("press-3", (SPEED, START, PART))
LATHE = DeviceDeclaration("lathe", (SPEED,))
VERSION = MetricDeclaration("Properties/version", MetricType.STRING)
STATE = f"spBv1.0/STATE/{HOST}"


def utc(now: float) -> int:
    """Milliseconds of the bench's time."""
    return EPOCH + round(now * 1000)


@dataclass(frozen=True)
class Sent:
    """A message, as a host reads it."""

    type: str
    device: str
    topic: str
    payload: Any
    qos: int
    retain: bool

    def __getitem__(self, key: str | int) -> Any:
        """The metric of this name or alias."""
        name = "name" if isinstance(key, str) else "alias"
        return next(metric for metric in self.payload.metrics if getattr(metric, name) == key)

    @property
    def seq(self) -> int | None:
        return self.payload.seq if self.payload.HasField("seq") else None

    @property
    def bd_seq(self) -> int:
        return int(self["bdSeq"].long_value)

    @property
    def values(self) -> dict[int, Any]:
        """Alias -> value."""
        return {metric.alias: value_of(metric) for metric in self.payload.metrics}


def value_of(metric: Any) -> Any:
    """None for null."""
    field = metric.WhichOneof("value")
    assert metric.is_null is (field is None)
    return None if field is None else getattr(metric, field)


def quality_of(metric: Any) -> int:
    properties = dict(zip(metric.properties.keys, metric.properties.values, strict=True))
    assert properties["Quality"].type == MetricType.INT32
    return int(properties["Quality"].int_value)


def read(message: SparkplugMessage) -> Sent:
    """A message as a host reads it."""
    topic = message.topic.split("/")
    assert topic[:2] == ["spBv1.0", GROUP]
    assert topic[3] == NODE
    device = topic[4] if len(topic) > 4 else ""
    return Sent(topic[2], device, message.topic, schema.foreign(message.payload), message.qos, message.retain)


class Bench(EdgeNodeUser):
    """The node's user, the broker, and hosts."""

    def __init__(
        self,
        primary_host: str = "",
        devices: Iterable[DeviceDeclaration] = (PRESS, LATHE),
        metrics: Iterable[MetricDeclaration] = (VERSION,),
        next_bd_seq: int = 0,
        **settings: Any,
    ) -> None:
        self.now = 1000.0
        self.room = 1 << 60
        """Messages that the connection takes."""
        self.messages: list[Sent] = []
        self.filters: set[str] = set()
        self.left: list[str] = []
        self.commands: list[CommandReceived] = []
        self.refused: list[CommandRefused] = []
        self.host_states: list[bool] = []
        self.ignored_messages: list[tuple[str, str]] = []
        self.will: Sent | None = None
        self.node = EdgeNode(
            EdgeNodeSettings(GROUP, NODE, primary_host, **settings),
            self,
            utc,
            metrics=metrics,
            devices=devices,
            next_bd_seq=next_bd_seq,
        )

    # -- the node's user ---------------------------------------------------------------------------------------------

    def send(self, message: SparkplugMessage) -> bool:
        if self.room <= 0:
            return False
        self.room -= 1
        self.messages.append(read(message))
        return True

    def subscribe(self, filters: tuple[str, ...]) -> None:
        self.filters.update(filters)

    def unsubscribe(self, filters: tuple[str, ...]) -> None:
        self.filters.difference_update(filters)

    def leave(self, reason: str) -> None:
        self.left.append(reason)

    def command(self, command: CommandReceived) -> None:
        self.commands.append(command)

    def command_refused(self, refused: CommandRefused) -> None:
        self.refused.append(refused)

    def host_changed(self, *, is_online: bool) -> None:
        self.host_states.append(is_online)

    def ignored(self, topic: str, reason: str) -> None:
        self.ignored_messages.append((topic, reason))

    # -- what happens ------------------------------------------------------------------------------------------------

    def connect(self) -> Bench:
        """A new MQTT session."""
        self.filters.clear()
        self.will = read(self.node.will(self.now))
        self.node.connecting()
        self.node.connected(self.now)
        return self

    def lose(self) -> None:
        self.node.lost(self.now)

    def wait(self, seconds: float, step: float = 0.05) -> None:
        """Let time pass, with a tick some times a second."""
        until = self.now + seconds
        while self.now < until:
            self.now = min(until, self.now + step)
            self.node.tick(self.now)

    def take(self) -> list[Sent]:
        """What was sent since the last time."""
        taken, self.messages = self.messages, []
        return taken

    def types(self) -> list[str]:
        """The types of what was sent since the last time: `DBIRTH lathe`."""
        return [f"{one.type} {one.device}".strip() for one in self.take()]

    def set(
        self, device: str = "press-3", quality: QualityCode = QualityCode.GOOD, **values: Scalar | None
    ) -> None:
        """Values of now; `speed` is `Motion/speed`."""
        named = {"Motion/speed" if name == "speed" else name: value for name, value in values.items()}
        given = {name: MetricValue(value, self.now, quality) for name, value in named.items()}
        self.node.values(device, given, self.now)

    def state(self, *, online: bool, timestamp: int, host: str = HOST) -> None:
        """A STATE message of a host."""
        payload = json.dumps({"online": online, "timestamp": timestamp}).encode()
        self.node.receive(f"spBv1.0/STATE/{host}", payload, self.now, is_retained=True)

    def ask(self, device: str, *fill: Callable[[Any], object], is_retained: bool = False) -> None:
        """A command: each function fills one metric."""
        payload = schema.ForeignPayload(timestamp=utc(self.now))
        for one in fill:
            one(payload.metrics.add())
        self.ask_raw(device, payload.SerializeToString(), is_retained=is_retained)

    def ask_raw(self, device: str, payload: bytes, *, is_retained: bool = False) -> None:
        topic = f"spBv1.0/{GROUP}/DCMD/{NODE}/{device}" if device else f"spBv1.0/{GROUP}/NCMD/{NODE}"
        self.node.receive(topic, payload, self.now, is_retained=is_retained)

    def ask_rebirth(self, *, value: bool = True) -> None:
        def fill(metric: Any) -> None:
            metric.name, metric.boolean_value = "Node Control/Rebirth", value

        self.ask("", fill)


def metric(name: str = "", **fields: Any) -> Callable[[Any], None]:
    """Fills a metric of a command."""

    def fill(message: Any) -> None:
        if name:
            message.name = name
        for field, value in fields.items():
            setattr(message, field, value)

    return fill


def aliases(birth: Sent) -> dict[str, int]:
    """Name -> alias."""
    return {one.name: one.alias for one in birth.payload.metrics if one.HasField("alias")}


def births(sent: Iterable[Sent]) -> Iterator[Sent]:
    return (one for one in sent if one.type in ("NBIRTH", "DBIRTH"))


TYPES = {one.value for one in MessageType}
