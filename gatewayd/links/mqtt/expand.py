"""From the MQTT keys of a document to what is published and who commands, each with its place in the file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gatewayd.links.mqtt.sections import MqttPlaces, MqttSection, MqttWriter
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedLink, ExpandedVariable
from gatewayd.mapping.model import WriterSpec


@dataclass(frozen=True, slots=True)
class ExpandedPublication:
    """One variable, as it is published."""

    variable: ExpandedVariable
    name: str
    position: Position
    """Where the name is written, or the variable's."""
    deadband: float
    interval: float


@dataclass(frozen=True, slots=True)
class ExpandedMqtt(ExpandedLink):
    """The side of a cell that a broker sees."""

    publications: tuple[ExpandedPublication, ...]


def publications_of(cell: ExpandedCell) -> tuple[ExpandedPublication, ...]:
    """What the cell publishes."""
    mqtt = cell.link(ExpandedMqtt)
    return mqtt.publications if mqtt is not None else ()


def section_of(document: Document) -> Part[MqttSection] | None:
    """The section; None where there is none, or a broken one."""
    return document.part(MqttSection)


def writers_of(document: Document) -> Iterator[tuple[int, Part[WriterSpec], str]]:
    """Writers that command by MQTT: index, line, and what they are known by."""
    for index, part in enumerate(document.writers.values()):
        name = part.spec.by(MqttWriter).mqtt
        if name is not None:
            yield index, part, name


def expand_mqtt(document: Document, variables: Sequence[ExpandedVariable]) -> ExpandedMqtt | None:
    """What is published, by variable. Never raises."""
    section = section_of(document)
    if section is None:
        return None
    found = (_publication(variable, section.spec) for variable in variables)
    return ExpandedMqtt(tuple(each for each in found if each is not None))


def _publication(variable: ExpandedVariable, section: MqttSection) -> ExpandedPublication | None:
    place = variable.spec.by(MqttPlaces).mqtt
    if place is None:
        if section.publish == "named":
            return None
        return ExpandedPublication(
            variable, variable.name, variable.position, variable.spec.deadband, section.interval
        )
    if not place.publish:
        return None
    member = "" if variable.member is None else f"[{variable.member}]"
    return ExpandedPublication(
        variable,
        variable.name if place.name is None else place.name + member,
        variable.at("mqtt", "name") if place.name is not None else variable.position,
        variable.spec.deadband if place.deadband is None else place.deadband,
        section.interval if place.interval is None else place.interval,
    )
