"""What an edge node says to its owner: messages to be sent, commands that came, and what it ignored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from gatewayd.sparkplug.datatypes import Scalar
from gatewayd.sparkplug.topics import MessageType


@dataclass(frozen=True, slots=True)
class SparkplugMessage:
    """A message of MQTT. As a will it goes to the broker with CONNECT."""

    type: MessageType
    topic: str
    payload: bytes
    qos: int = 0
    retain: bool = False


@dataclass(frozen=True, slots=True)
class CommandReceived:
    """A command with all that it wants written: it is carried out as a whole, or not at all."""

    device: str
    """Empty for the edge node."""
    values: tuple[tuple[str, Scalar], ...]
    timestamp: int | None
    """Milliseconds of UTC by the sender's clock."""


@dataclass(frozen=True, slots=True)
class CommandRefused:
    """A command that no metric can take, and why. The metrics that it named are sent as they are."""

    device: str
    names: tuple[str, ...]
    """The metrics that it named, as far as they are known."""
    reason: str


class EdgeNodeUser(Protocol):
    """What an edge node calls, in the middle of its work: it must be quick, and must not raise."""

    def send(self, message: SparkplugMessage) -> bool:
        """Publish it now; False if the connection does not take it, and nothing was sent."""

    def subscribe(self, filters: tuple[str, ...]) -> None:
        """Subscribe, with QoS 1 (tck-id-message-flow-edge-node-ncmd-subscribe, -device-dcmd-subscribe)."""

    def unsubscribe(self, filters: tuple[str, ...]) -> None:
        """Unsubscribe."""

    def leave(self, reason: str) -> None:
        """Send DISCONNECT, in MQTT 5 with reason 04h ("disconnect with will message"), and connect anew.

        tck-id-payloads-ndeath-will-message-publisher-disconnect-mqtt311, -mqtt50,
        tck-id-operational-behavior-edge-node-termination-host-offline-reconnect.
        """

    def command(self, command: CommandReceived) -> None:
        """A command. Where it is refused, call `EdgeNode.show` with what it named: Sparkplug has no other answer."""

    def command_refused(self, refused: CommandRefused) -> None:
        """A command that nobody has to judge any more."""

    def host_changed(self, *, is_online: bool) -> None:
        """The primary host application is there, or not."""

    def ignored(self, topic: str, reason: str) -> None:
        """A message that is none of those an edge node takes, and why."""
