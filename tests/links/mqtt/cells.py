"""A cell with MQTT whose broker is the test."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, cast

from gatewayd.core.cell import Cell
from gatewayd.core.events import Event, EventKind
from gatewayd.links.mqtt.json_link import JsonLink
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.links.mqtt.session import BrokerSession
from gatewayd.mapping.loader import Loaded, load
from gatewayd.mapping.plan import Plan
from gatewayd.mqtt.messages import Message, Received

HEAD = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1, adopt_for: none, stale_after: 5s}
modbus: {listen: '127.0.0.1:1502'}
"""
BROKER = "mqtt: {host: 127.0.0.1, topic: plant/press, interval: 100ms, every: 10s}\n"
VARIABLES = """\
writers: {plc: {modbus: 127.0.0.2, timeout: 1s}, cloud: {mqtt: set, timeout: 2s}}
variables:
  speed: {robot: input_double_register_0, owner: [plc, cloud], limits: [0, 1], unit: m/s, modbus: 0}
  flag:  {robot: input_bit_register_0, owner: cloud}
  count: {robot: output_int_register_0, modbus: 100}
  force: {robot: output_double_register_0, mqtt: {name: force, deadband: 0.5}}
"""
SPEED, FLAG, COUNT, FORCE = range(4)
NOW = 1000.0
AHEAD = 1_800_000_000.0


def loaded(broker: str = BROKER, variables: str = VARIABLES) -> Loaded:
    """What is read of a mapping."""
    return load((HEAD + broker + variables).encode(), "press.yaml")


def planned(broker: str = BROKER, variables: str = VARIABLES) -> Plan:
    """The plan of a mapping that has no errors."""
    found = loaded(broker, variables)
    assert found.plan is not None, found.diagnostics
    return found.plan


@dataclass
class FakeClient:
    """A broker that takes what it is given, or not."""

    is_connected: bool = True
    writable: bool = True
    connections: int = 1
    sent: list[Message] = field(default_factory=list)
    topics: list[str] = field(default_factory=list)

    def publish(self, message: Message) -> bool:
        if self.writable:
            self.sent.append(message)
        return self.writable

    def subscribe(self, topics: Sequence[str], qos: int = 0) -> None:
        self.topics += topics

    def reconnect(self, reason: str) -> None:
        self.is_connected = self.writable = False

    def unsubscribe(self, topics: Sequence[str]) -> None:
        self.topics = [topic for topic in self.topics if topic not in topics]


@dataclass
class FakeSession:
    """A session without a connection."""

    client: FakeClient
    trouble: str = ""
    refused: dict[str, str] = field(default_factory=dict)


class Rig:
    """A cell with its link, robot and broker there."""

    def __init__(self, broker: str = BROKER, variables: str = VARIABLES) -> None:
        plan = planned(broker, variables)
        self.now = NOW
        self.cell = Cell(plan.cell)
        self.link = JsonLink(plan.the(MqttPlan), self.cell, lambda: self.now + AHEAD)
        self.client = FakeClient()
        self.session = FakeSession(self.client)
        self.link.session = cast("BrokerSession", self.session)
        self.cell.robot_connected(self.now)
        self.cell.adopt({index: variable.kind.zero for index, variable in self.inputs()}, self.now)
        self.package()

    def owner_of_flag(self) -> int | None:
        return self.cell.ownership.owners[1]

    def inputs(self) -> list[tuple[int, Any]]:
        image = self.cell.image
        return [(index, image.variables[index]) for index in image.inputs]

    def package(self, **values: float) -> None:
        """A package of the robot with these outputs."""
        self.cell.package_arrived(self.now, self.now)
        for name, value in values.items():
            index = next(i for i, each in enumerate(self.cell.definition.variables) if each.name == name)
            self.cell.image.values[index] = value
        self.cell.outputs_written(self.now)

    def connect(self) -> None:
        self.client.is_connected = self.client.writable = True
        self.link.connected(self.now)

    def lose(self) -> None:
        self.client.is_connected = self.client.writable = False
        self.link.lost("gone", self.now)

    def after(self, seconds: float, **values: float) -> list[str]:
        """What is published after so much time, with a package at its end."""
        self.client.sent.clear()
        self.now += seconds
        self.package(**values)
        self.cell.tick(self.now)
        self.link.tick(self.now)
        return [message.topic.removeprefix("plant/press/") for message in self.client.sent]

    def command(self, payload: bytes | object, *, topic: str = "set", **more: Any) -> dict[str, Any]:
        """What a command is answered."""
        self.client.sent.clear()
        text = payload if isinstance(payload, bytes) else json.dumps(payload).encode()
        self.link.received(Received(f"plant/press/{topic}", text, **more), self.now)
        (answer,) = [each for each in self.client.sent if each.topic.endswith("/result")] or [
            Message("", b"{}")
        ]
        found: dict[str, Any] = json.loads(answer.payload)
        return found

    def said(self, name: str) -> dict[str, Any]:
        """The last that was said of a topic."""
        (*_, found) = [each for each in self.client.sent if each.topic == f"plant/press/{name}"]
        decoded: dict[str, Any] = json.loads(found.payload)
        return decoded

    def events(self, kind: EventKind) -> list[Event]:
        return [event for event in self.cell.events if event.kind is kind]
