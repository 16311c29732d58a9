"""The messages of an edge node: births, data and deaths, with their sequence number."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from gatewayd.sparkplug.actions import SparkplugMessage
from gatewayd.sparkplug.datatypes import MetricType, encode_value
from gatewayd.sparkplug.declarations import (
    BD_SEQ,
    REBIRTH,
    MetricDeclaration,
    MetricValue,
    quality_property,
)
from gatewayd.sparkplug.payload import Metric, Payload, encode_payload
from gatewayd.sparkplug.roster import RosterDevice
from gatewayd.sparkplug.topics import MessageType, SparkplugTopic

SEQUENCES = 256
"""Sequence numbers, and birth/death sequence numbers, are 0 to 255."""


class MessageWriter:
    """Writes messages. The sequence number moves when a message was `sent`."""

    def __init__(self, group: str, node: str, utc: Callable[[float], int]) -> None:
        self.seq = 0
        """Of the next message but a birth of the edge node, which has 0."""
        self.bd_seq = 0
        """Of the present MQTT session."""
        self._group, self._node = group, node
        self._utc = utc

    def sent(self, message: SparkplugMessage) -> None:
        """Of all messages of the node and its devices, each has the next number (tck-id-payloads-sequence-num-*)."""
        if message.type is MessageType.NBIRTH:
            self.seq = 1
        elif message.type is not MessageType.NDEATH:
            self.seq = (self.seq + 1) % SEQUENCES

    def topic(self, kind: MessageType, device: str = "") -> str:
        """Of messages of the node, or of a device."""
        return str(SparkplugTopic(kind, self._group, self._node, device))

    def node_death(self, now: float) -> SparkplugMessage:
        """The will, and what is published before a DISCONNECT: bdSeq and nothing else, QoS 1.

        tck-id-payloads-ndeath-will-message-qos, -retain, -topics-ndeath-payload, -topics-ndeath-seq.
        """
        payload = Payload(timestamp=self._utc(now), metrics=(self._bd_seq_metric(now),))
        topic = self.topic(MessageType.NDEATH)
        return SparkplugMessage(MessageType.NDEATH, topic, encode_payload(payload), qos=1)

    def node_birth(self, node: RosterDevice, now: float) -> SparkplugMessage:
        """NBIRTH: bdSeq, the rebirth control, which has no alias, and every metric of the node."""
        control = Metric(
            name=REBIRTH,
            timestamp=self._utc(now),
            datatype=MetricType.BOOLEAN,
            value=encode_value(MetricType.BOOLEAN, value=False),
        )
        own = (self._bd_seq_metric(now), control)
        return self._message(MessageType.NBIRTH, node, (*own, *self._births(node, now)), now, seq=0)

    def device_birth(self, device: RosterDevice, now: float) -> SparkplugMessage:
        """DBIRTH: every metric of the device."""
        return self._message(MessageType.DBIRTH, device, self._births(device, now), now)

    def device_death(self, device: RosterDevice, now: float) -> SparkplugMessage:
        """DDEATH: nothing but when."""
        return self._message(MessageType.DDEATH, device, (), now)

    def data(self, device: RosterDevice, names: Iterable[str], now: float) -> SparkplugMessage:
        """NDATA or DDATA with the latest values, in the order of their times.

        tck-id-operational-behavior-data-publish-nbirth-order, -dbirth-order.
        """
        values = [(name, device.value(name, now)) for name in names]
        values.sort(key=lambda pair: pair[1].time)
        return self._data(device, values, now, is_historical=None)

    def history(
        self, device: RosterDevice, values: Iterable[tuple[str, MetricValue]], now: float
    ) -> SparkplugMessage:
        """NDATA or DDATA with values of before."""
        return self._data(device, values, now, is_historical=True)

    def _data(
        self,
        device: RosterDevice,
        values: Iterable[tuple[str, MetricValue]],
        now: float,
        *,
        is_historical: bool | None,
    ) -> SparkplugMessage:
        metrics = tuple(self._datum(device, name, value, is_historical) for name, value in values)
        kind = MessageType.DDATA if device.name else MessageType.NDATA
        return self._message(kind, device, metrics, now)

    def _message(
        self,
        kind: MessageType,
        device: RosterDevice,
        metrics: tuple[Metric, ...],
        now: float,
        seq: int | None = None,
    ) -> SparkplugMessage:
        payload = Payload(self._utc(now), metrics, self.seq if seq is None else seq)
        return SparkplugMessage(kind, self.topic(kind, device.name), encode_payload(payload))

    def _births(self, device: RosterDevice, now: float) -> tuple[Metric, ...]:
        return tuple(self._birth(device, metric, now) for metric in device.metrics.values())

    def _birth(self, device: RosterDevice, metric: MetricDeclaration, now: float) -> Metric:
        value = device.value(metric.name, now)
        is_null = value.value is None
        return Metric(
            name=metric.name,
            alias=device.aliases[metric.name],
            timestamp=self._utc(value.time),
            datatype=metric.type,
            is_null=is_null or None,
            properties=(
                *(one.encoded() for one in metric.properties),
                quality_property(value.quality),
            ),
            value=None if value.value is None else encode_value(metric.type, value.value),
        )

    def _datum(
        self, device: RosterDevice, name: str, value: MetricValue, is_historical: bool | None
    ) -> Metric:
        kind = device.metrics[name].type
        return Metric(
            alias=device.aliases[name],
            timestamp=self._utc(value.time),
            is_historical=is_historical,
            is_null=value.value is None or None,
            properties=(quality_property(value.quality),),
            value=None if value.value is None else encode_value(kind, value.value),
        )

    def _bd_seq_metric(self, now: float) -> Metric:
        return Metric(
            name=BD_SEQ,
            timestamp=self._utc(now),
            datatype=MetricType.INT64,
            value=encode_value(MetricType.INT64, self.bd_seq),
        )
