"""Rules GW504 and GW505: the addresses by which writers are known."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.modbus_server.plan import Network, network_text
from gatewayd.links.modbus_server.sections import ModbusWriter
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule, Severity
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.model import WriterSpec
from gatewayd.mapping.rules.registry import cell_rule


@cell_rule("GW504")
def same_peer(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two writers with the same address."""
    first: dict[Network, tuple[Part[WriterSpec], Position]] = {}
    for writer, network, position in _peers(cell.document):
        if network not in first:
            first[network] = writer, position
            continue
        other, place = first[network]
        whom = "the writer itself" if other is writer else f"the writer `{other.name}`"
        message = f"{network_text(network)} of the writer `{writer.name}` already stands for {whom}"
        related = (Related(place, f"{network_text(network)} first used here"),)
        hint = "give each writer its own address, or make one writer of the two"
        yield rule.at(position, message, hint=hint, related=related)


@cell_rule("GW505", Severity.WARNING)
def overlapping_peers(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """The network of one writer holds the address of another."""
    holders: dict[Network, tuple[Part[WriterSpec], Position]] = {}
    peers = list(_peers(cell.document))
    for writer, network, position in peers:
        holders.setdefault(network, (writer, position))
    lengths = sorted({network.prefixlen for network in holders}, reverse=True)
    for writer, network, position in peers:
        for length in lengths:
            if length >= network.prefixlen:
                continue
            holder = holders.get(network.supernet(new_prefix=length))
            if holder is not None and holder[0] is not writer:
                wide = network.supernet(new_prefix=length)
                message = (
                    f"{network_text(network)} of the writer `{writer.name}` lies in {wide} of `{holder[0].name}`; "
                    f"it counts as `{writer.name}`"
                )
                related = (Related(holder[1], f"{wide} of `{holder[0].name}`"),)
                hint = "write networks that do not overlap"
                yield rule.at(position, message, hint=hint, related=related)
                break


def _peers(document: Document) -> Iterator[tuple[Part[WriterSpec], Network, Position]]:
    for writer in document.writers.values():
        if writer.spec.by(ModbusWriter).role is not None:
            continue  # known by that: GW237
        for index, network in enumerate(writer.spec.by(ModbusWriter).modbus):
            yield writer, network, writer.at("modbus", index)
