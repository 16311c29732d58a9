"""Rules GW862 to GW864, GW866 and GW867: connections to brokers, and what several cells have of one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from ipaddress import ip_address

from gatewayd.links.mqtt.expand import section_of
from gatewayd.links.mqtt.language import client_of
from gatewayd.links.mqtt.sections import MqttSection
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule, plant_rule
from gatewayd.mqtt.messages import DEFAULT_PORT, DEFAULT_TLS_PORT

_CONNECTION = ("version", "tls", "username", "password_file", "keepalive")
"""Keys that cells of one connection must agree on."""


@plant_rule("GW862")
def topics_of_two_cells(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells with the same topic, or one inside the other, at one broker."""
    known: list[tuple[str, Part[MqttSection]]] = []
    for cell, part in _sections(cells):
        topic = part.spec.topic
        if topic is None:
            continue
        for name, other in known:
            if _server(part.spec) == _server(other.spec) and _touch(topic, other.spec.topic or ""):
                message = f"the topic `{topic}` meets that of the cell `{name}`, `{other.spec.topic}`"
                related = (Related(other.at("topic"), f"topic of `{name}`"),)
                hint = f"end each with the name of its cell: {topic}/{cell.document.cell}"
                yield rule.at(part.at("topic"), message, hint=hint, related=related)
        known.append((cell.document.cell, part))


@plant_rule("GW863")
def client_twice(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """One client identifier for two connections to one broker."""
    known: dict[tuple[object, str], tuple[str, Part[MqttSection]]] = {}
    for cell, part in _sections(cells):
        client = client_of(part.spec, cell.document.cell)
        name, other = known.setdefault((_server(part.spec), client), (cell.document.cell, part))
        if other is not part and not _one_node(part.spec, other.spec):
            message = f"the client `{client}` is used by the cell `{name}` as well"
            related = (Related(other.at("client"), f"client of `{name}`"),)
            hint = f"write `client: gatewayd-{cell.document.cell}`, or leave the key out"
            yield rule.at(part.at("client"), message, hint=hint, related=related)


@cell_rule("GW864", Severity.WARNING)
def password_in_the_clear(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A password that goes over the network unencrypted."""
    part = section_of(cell.document)
    if (
        part is None
        or not part.spec.password_file
        or part.spec.tls is not None
        or is_loopback(part.spec.host)
    ):
        return
    message = f"the password of `{part.spec.username}` goes to {part.spec.host} unencrypted"
    yield rule.at(part.key_at("password_file"), message, hint="add `tls: {ca: /etc/gatewayd/broker-ca.pem}`")


@plant_rule("GW866")
def node_settings_differ(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Cells of one edge node that would have different connections."""
    for name, other, part in _companions(cells):
        for key in (*_CONNECTION, "sparkplug"):
            mine, others = _setting(part.spec, key), _setting(other.spec, key)
            if mine != others:
                written = "sparkplug.primary_host" if key == "sparkplug" else key
                message = (
                    f"`{written}` is not that of the cell `{name}`, which is a device of the same edge node"
                )
                related = (Related(other.at(key), f"`{written}` of `{name}`"),)
                hint = "write the same in both files: an edge node has one connection"
                yield rule.at(part.at(key), message, hint=hint, related=related)


@plant_rule("GW867")
def device_twice(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells that are the same device of an edge node."""
    known: dict[tuple[object, str, str, str], tuple[str, Part[MqttSection]]] = {}
    for cell, part in _sections(cells):
        sparkplug = part.spec.sparkplug
        if sparkplug is None:
            continue
        device = sparkplug.device or cell.document.cell
        key = (_server(part.spec), sparkplug.group, sparkplug.node, device)
        name, other = known.setdefault(key, (cell.document.cell, part))
        if other is not part:
            message = f"the device `{device}` is the cell `{name}` already"
            related = (Related(other.at("sparkplug"), f"device of `{name}`"),)
            hint = f"write `device: {cell.document.cell}`, or leave the key out"
            yield rule.at(part.at("sparkplug", "device"), message, hint=hint, related=related)


def is_loopback(host: str) -> bool:
    """Whether what is said to the host stays in this machine."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _sections(cells: Sequence[ExpandedCell]) -> Iterator[tuple[ExpandedCell, Part[MqttSection]]]:
    for cell in cells:
        part = section_of(cell.document)
        if part is not None:
            yield cell, part


def _companions(
    cells: Sequence[ExpandedCell],
) -> Iterator[tuple[str, Part[MqttSection], Part[MqttSection]]]:
    """Cells of one edge node: the name and section of the first, and the section of each other one."""
    known: dict[tuple[object, str], tuple[str, Part[MqttSection]]] = {}
    for cell, part in _sections(cells):
        if part.spec.sparkplug is None:
            continue
        key = (_server(part.spec), client_of(part.spec, cell.document.cell))
        name, other = known.setdefault(key, (cell.document.cell, part))
        if other is not part and _one_node(part.spec, other.spec):
            yield name, other, part


def _server(section: MqttSection) -> tuple[str, int]:
    default = DEFAULT_PORT if section.tls is None else DEFAULT_TLS_PORT
    return section.host, section.port or default


def _one_node(section: MqttSection, other: MqttSection) -> bool:
    mine, others = section.sparkplug, other.sparkplug
    return mine is not None and others is not None and (mine.group, mine.node) == (others.group, others.node)


def _setting(section: MqttSection, key: str) -> object:
    """What has to be the same, in a form that can be compared."""
    if key == "sparkplug":
        return section.sparkplug.primary_host if section.sparkplug is not None else None
    if key == "tls":
        tls = section.tls
        return None if tls is None else (tls.ca, tls.certificate, tls.key)
    found: object = getattr(section, key)
    return found


def _touch(topic: str, other: str) -> bool:
    return topic == other or topic.startswith(f"{other}/") or other.startswith(f"{topic}/")
