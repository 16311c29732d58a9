"""The compiled MQTT link of a cell: which broker, which topics, who may command. Immutable."""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.mapping.plan import LinkPlan
from gatewayd.mqtt.messages import MQTT_311, BrokerSettings, BrokerTlsFiles

AVAILABLE = "available"
"""Behind the topic of a cell: whether its gateway is there, as the broker knows it."""
RESULT = "result"
"""Behind the topic of commands: what became of them."""
HISTORY = "history"
"""In front of the name of a value: what it was while the broker was away."""


@dataclass(frozen=True, slots=True)
class Publication:
    """One variable, as it is published."""

    variable: int
    name: str
    deadband: float = 0.0
    interval: float = 1.0


@dataclass(frozen=True, slots=True)
class SparkplugPlan:
    """What the cell is by Sparkplug B."""

    group: str
    node: str
    device: str
    primary_host: str = ""


@dataclass(frozen=True, slots=True)
class MqttPlan(LinkPlan):
    """One cell at one broker."""

    kind = "mqtt"

    host: str
    port: int
    client: str
    publications: tuple[Publication, ...]
    writers: tuple[tuple[str, int], ...] = ()
    """What each is known by, and its index: topic of commands; by Sparkplug `primary_host` or `any_host`."""
    topic: str = ""
    """For values as JSON; empty: they are published by Sparkplug."""
    sparkplug: SparkplugPlan | None = None
    version: int = MQTT_311
    keepalive: int = 10
    username: str = ""
    password_file: str = ""
    tls: BrokerTlsFiles | None = None
    every: float | None = 60.0
    retain: bool = False
    keep: float | None = 600.0
    """Seconds for which changes are kept while the broker is away; None: they are not."""
    size: int = 10_000

    @property
    def broker(self) -> BrokerSettings:
        """The connection that it needs; cells with equal ones share it, where it is an edge node."""
        return BrokerSettings(
            self.host,
            self.port,
            self.client,
            self.version,
            self.keepalive,
            self.username,
            self.password_file,
            self.tls,
        )

    def topic_of(self, name: str) -> str:
        """Where a value or a command is, as JSON."""
        return f"{self.topic}/{name}"
