"""Messages and settings of a connection, as values."""

from __future__ import annotations

from dataclasses import dataclass

DEFAULT_PORT = 1883
DEFAULT_TLS_PORT = 8883
MQTT_311 = 4
"""Protocol level of MQTT 3.1.1, as CONNECT has it."""
MQTT_5 = 5
MAX_PACKET = 65_536
"""Bytes of a packet that is taken; what is larger is let pass unread (`gatewayd.mqtt.packets`)."""


@dataclass(frozen=True, slots=True)
class Message:
    """What is published, or left with the broker as a will."""

    topic: str
    payload: bytes
    qos: int = 0
    retain: bool = False


@dataclass(frozen=True, slots=True)
class Received:
    """What came by a subscription."""

    topic: str
    payload: bytes
    retained: bool = False
    """The broker had kept it: nobody says when it was sent, or whether it is meant now."""
    again: bool = False
    """The broker sends it once more (DUP)."""
    waited: float = 0.0
    """Seconds for which it may have waited while the process stood still."""


@dataclass(frozen=True, slots=True)
class BrokerTlsFiles:
    """Files of a connection by TLS; empty: none."""

    ca: str = ""
    """Authorities that the broker's certificate is from; empty: those of the system."""
    certificate: str = ""
    """Our own certificate, with what leads to its authority."""
    key: str = ""


@dataclass(frozen=True, slots=True)
class BrokerSettings:
    """How a broker is reached, and as whom."""

    host: str
    port: int
    client: str
    """Client identifier: a broker ends the connection of a client when another comes with the same one."""
    version: int = MQTT_311
    keepalive: int = 10
    """Seconds; without an answer for twice as long the broker is lost."""
    username: str = ""
    password_file: str = ""
    tls: BrokerTlsFiles | None = None
