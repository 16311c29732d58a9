"""Rules GW869 to GW872: who commands by MQTT, and what such a command can do."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.mqtt.expand import publications_of, section_of, writers_of
from gatewayd.links.mqtt.rules.broker import is_loopback
from gatewayd.links.mqtt.sections import HOSTS
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.model import WriterSpec
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.mapping.rules.writers import ways_of


@cell_rule("GW869")
def command_topic_twice(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two writers that command by the same topic."""
    section = section_of(cell.document)
    is_sparkplug = section is not None and section.spec.sparkplug is not None
    known: dict[str, Part[WriterSpec]] = {}
    for _index, part, name in writers_of(cell.document):
        # By Sparkplug all commands for a device have one topic, whichever host sends them.
        other = known.setdefault("" if is_sparkplug else name, part)
        if other is not part:
            message = f"`{part.name}` commands by `{name}`, and so does `{other.name}`"
            related = (Related(other.at("mqtt"), f"`{other.name}` is here"),)
            hint = "a message says nobody's name: give each writer a topic of its own"
            yield rule.at(part.at("mqtt"), message, hint=hint, related=related)


@cell_rule("GW870")
def writer_of_other_dialect(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A writer by topic in a Sparkplug cell, or by a host that there is not."""
    section = section_of(cell.document)
    if section is None:
        return
    sparkplug, words = section.spec.sparkplug, " or ".join(f"`mqtt: {word}`" for word in HOSTS)
    for _index, part, name in writers_of(cell.document):
        if sparkplug is not None and name not in HOSTS:
            message = (
                f"`{part.name}` commands by the topic `{name}`; by Sparkplug the topics of commands are given"
            )
            yield rule.at(part.at("mqtt"), message, hint=f"write {words}")
        elif sparkplug is None and name in HOSTS:
            message = f"`{part.name}` is a host of Sparkplug, and this cell says its values as JSON"
            yield rule.at(
                part.at("mqtt"), message, hint="write the topic of its commands, for example `mqtt: set`"
            )
        elif sparkplug is not None and HOSTS[name] and sparkplug.primary_host is None:
            message = f"`{part.name}` is the primary host, and the section `mqtt` names none"
            hint = "add `primary_host: NAME` to `sparkplug`, or write `mqtt: any_host, timeout: 5s`"
            yield rule.at(part.at("mqtt"), message, hint=hint)


@cell_rule("GW871", Severity.WARNING)
def command_by_anybody(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Commands by a broker in the network to which the gateway connects unencrypted."""
    section = section_of(cell.document)
    if section is None or section.spec.tls is not None or is_loopback(section.spec.host):
        return
    for _index, part, _name in writers_of(cell.document):
        message = f"`{part.name}` commands by {section.spec.host}, and the connection there is not encrypted"
        hint = "add `tls: {ca: FILE}`, and let the broker allow its topic to nobody else"
        yield rule.at(part.key_at("mqtt"), message, hint=hint)


@cell_rule("GW872")
def owner_without_name(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An input that its owner by MQTT cannot name."""
    if section_of(cell.document) is None:
        return
    named = {each.variable.index for each in publications_of(cell)}
    commanding = {part.name: part for _index, part, _name in writers_of(cell.document)}
    seen: set[str] = set()
    for lock in cell.locks:
        owner = next((name for name in lock.owners if name in commanding), None)
        if owner is None or lock.is_any or ways_of(commanding[owner].spec) != {"MQTT"}:
            continue
        for index in lock.members:
            variable = cell.variables[index]
            if index not in named and variable.part.name not in seen:
                seen.add(variable.part.name)
                message = (
                    f"`{variable.part.name}` belongs to `{owner}`, who commands by MQTT, where it has no name"
                )
                hint = "give it one (`mqtt: NAME`), or name other owners"
                yield rule.at(variable.position, message, hint=hint)
