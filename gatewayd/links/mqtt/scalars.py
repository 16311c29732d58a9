"""The small languages of MQTT in a mapping: topics, and names within them."""

from __future__ import annotations

from typing import Annotated

from gatewayd.mapping import syntax
from gatewayd.mapping.diagnostics import declare
from gatewayd.mapping.scalars import refuse, scalar
from gatewayd.mapping.typed import BeforeValidator, Field
from gatewayd.mqtt.names import MAX_TOPIC, fault_of

BAD_TOPIC = declare(
    "GW860",
    "bad-topic",
    "a topic, or a part of one, that MQTT or Sparkplug does not allow",
    home="gatewayd.links.mqtt.rules",
)


def _topic(value: object) -> str:
    hint = "write levels with `/` between them, for example plant/hall-2/press-3"
    text = scalar(value, "a topic", hint)
    fault = fault_of(text)
    if fault:
        refuse(BAD_TOPIC, f"`{text}` is not a topic: {fault}", hint)
    return text


def _sparkplug_name(value: object) -> str:
    hint = "use letters, digits, `-` and `_`, for example hall-2"
    text = scalar(value, "a name", hint)
    fault = fault_of(text) or ("`/` stands between levels of a topic" if "/" in text else "")
    if fault:
        refuse(BAD_TOPIC, f"`{text}` is not a name for Sparkplug: {fault}", hint)
    return text


def _client(value: object) -> str:
    hint = "use letters, digits, `-` and `_`, for example gatewayd-press-3"
    text = scalar(value, "a client identifier", hint)
    if not text or len(text) > MAX_TOPIC or not text.isprintable():
        refuse(syntax.BAD_NAME, f"`{text}` is not a client identifier", hint)
    return text


_TOPIC_SCHEMA = Annotated[str, Field(pattern="^[^+#$/][^+#]*$", max_length=MAX_TOPIC)]
Topic = Annotated[str, BeforeValidator(_topic, json_schema_input_type=_TOPIC_SCHEMA)]
"""A topic, or some levels of one."""
SparkplugName = Annotated[
    str, BeforeValidator(_sparkplug_name, json_schema_input_type=Annotated[str, Field(pattern="^[^+#/]+$")])
]
"""One level of a Sparkplug topic."""
ClientName = Annotated[
    str, BeforeValidator(_client, json_schema_input_type=Annotated[str, Field(max_length=MAX_TOPIC)])
]
"""A client identifier."""
