"""Rules GW861, GW865 and GW868: by which names a broker gets the values of a cell."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.core.definition import ValueKind
from gatewayd.links.mqtt.expand import publications_of, section_of, writers_of
from gatewayd.links.mqtt.plan import AVAILABLE, HISTORY, RESULT
from gatewayd.links.mqtt.sections import MqttPlaces, MqttWriter
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule


@cell_rule("GW861")
def topic_twice(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """One topic or metric for two things."""
    section = section_of(cell.document)
    if section is None:
        return
    is_json = section.spec.topic is not None
    taken: dict[str, tuple[str, Position]] = {}
    own = {AVAILABLE: "whether the gateway is there"}
    for name, what, position in _names(cell, is_json=is_json):
        if is_json and name in own:
            message = f"`{name}` says {own[name]}, and cannot be {what} as well"
            yield rule.at(position, message, hint=f"choose another name, for example {name}_2")
            continue
        if is_json and name.startswith(f"{HISTORY}/"):
            message = f"`{name}` lies among what values were while the broker was away ({HISTORY}/...)"
            yield rule.at(position, message, hint="choose a name that begins otherwise")
            continue
        known = taken.setdefault(name, (what, position))
        if known[1] != position:
            message = f"`{name}` is {what}, and {known[0]} already"
            related = (Related(known[1], "first used here"),)
            yield rule.at(position, message, hint="give one of them another name", related=related)


def _names(cell: ExpandedCell, *, is_json: bool) -> Iterator[tuple[str, str, Position]]:
    """Everything behind the topic of the cell: name, what it is, and where it is written."""
    for each in publications_of(cell):
        yield each.name, f"the value of `{each.variable.name}`", each.position
    topics: set[str] = set()
    if is_json:
        for _index, part, name in writers_of(cell.document):
            if name in topics:
                continue  # that is GW869
            topics.add(name)
            yield name, f"the commands of `{part.name}`", part.at("mqtt")
            yield f"{name}/{RESULT}", f"the answers to `{part.name}`", part.at("mqtt")


@cell_rule("GW865")
def no_mqtt_section(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A name or topic by MQTT in a file without a broker."""
    if cell.document.has("mqtt"):
        return
    hint = "add `mqtt: {host: broker.example, topic: plant/press-3}`, or remove it"
    for variable in cell.document.variables.values():
        if variable.spec.by(MqttPlaces).mqtt is not None:
            message = f"`{variable.name}` has a name by MQTT, and the file has no section `mqtt`"
            yield rule.at(variable.key_at("mqtt"), message, hint=hint)
    for writer in cell.document.writers.values():
        if writer.spec.by(MqttWriter).mqtt is not None:
            message = f"`{writer.name}` commands by MQTT, and the file has no section `mqtt`"
            yield rule.at(writer.key_at("mqtt"), message, hint=hint)


@cell_rule("GW868")
def publishing_key_without_effect(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A deadband, name or interval that nothing is published by."""
    seen: set[str] = set()
    for variable in cell.variables:
        place = variable.spec.by(MqttPlaces).mqtt
        if place is None or variable.part.name in seen:
            continue
        seen.add(variable.part.name)
        if not place.publish:
            for key in ("name", "deadband", "interval"):
                if key in place.model_fields_set:
                    message = f"`{variable.part.name}` is not published, so its `{key}` has no effect"
                    yield rule.at(variable.part.key_at("mqtt", key), message, hint="remove one of the two")
        elif place.deadband and variable.kind is not ValueKind.FLOAT and place.deadband <= 1:
            what = "bit" if variable.kind is ValueKind.BOOL else "integer"
            message = (
                f"every change of the {what} `{variable.part.name}` reaches a deadband of {place.deadband:g}"
            )
            hint = "remove it" if variable.kind is ValueKind.BOOL else "remove it, or use one above 1"
            yield rule.at(variable.part.key_at("mqtt", "deadband"), message, hint=hint)
        elif place.deadband and variable.kind is ValueKind.BOOL:
            message = (
                f"`{variable.part.name}` is a bit, whose changes never reach a deadband of {place.deadband:g}"
            )
            yield rule.at(variable.part.key_at("mqtt", "deadband"), message, hint="remove it")
