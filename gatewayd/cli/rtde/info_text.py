"""What `gatewayd rtde info` has found of a controller, for people and for programs. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from gatewayd.report.format import address, counted, span
from gatewayd.report.printable import json_document, printable
from gatewayd.rtde.enums import meanings
from gatewayd.rtde.messages import TextLevel, TextMessage
from gatewayd.rtde.properties import KNOWN_PROPERTIES, PropertyValue

_WIDTH = 14
_LEVELS = {level.value: level.name.lower() for level in TextLevel}
_VERSION = "v1.software.version"


@dataclass(frozen=True, slots=True)
class ControllerFacts:
    """One look at a controller."""

    address: str
    software: str
    series: str | None
    protocol: int
    own_address: tuple[str, int] | None
    """Our end of the connection."""
    maximum: float
    """Packages that it can send per second."""
    applied: float
    """Packages per second that were agreed."""
    measured: float | None = None
    """Packages per second that came; None: none came."""
    skipped: int = 0
    """Packages that it left out meanwhile."""
    uptime: float | None = None
    """The controller's own clock, in seconds; None: no package came."""
    states: Mapping[str, int] = field(default_factory=dict)
    """Modes and states by field."""
    texts: Sequence[TextMessage] = ()
    """What it said meanwhile."""
    answers_properties: bool = False
    """Whether it knows READ_PROPERTIES."""
    properties: Mapping[str, PropertyValue] = field(default_factory=dict)
    missing: Mapping[str, str] = field(default_factory=dict)
    """Properties without a value, and the controller's word for each."""


def lines(facts: ControllerFacts) -> Iterator[str]:
    """For people; printable."""
    for name, text in _rows(facts):
        yield printable(f"{name.ljust(_WIDTH)} {text}")


def _rows(facts: ControllerFacts) -> Iterator[tuple[str, str]]:
    yield "controller", facts.address
    yield "software", f"{facts.software}, series {facts.series or 'unknown'}"
    yield "protocol", f"version {facts.protocol}"
    if facts.own_address is not None:
        yield "connected", f"from {address(*facts.own_address)}"
    yield "rate", _rate(facts)
    if facts.uptime is not None:
        yield "running for", span(facts.uptime)
    for name, value in facts.states.items():
        yield name, f"{value} {meanings(name, None).get(value, '')}".rstrip()
    for text in facts.texts:
        yield "says", f"{_level(text)}: {text.message}" + (f" ({text.source})" if text.source else "")
    if not facts.answers_properties:
        yield "properties", "no answer, as of every controller before 5.26 and 10.15"
    for name, found in facts.properties.items():
        yield "property", f"{name} = {property_text(name, found)}"
    for name, word in facts.missing.items():
        yield "property", f"{name}: {word}"


def _rate(facts: ControllerFacts) -> str:
    agreed = f"{facts.applied:g} Hz agreed, {facts.maximum:g} Hz at most"
    if facts.measured is None:
        return f"no data came; {agreed}: is the robot powered, and its safety set-up confirmed?"
    skipped = f", {counted(facts.skipped, 'package')} left out" if facts.skipped else ""
    return f"{facts.measured:.1f} Hz measured{skipped}; {agreed}"


def _level(text: TextMessage) -> str:
    return _LEVELS.get(text.level, f"level {text.level}")


def property_text(name: str, value: PropertyValue) -> str:
    """A property as people say it, where its layout is known: `5.27.0`; `type 5, subtype 0`."""
    if not isinstance(value, int):
        return str(value)
    if name == _VERSION:
        return f"{value >> 48}.{value >> 32 & 0xFFFF}.{value >> 16 & 0xFFFF}"
    if name in KNOWN_PROPERTIES:
        part = "revision" if name.endswith("flange.type") else "subtype"
        return f"type {value >> 24}, {part} {value >> 16 & 0xFF}"
    return str(value)


def as_json(facts: ControllerFacts) -> str:
    """One JSON document: `version` 1, `controller` (address), `software`, `series`, `protocol`, `own_address`.

    `series` may be null. `frequency` has `maximum`, `applied` and `measured` (or null); `skipped`, `uptime` (s, or
    null); `states` has `value` and `meaning` (or null) by field; `texts` have `level`, `source`, `text`; `properties`
    has `answered`, `values` and `missing`. Keys are only ever added within a version.
    """
    return json_document(
        {
            "version": 1,
            "controller": facts.address,
            "software": facts.software,
            "series": facts.series,
            "protocol": facts.protocol,
            "own_address": None if facts.own_address is None else address(*facts.own_address),
            "frequency": {"maximum": facts.maximum, "applied": facts.applied, "measured": facts.measured},
            "skipped": facts.skipped,
            "uptime": facts.uptime,
            "states": {
                name: {"value": value, "meaning": meanings(name, None).get(value)}
                for name, value in facts.states.items()
            },
            "texts": [
                {"level": _level(text), "source": text.source, "text": text.message} for text in facts.texts
            ],
            "properties": {
                "answered": facts.answers_properties,
                "values": dict(facts.properties),
                "missing": dict(facts.missing),
            },
        }
    )
