"""MQTT in a mapping file: the section `mqtt`, and the key `mqtt` of variables and writers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal

from gatewayd.links.mqtt.scalars import ClientName, SparkplugName, Topic
from gatewayd.mapping import syntax
from gatewayd.mapping.scalars import Duration, Host, OptionalDuration, Real, Whole, refuse, scalar
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import BeforeValidator, Field
from gatewayd.mqtt.messages import MQTT_5, MQTT_311

INTERVAL: Final = 1.0
"""Seconds between two messages of a variable where the file says nothing."""


def _version(value: object) -> int:
    text = scalar(value, "a version of MQTT", "write 3.1.1 or 5")
    if text not in _VERSIONS:
        refuse(syntax.BAD_CHOICE, f"`{text}` is no version of MQTT that is spoken here", "write 3.1.1 or 5")
    return _VERSIONS[text]


_VERSIONS: Final = {"3.1.1": MQTT_311, "5": MQTT_5, "5.0": MQTT_5}
MqttVersion = Annotated[int, BeforeValidator(_version, json_schema_input_type=Literal["3.1.1", 5])]
"""The protocol level that CONNECT has for it."""


class MqttTls(Section):
    """TLS to the broker."""

    ca: str = Field(
        default="",
        max_length=4096,
        description="file with the authorities that the broker's certificate may be from; default: those of the system",
    )
    certificate: str = Field(
        default="",
        max_length=4096,
        description="file with the gateway's own certificate, where the broker asks for one",
    )
    key: str = Field(default="", max_length=4096, description="file with its private key, without a password")

    def judge(self) -> None:
        """A key alone is of no use."""
        if bool(self.key) != bool(self.certificate):
            have, lack = ("key", "certificate") if self.key else ("certificate", "key")
            refuse(
                syntax.MISSING_KEY,
                f"`{have}` needs `{lack}`",
                f"name the file: {lack}: /etc/gatewayd/mqtt.{lack}",
            )


class MqttStore(Section):
    """What is kept while the broker is away."""

    keep: OptionalDuration = Field(
        default=600.0, description="time for which changes are kept at most; none: nothing is kept"
    )
    size: Whole = Field(
        default=10_000, ge=1, le=1_000_000, description="changes that are kept at most; the oldest go first"
    )


class SparkplugSection(Section):
    """The cell as a device of a Sparkplug B edge node."""

    group: SparkplugName = Field(description="group of the edge node")
    node: SparkplugName = Field(description="name of the edge node: this gateway")
    device: SparkplugName | None = Field(
        default=None, description="name of the device; default: the name of the cell"
    )
    primary_host: SparkplugName | None = Field(
        default=None,
        description="host application that this node waits for: while it is offline nothing is published, and its "
        "writers are lost; default: none",
    )


class MqttSection(Section):
    """A broker, and what of the cell it gets."""

    host: Host = Field(description="name or IP address of the broker")
    port: Whole | None = Field(
        default=None, ge=1, le=65535, description="its port; default: 1883, with `tls` 8883"
    )
    version: MqttVersion = Field(
        default=MQTT_311, description="version of MQTT: 3.1.1 or 5", json_schema_extra={"default": "3.1.1"}
    )
    tls: MqttTls | None = Field(
        default=None, description="the connection is encrypted; {}: with the system's authorities"
    )
    username: str = Field(default="", max_length=256, description="name that the broker knows the gateway by")
    password_file: str = Field(
        default="",
        max_length=4096,
        description="file whose first line is the password; read at each connection",
    )
    client: ClientName | None = Field(
        default=None,
        description="client identifier; default: gatewayd- and the name of the cell, or of group and node",
    )
    keepalive: Duration = Field(
        default=10.0,
        ge=1,
        le=3600,
        description="time without a message after which the broker is asked for an answer, in whole seconds; after "
        "twice as long without one it is lost",
    )
    topic: Topic | None = Field(
        default=None, description="what all topics of this cell begin with, for values as JSON: plant/press-3"
    )
    sparkplug: SparkplugSection | None = Field(default=None, description="values by Sparkplug B 3.0 instead")
    publish: Literal["all", "named"] = Field(
        default="all", description="which variables are published: all, or those that have `mqtt`"
    )
    interval: Duration = Field(
        default=INTERVAL, ge=0.02, description="least time between two messages of one variable"
    )
    every: OptionalDuration = Field(
        default=60.0,
        description="JSON: time after which a value is sent again though nothing changed; none: only changes",
    )
    retain: bool = Field(
        default=False,
        description="JSON: have the broker keep the last message of each value, which outlives the gateway",
    )
    store: MqttStore = Field(default_factory=MqttStore, description="what is kept while the broker is away")

    def judge(self) -> None:
        """Exactly one way to say values."""
        if (self.topic is None) is (self.sparkplug is None):
            found = "neither" if self.topic is None else "both"
            message = f"a broker gets values as JSON (`topic`) or by Sparkplug (`sparkplug`); found {found}"
            hint = "write `topic: plant/press-3`, or `sparkplug: {group: plant, node: hall-2}`"
            refuse(syntax.MISSING_KEY, message, hint)
        if self.password_file and not self.username:
            refuse(syntax.MISSING_KEY, "`password_file` needs `username`", "add `username`, or remove it")


class MqttPlaceSpec(Section):
    """How a variable is published."""

    publish: bool = Field(default=True, description="whether it is published at all")
    name: Topic | None = Field(default=None, description="its name behind `topic`; default: its own")
    deadband: Real | None = Field(
        default=None, ge=0, description="least change that is published; default: `deadband` of the variable"
    )
    interval: Duration | None = Field(
        default=None,
        ge=0.02,
        description="least time between two messages; default: as in the section `mqtt`",
    )


def _place(value: Any) -> Any:
    """Bring the short form into the long one."""
    if isinstance(value, dict | MqttPlaceSpec):
        return value
    return {"publish": False} if value == "none" else {"name": value}


class MqttPlaces(Section):
    """What a variable has by MQTT."""

    mqtt: Annotated[
        MqttPlaceSpec | None, BeforeValidator(_place, json_schema_input_type=Topic | MqttPlaceSpec)
    ] = Field(
        default=None,
        description="its name in topics, {name: ..., deadband: ..., interval: ...}, or none: it is not published",
    )


class MqttWriter(Section):
    """What a writer has by MQTT."""

    mqtt: Topic | None = Field(
        default=None,
        description="topic of its commands, behind `topic`; with Sparkplug `primary_host` or `any_host`",
    )


HOSTS: Final[Mapping[str, bool]] = {"primary_host": True, "any_host": False}
"""What a writer of a Sparkplug cell is, and whether it is lost with the primary host."""
