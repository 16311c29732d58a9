"""MQTT's part of the mapping language."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar, Final

from gatewayd.links.language import LinkLanguage
from gatewayd.links.mqtt.declaration import KIND
from gatewayd.links.mqtt.expand import ExpandedMqtt, expand_mqtt, publications_of, section_of, writers_of
from gatewayd.links.mqtt.plan import MqttPlan, Publication, SparkplugPlan
from gatewayd.links.mqtt.sections import (
    HOSTS,
    MqttPlaces,
    MqttPlaceSpec,
    MqttSection,
    MqttStore,
    MqttTls,
    MqttWriter,
    SparkplugSection,
)
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.model import VariableSpec, WriterSpec
from gatewayd.mapping.section import Section
from gatewayd.mqtt.messages import DEFAULT_PORT, DEFAULT_TLS_PORT, BrokerTlsFiles


class MqttLanguage(LinkLanguage):
    """Section `mqtt`, and the key `mqtt` of variables and writers.

    Its writers give no commands (`commands` is False): a message may come late, and names nobody who sent it.
    """

    key = KIND.key
    section = MqttSection
    meaning = "a broker of MQTT, which gets the values of the cell and may command it"
    variable_keys = MqttPlaces
    writer_keys = MqttWriter
    rules = tuple(f"gatewayd.links.mqtt.rules.{name}" for name in ("names", "broker", "commands"))
    tables = "gatewayd.links.mqtt.tables"
    nested: ClassVar[Mapping[tuple[type[Section], str], type[Section]]] = {
        (MqttSection, "tls"): MqttTls,
        (MqttSection, "store"): MqttStore,
        (MqttSection, "sparkplug"): SparkplugSection,
        (VariableSpec, "mqtt"): MqttPlaceSpec,
    }
    articles: ClassVar[Mapping[type[Section], str]] = {
        MqttSection: "the section `mqtt`",
        MqttTls: "`tls` of the broker",
        MqttStore: "`store` of the broker",
        SparkplugSection: "`sparkplug`",
        MqttPlaceSpec: "`mqtt` of a variable",
    }
    places = (MqttPlaceSpec,)
    telling_keys = ("topic", "sparkplug", "keepalive", "retain")
    elsewhere: ClassVar[Mapping[tuple[type[Section], str], str]] = {
        (
            MqttSection,
            "password",
        ): "a mapping holds no secrets: write it into a file, and `password_file: FILE`",
        **{(MqttSection, key): f"`{key}` belongs to the writer" for key in ("timeout", "grace")},
    }
    way = "MQTT"
    writer_example = "mqtt: set"
    supervision_example = "timeout: 5s"
    place_example = "mqtt: NAME"
    lost_by = "a writer by MQTT has no connection of its own: it is lost with the broker at once"

    def knows(self, writer: WriterSpec) -> bool:
        """Whether it has a topic."""
        return writer.by(MqttWriter).mqtt is not None

    def names(self, writer: WriterSpec) -> Sequence[str]:
        """Its topic, or which host it is."""
        name = writer.by(MqttWriter).mqtt
        return () if name is None else (f"MQTT {name}",)

    def supervises(self, writer: WriterSpec) -> bool:
        """A primary host says whether it is there; who sends to a topic says nothing."""
        return HOSTS.get(writer.by(MqttWriter).mqtt or "", False)

    def places_of(self, line: Part[VariableSpec], document: Document) -> bool:
        """Whether it is published, or may be by a section that cannot be read."""
        section, place = section_of(document), line.spec.by(MqttPlaces).mqtt
        if section is None:
            return (place is not None and place.publish) or document.has(KIND.key)
        return section.spec.publish == "all" if place is None else place.publish

    def writes_whole(
        self, writer: WriterSpec, variables: Sequence[ExpandedVariable], cell: ExpandedCell
    ) -> bool:
        """A command may name them all."""
        known = {each.variable.index for each in publications_of(cell)}
        return self.knows(writer) and all(variable.index in known for variable in variables)

    def without_effect(self, document: Document) -> Iterable[tuple[Position, str, str]]:
        """Keys that belong to the other way of saying values."""
        section = section_of(document)
        if section is None:
            return
        if section.spec.sparkplug is not None:
            for key in ("every", "retain"):
                if key in section.spec.model_fields_set:
                    message = (
                        f"`{key}` is for values as JSON; Sparkplug says itself what is sent again, and how"
                    )
                    yield section.key_at(key), message, "remove it"
        if section.spec.store.keep is None and "size" in section.spec.store.model_fields_set:
            yield section.key_at("store", "size"), "nothing is kept: `keep: none`", "remove `size`"

    def expand(self, document: Document, variables: Sequence[ExpandedVariable]) -> ExpandedMqtt | None:
        """What is published."""
        return expand_mqtt(document, variables)

    def compile(self, cell: ExpandedCell) -> MqttPlan:
        """One cell at one broker."""
        part = section_of(cell.document)
        assert part is not None
        section, sparkplug = part.spec, _sparkplug(part.spec, cell.document.cell)
        return MqttPlan(
            host=section.host,
            port=section.port or (DEFAULT_PORT if section.tls is None else DEFAULT_TLS_PORT),
            client=client_of(section, cell.document.cell),
            publications=tuple(
                Publication(each.variable.index, each.name, each.deadband, each.interval)
                for each in publications_of(cell)
            ),
            writers=tuple((name, index) for index, _part, name in writers_of(cell.document)),
            topic=section.topic or "",
            sparkplug=sparkplug,
            version=section.version,
            keepalive=round(section.keepalive),
            username=section.username,
            password_file=section.password_file,
            tls=None
            if section.tls is None
            else BrokerTlsFiles(section.tls.ca, section.tls.certificate, section.tls.key),
            every=section.every,
            retain=section.retain,
            keep=section.store.keep,
            size=section.store.size,
        )


def client_of(section: MqttSection, cell: str) -> str:
    """The client identifier: of an edge node what it is called, so that its cells have the same."""
    if section.client is not None:
        return section.client
    sparkplug = section.sparkplug
    return f"gatewayd-{cell}" if sparkplug is None else f"gatewayd-{sparkplug.group}-{sparkplug.node}"


def _sparkplug(section: MqttSection, cell: str) -> SparkplugPlan | None:
    found = section.sparkplug
    if found is None:
        return None
    return SparkplugPlan(found.group, found.node, found.device or cell, found.primary_host or "")


LANGUAGE: Final = MqttLanguage()
