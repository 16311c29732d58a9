"""Rules GW407, GW408, GW426 to GW429 and GW436: what the cells on one CAN bus, or in one engineering tool, share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from math import ceil

from gatewayd.canopen.cob_ids import Function, is_restricted
from gatewayd.canopen.load import ERROR_ABOVE, WARNING_ABOVE, Share, load
from gatewayd.core.definition import Direction
from gatewayd.links.canopen_node.bus_load import FIRST_EVENT_TYPE, bus_shares, pdo_bits
from gatewayd.links.canopen_node.expand import CanopenCell, node_of, the_node
from gatewayd.links.canopen_node.rules.pdos import cob_id_place
from gatewayd.links.canopen_node.rules.registry import first_at_each_place
from gatewayd.links.canopen_node.sections import Canopen
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import plant_rule
from gatewayd.report.wording import cob


@plant_rule("GW407")
@first_at_each_place
def bus_cob_id_clash(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells on one bus that send with the same COB-ID."""
    for nodes in _nodes(cells):
        used: dict[int, tuple[CanopenCell, str, Position]] = {}
        for node in nodes:
            number = node.part.spec.node
            used.setdefault(Function.EMCY + number, (node, f"EMCY of node {number}", node.part.at("node")))
        for node in nodes:
            for pdo in node.pdos:
                own = pdo.slot.cob_id
                if pdo.direction is Direction.INPUT or own is None or is_restricted(own):
                    continue
                place = cob_id_place(node, pdo)
                what = f"{pdo.label} of node {node.part.spec.node}"
                other, known, where = used.setdefault(own, (node, what, place))
                # Equal node-IDs have a rule of their own, and within a cell GW405 looks.
                if other is node or other.part.spec.node == node.part.spec.node:
                    continue
                related = (Related(where, f"{known} is {cob(own)}"),)
                message = f"{pdo.label} has the COB-ID {cob(own)}, which is {known} on the same bus"
                yield rule.at(place, message, hint="choose another COB-ID", related=related)


@plant_rule("GW408")
def node_id_clash(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells with the same node-ID on one bus."""
    for node, other in _same(cells, lambda spec: spec.node):
        spec = node.part.spec
        message = f"node {spec.node} on {spec.channel} already belongs to another cell"
        related = (Related(other.part.at("node"), f"node {spec.node} first used here"),)
        hint = "give each cell its own node-ID, 1 to 127"
        yield rule.at(node.part.at("node"), message, hint=hint, related=related)


@plant_rule("GW428")
def bit_rate_clash(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells on one bus with different bit-rates."""
    for first, *others in _nodes(cells):
        for node in others:
            spec, other = node.part.spec, first.part.spec
            if spec.bitrate != other.bitrate:
                message = (
                    f"{spec.channel} has {spec.bitrate} bit/s here and {other.bitrate} bit/s in another cell"
                )
                related = (Related(first.part.at("bitrate"), f"{other.bitrate} bit/s is here"),)
                hint = "write the bit-rate of the bus in both files"
                yield rule.at(node.part.at("bitrate"), message, hint=hint, related=related)


@plant_rule("GW436", Severity.WARNING)
def same_device(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells with different objects that an engineering tool takes for one device."""
    known: dict[tuple[object, ...], CanopenCell] = {}
    for node in chain.from_iterable(_nodes(cells)):
        identity = node.part.spec.identity
        if identity.revision == "auto":
            continue
        key = (identity.vendor, identity.product, identity.revision)
        first = known.setdefault(key, node)
        if [placed.plan for placed in node.objects] == [placed.plan for placed in first.objects]:
            continue
        message = (
            f"the data sheets of this cell and of another one describe the same device (product "
            f"0x{identity.product:X}) with different objects: an engineering tool replaces one with the other"
        )
        hint = "write `identity: {product: 2}` with a number of its own for each, or `identity: {revision: auto}`"
        related = (Related(first.part.at("identity", "product"), "the other cell is here"),)
        yield rule.at(node.part.at("identity", "product"), message, hint=hint, related=related)


@plant_rule("GW429")
def two_sync_producers(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells that send the same SYNC."""
    for node, other in _same(cells, lambda spec: spec.sync.cob_id if spec.sync.producer else None):
        spec = node.part.spec
        message = f"another cell on {spec.channel} sends SYNC ({cob(spec.sync.cob_id)}) already"
        related = (Related(other.part.at("sync", "producer"), "the other producer is here"),)
        hint = "remove `producer` in one of the two files"
        yield rule.at(node.part.at("sync", "producer"), message, hint=hint, related=related)


@plant_rule("GW426", Severity.WARNING)
def bus_load_high(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """A bus whose load can exceed 40 %."""
    yield from _loaded(rule, cells, lambda share: WARNING_ABOVE < share <= ERROR_ABOVE)


@plant_rule("GW427")
def bus_load_too_high(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """A bus whose load can exceed 70 %."""
    yield from _loaded(rule, cells, lambda share: share > ERROR_ABOVE)


def _loaded(
    rule: Rule, cells: Sequence[ExpandedCell], is_meant: Callable[[float], bool]
) -> Iterator[Diagnostic]:
    for bus in _buses(cells):
        shares = bus_shares(bus)
        part = the_node(bus[0]).part
        channel, bit_rate = part.spec.channel, part.spec.bitrate
        share = load(shares, bit_rate)
        if not is_meant(share):
            continue
        most = max(shares, key=lambda share: share.bits_per_second)
        others = "" if len(bus) == 1 else f" from {len(bus)} cells"
        message = (
            f"the load of {channel} can reach {share:.0%} of {bit_rate} bit/s{others}, "
            f"most of it from {most.what} ({most.rate:.4g} frames/s, {load([most], bit_rate):.1%})"
        )
        yield rule.at(part.at("bitrate"), message, hint=_remedy(bus, shares, bit_rate))


def _remedy(bus: Sequence[ExpandedCell], shares: Sequence[Share], bit_rate: int) -> str:
    """The inhibit time that brings all event-driven PDOs below the warning, if one does."""
    events = {
        f"node {node.part.spec.node}: {pdo.label}": pdo_bits(pdo)
        for node in map(the_node, bus)
        for pdo in node.pdos
        if pdo.transmission >= FIRST_EVENT_TYPE
    }
    rest = load([share for share in shares if share.what not in events], bit_rate)
    room = (WARNING_ABOVE - rest) * bit_rate
    if events and room > 0:
        milliseconds = ceil(1000 * sum(events.values()) / room)
        if milliseconds <= 1000:
            return f"`pdo: {{inhibit: {milliseconds}ms}}` for all event-driven PDOs brings it to 40 %"
    return "use a slower SYNC, REAL32, fewer variables in PDOs, or a higher bit-rate"


def _same(
    cells: Sequence[ExpandedCell], key: Callable[[Canopen], int | None]
) -> Iterator[tuple[CanopenCell, CanopenCell]]:
    """Each node with the first one on its bus that has the same key; None is the same as nothing."""
    for nodes in _nodes(cells):
        first: dict[int, CanopenCell] = {}
        for node in nodes:
            found = key(node.part.spec)
            if found is not None and first.setdefault(found, node) is not node:
                yield node, first[found]


def _buses(cells: Sequence[ExpandedCell]) -> Iterator[list[ExpandedCell]]:
    """The cells with a node on each bus, in the order of the files."""
    buses: dict[tuple[str, str], list[ExpandedCell]] = {}
    for cell in cells:
        node = node_of(cell)
        if node is not None:
            spec = node.part.spec
            buses.setdefault((spec.interface, spec.channel), []).append(cell)
    yield from buses.values()


def _nodes(cells: Sequence[ExpandedCell]) -> Iterator[list[CanopenCell]]:
    """The nodes on each bus."""
    return ([the_node(cell) for cell in bus] for bus in _buses(cells))
