"""Topics of Sparkplug B (specification 4.1): `spBv1.0/group/TYPE/node[/device]`, `spBv1.0/STATE/host`."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

NAMESPACE = "spBv1.0"
MAX_TOPIC = 65_535
"""Bytes of a topic in MQTT."""


class MessageType(Enum):
    """The type of a message, as its topic has it."""

    NBIRTH = "NBIRTH"
    NDEATH = "NDEATH"
    NDATA = "NDATA"
    NCMD = "NCMD"
    DBIRTH = "DBIRTH"
    DDEATH = "DDEATH"
    DDATA = "DDATA"
    DCMD = "DCMD"
    STATE = "STATE"

    @property
    def is_of_device(self) -> bool:
        """Whether its topic has a device."""
        return self.value.startswith("D")


@dataclass(frozen=True, slots=True)
class SparkplugTopic:
    """What a topic says. STATE has a host alone, all others a group and a node."""

    type: MessageType
    group: str = ""
    node: str = ""
    device: str = ""
    host: str = ""

    def __str__(self) -> str:
        if self.type is MessageType.STATE:
            return f"{NAMESPACE}/STATE/{self.host}"
        device = f"/{self.device}" if self.type.is_of_device else ""
        return f"{NAMESPACE}/{self.group}/{self.type.value}/{self.node}{device}"


def parse_topic(text: str) -> SparkplugTopic | None:
    """What the topic says; None if it is not one of Sparkplug B."""
    namespace, *rest = text.split("/")
    if namespace != NAMESPACE or not all(rest):
        return None
    if len(rest) == 2 and rest[0] == "STATE":
        return SparkplugTopic(MessageType.STATE, host=rest[1])
    if len(rest) not in (3, 4):
        return None
    group, kind, node, *device = rest
    if kind == "STATE" or kind not in MessageType.__members__:
        return None
    of = MessageType(kind)
    if of.is_of_device != bool(device):
        return None
    return SparkplugTopic(of, group, node, *device)


def name_fault(name: str) -> str:
    """What keeps a text from being the id of a group, an edge node, a device or a host; empty if nothing does.

    tck-id-topic-structure-namespace-valid-group-id, -edge-node-id, -device-id; control characters and the like are what
    MQTT lets a broker refuse (MQTT 5.0, 1.5.4).
    """
    if not name:
        return "is empty"
    for character in name:
        if character in "+/#":
            return f"has a {character}, which MQTT reserves"
        code = ord(character)
        if code < 0x20 or 0x7F <= code < 0xA0:
            return f"has the control character U+{code:04X}"
        if 0xD800 <= code < 0xE000 or 0xFDD0 <= code < 0xFDF0 or code & 0xFFFE == 0xFFFE:
            return f"has U+{code:04X}, which is no character"
    return ""
