"""The MQTT side of one cell as a device of a Sparkplug B edge node: metrics, values and commands.

| quality of a value | `Quality` of its metric |
|---|---|
| good | 192 |
| stale, never | 500 |
| any other: unavailable, forced, differs, out of range, not running | 0 |
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, ValueKind, Variable
from gatewayd.core.image import Quality
from gatewayd.core.unserved import Unserved
from gatewayd.links.mqtt.link import NOT_CONNECTED, WAITING, MqttLink
from gatewayd.links.mqtt.plan import MqttPlan, Publication
from gatewayd.links.mqtt.publisher import Publisher, ValueSample
from gatewayd.sparkplug.datatypes import MetricType, Scalar, range_of
from gatewayd.sparkplug.declarations import (
    DeviceDeclaration,
    MetricDeclaration,
    MetricProperty,
    MetricValue,
    QualityCode,
)

PRIMARY_HOST: Final = "primary_host"
UNIT: Final = "engUnit"
_CODES: Final = {
    Quality.GOOD: QualityCode.GOOD,
    Quality.STALE: QualityCode.STALE,
    Quality.NEVER: QualityCode.STALE,
}
_INTEGERS: Final = (MetricType.INT32, MetricType.UINT32, MetricType.INT64, MetricType.UINT64)
"""The first that has room for all that a variable can be is its type."""


class SparkplugLink(MqttLink):
    """One device. The edge node that it belongs to calls it."""

    def __init__(self, plan: MqttPlan, cell: Cell) -> None:
        self.waits_for_host = False
        """Whether the node waits for its primary host."""
        self.kept = self.lost_changes = 0
        """Of the edge node's history, which its cells share."""
        super().__init__(plan, cell)

    def _publisher(self) -> Publisher:
        return Publisher(self.plan.publications, self._cell.image, None)

    @property
    def stored(self) -> int:
        """Changes that the edge node keeps."""
        return self.kept

    @property
    def dropped(self) -> int:
        """Changes that the edge node has lost."""
        return self.lost_changes

    @property
    def device(self) -> str:
        """Its name."""
        assert self.plan.sparkplug is not None
        return self.plan.sparkplug.device

    def state(self) -> int:
        """Of the connection, or that the primary host is missing."""
        found = super().state()
        return WAITING if self.waits_for_host and found != NOT_CONNECTED else found

    def declaration(self) -> DeviceDeclaration:
        """The metrics of the device: a writable one takes commands."""
        variables = self._cell.definition.variables
        commanded = bool(self.plan.writers)
        return DeviceDeclaration(
            self.device,
            tuple(_metric(each, variables[each.variable], commanded) for each in self.plan.publications),
        )

    def due(self, now: float) -> tuple[dict[str, MetricValue], dict[str, MetricValue]]:
        """What is to be said now for the first time, and what has changed; it counts as said."""
        first: dict[str, MetricValue] = {}
        changed: dict[str, MetricValue] = {}
        for sample in self.publisher.due(now, repeat=False):
            found = first if sample.is_first else changed
            found[sample.name] = value_of(sample, now)
            self.publisher.said(sample, now)
        return first, changed

    def present(self, names: Iterable[str], now: float) -> dict[str, MetricValue]:
        """What these are, whether or not it was said."""
        known = self.desk.variables
        return {name: value_of(self.publisher.sample(known[name]), now) for name in names if name in known}

    def command(self, values: Mapping[str, Scalar], waited: float, now: float) -> bool:
        """Carry a command out as a whole, or not at all."""
        known = self._known()
        if known is None:
            return False
        refusal, _meant = self.desk.write(known, values, waited, now)
        return refusal is None

    def ignore(self, request: str, now: float) -> None:
        """A command that nobody has to judge."""
        known = self._known()
        if known is not None:
            reason = Unserved.NOT_ALLOWED if "retained" in request else Unserved.MALFORMED
            self.desk.ignore(known, reason, request, now)

    def host_lost(self, now: float) -> None:
        """The primary host is offline: it is no writer any more."""
        self.desk.lost([PRIMARY_HOST], "the primary host is offline", now)

    def broker_lost(self, reason: str, now: float) -> None:
        """Nobody can command any more."""
        self.desk.all_lost(f"the broker is lost: {reason}", now)
        self.show_words()

    def _known(self) -> str | None:
        """Who a command is from: one writer at most, because a message names nobody."""
        return next((known for known, _writer in self.plan.writers), None)


def value_of(sample: ValueSample, now: float) -> MetricValue:
    """A sample as the value of a metric."""
    time = sample.time if math.isfinite(sample.time) else now
    return MetricValue(sample.value, time, _CODES.get(sample.quality, QualityCode.BAD))


def _metric(each: Publication, variable: Variable, commanded: bool) -> MetricDeclaration:
    writable = commanded and variable.direction is Direction.INPUT
    return MetricDeclaration(each.name, type_of(variable), writable, tuple(_properties(variable)))


def type_of(variable: Variable) -> MetricType:
    """The type that has room for all that it can be."""
    if variable.kind is ValueKind.BOOL:
        return MetricType.BOOLEAN
    if variable.kind is ValueKind.FLOAT:
        return MetricType.DOUBLE
    low, high = variable.low, variable.high
    for kind in _INTEGERS:
        least, greatest = range_of(kind)
        if low is not None and high is not None and least <= low and high <= greatest:
            return kind
    return MetricType.INT64


def _properties(variable: Variable) -> Iterator[MetricProperty]:
    if variable.unit:
        yield MetricProperty(UNIT, MetricType.STRING, variable.unit)
