"""What an edge node has: devices, their metrics, and the values of these."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from gatewayd.sparkplug.datatypes import MetricType, Scalar, encode_value
from gatewayd.sparkplug.payload import PropertyValue

BD_SEQ = "bdSeq"
REBIRTH = "Node Control/Rebirth"
QUALITY = "Quality"
RESERVED = {BD_SEQ, REBIRTH}
"""Names of the edge node's own metrics that it brings itself."""


class QualityCode(IntEnum):
    """Values of the property `Quality`; there are no others (tck-id-payloads-propertyset-quality-value-value)."""

    BAD = 0
    GOOD = 192
    STALE = 500


@dataclass(frozen=True, slots=True)
class MetricProperty:
    """A property that the birth of a metric tells: a unit, a limit, a description."""

    key: str
    type: MetricType
    value: Scalar

    def encoded(self) -> tuple[str, PropertyValue]:
        """As a payload has it."""
        return self.key, PropertyValue(self.type, value=encode_value(self.type, self.value))


@dataclass(frozen=True, slots=True)
class MetricDeclaration:
    """A metric. Only one that is writable takes commands."""

    name: str
    type: MetricType
    is_writable: bool = False
    properties: tuple[MetricProperty, ...] = ()


@dataclass(frozen=True, slots=True)
class DeviceDeclaration:
    """A device and its metrics. The one with the empty name is the edge node itself."""

    name: str
    metrics: tuple[MetricDeclaration, ...] = ()

    @property
    def is_writable(self) -> bool:
        """Whether any of its metrics takes commands."""
        return any(metric.is_writable for metric in self.metrics)


@dataclass(frozen=True, slots=True)
class MetricValue:
    """What a metric holds: None is null. `time` is when the source had it, in the seconds of all other times here."""

    value: Scalar | None
    time: float
    quality: QualityCode = QualityCode.GOOD


def quality_property(quality: QualityCode) -> tuple[str, PropertyValue]:
    """As a payload has it: an Int32 (tck-id-payloads-propertyset-quality-value-type)."""
    return QUALITY, PropertyValue(MetricType.INT32, value=encode_value(MetricType.INT32, quality))
