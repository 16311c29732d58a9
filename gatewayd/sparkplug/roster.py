"""The devices of an edge node, with the aliases and the latest values of their metrics."""

from __future__ import annotations

from collections.abc import Iterable

from gatewayd.sparkplug.declarations import (
    RESERVED,
    DeviceDeclaration,
    MetricDeclaration,
    MetricValue,
    QualityCode,
)
from gatewayd.sparkplug.topics import name_fault


class RosterDevice:
    """A device, or the edge node itself."""

    def __init__(self, declaration: DeviceDeclaration, aliases: dict[str, int]) -> None:
        self.declaration = declaration
        self.name = declaration.name
        self.metrics = {metric.name: metric for metric in declaration.metrics}
        self.aliases = aliases
        self.by_alias = {alias: name for name, alias in aliases.items()}
        self.latest: dict[str, MetricValue] = {}
        self.unsent: dict[str, None] = {}
        """Metrics whose latest value is still to be sent, in their order."""
        self.is_present = True
        """Whether the device can be reached; one that cannot is dead."""
        self.is_born = False
        """Whether its birth was sent in this session, and no death since."""

    def value(self, name: str, now: float) -> MetricValue:
        """The latest value; null and stale where there is none yet."""
        return self.latest.get(name) or MetricValue(None, now, QualityCode.STALE)

    def succeed(self, former: RosterDevice) -> None:
        """Go on with what is known of the device by its former declaration."""
        self.is_present = former.is_present
        # A death that was not sent yet is still to be sent.
        self.is_born = former.is_born and not former.is_present
        self.latest = {
            name: value
            for name, value in former.latest.items()
            if name in self.metrics and self.metrics[name].type is former.metrics[name].type
        }

    def find(self, name: str | None, alias: int | None) -> MetricDeclaration | None:
        """The metric of this name, or else of this alias."""
        known = name if name is not None else self.by_alias.get(-1 if alias is None else alias)
        return None if known is None else self.metrics.get(known)


class AliasBook:
    """The aliases of all metrics: unique in the edge node (tck-id-payloads-alias-uniqueness), and never given twice.

    What was sent before a reload means the same after it.
    """

    def __init__(self) -> None:
        self._aliases: dict[tuple[str, str], int] = {}

    def of(self, device: DeviceDeclaration) -> dict[str, int]:
        """Metric -> its alias."""
        return {
            metric.name: self._aliases.setdefault((device.name, metric.name), len(self._aliases) + 1)
            for metric in device.metrics
        }


class Roster:
    """All devices, and the edge node.

    Of a former roster goes on what is declared as before; values and presence of what was declared otherwise are kept
    as well, but it is not born any more.
    """

    def __init__(
        self,
        metrics: Iterable[MetricDeclaration],
        devices: Iterable[DeviceDeclaration],
        former: Roster | None = None,
    ) -> None:
        self.aliases: AliasBook = former.aliases if former is not None else AliasBook()
        known = {} if former is None else {"": former.node, **former.devices}
        own, *others = (
            self._member(declaration, known.get(declaration.name))
            for declaration in (DeviceDeclaration("", tuple(metrics)), *devices)
        )
        self.node: RosterDevice = own
        self.devices: dict[str, RosterDevice] = {device.name: device for device in others}
        if len(self.devices) < len(others) or "" in self.devices:
            raise ValueError("two devices have one name")

    def get(self, name: str) -> RosterDevice:
        """The device, or the edge node for the empty name."""
        return self.devices[name] if name else self.node

    def _member(self, declaration: DeviceDeclaration, former: RosterDevice | None) -> RosterDevice:
        if former is not None and former.declaration == declaration:
            return former
        _check(declaration)
        device = RosterDevice(declaration, self.aliases.of(declaration))
        if former is not None:
            device.succeed(former)
        return device


def _check(declaration: DeviceDeclaration) -> None:
    """What a mapping must not let come so far."""
    names = [metric.name for metric in declaration.metrics]
    fault = name_fault(declaration.name) if declaration.name else ""
    if fault:
        raise ValueError(f"device {declaration.name!r} {fault}")
    if len(set(names)) < len(names):
        raise ValueError(f"device {declaration.name!r} has two metrics of one name")
    if not all(names) or (not declaration.name and RESERVED & set(names)):
        raise ValueError(f"device {declaration.name!r} has a metric with a name that it cannot have")
