"""Rules GW402 to GW406, GW409, GW416 to GW419 and GW431: PDOs and their COB-IDs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

from gatewayd.canopen.cob_ids import Function, is_restricted
from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import Direction
from gatewayd.links.canopen_node.bus_load import FIRST_EVENT_TYPE
from gatewayd.links.canopen_node.expand import CanopenCell, ExpandedPdo
from gatewayd.links.canopen_node.pdo_layout import PDO_BITS, PDO_NUMBERS
from gatewayd.links.canopen_node.rules.registry import first_at_each_place, node_rule
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.report.format import verb
from gatewayd.report.wording import cob, seconds

_UNUSED = range(0x680, 0x6E0)
"""Identifiers that no predefined service of any node has."""
_HIGH_NODES = (range(0x1C0, 0x200), range(0x2C0, 0x300), range(0x3C0, 0x400), range(0x4C0, 0x500))
"""PDOs of node-IDs from 64 on, which small networks do not have."""
_KEYS = {Direction.INPUT: "rpdo", Direction.OUTPUT: "tpdo"}
_WORDS = {Direction.INPUT: "towards the robot", Direction.OUTPUT: "from the robot"}


@node_rule("GW402")
def pdo_too_long(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A PDO with more than 64 bits."""
    for pdo in _declared(node):
        if pdo.bits > PDO_BITS:
            name = next(name for name, end in _contents(cell, pdo) if end > PDO_BITS)
            message = f"the PDO `{pdo.name}` has {pdo.bits} bits, but a PDO carries {PDO_BITS}; `{name}` does not fit"
            hint = f"move `{name}` and what follows it to another PDO"
            yield rule.at(pdo.position, message, hint=hint)


@node_rule("GW403")
def pdo_misaligned(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A number in a PDO that does not begin at a byte."""
    for pdo in _declared(node):
        for offset, entry in pdo.offsets:
            if entry.plan.type is not CanType.BOOLEAN and offset % 8:
                name = cell.variables[entry.variable].name
                message = f"`{name}` ({entry.plan.type.name}) begins at bit {offset} of the PDO `{pdo.name}`"
                hint = "put the numbers before the bits"
                yield rule.at(pdo.position, message, hint=hint)
                break


@node_rule("GW404")
def mixed_pdo(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A PDO with variables of both directions."""
    for pdo in _declared(node):
        other = next((entry for entry in pdo.entries if entry.direction is not pdo.direction), None)
        if other is not None:
            name = cell.variables[other.variable].name
            first = pdo.status[0].name if pdo.status else cell.variables[pdo.entries[0].variable].name
            message = (
                f"the PDO `{pdo.name}` carries `{first}` {_WORDS[pdo.direction]} "
                f"and `{name}` {_WORDS[other.direction]}"
            )
            yield rule.at(pdo.position, message, hint=f"make a PDO of its own for `{name}`")


@dataclass(frozen=True, slots=True)
class _Use:
    cob_id: int
    what: str
    place: Position


@node_rule("GW405")
@first_at_each_place
def cob_id_clash(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """One COB-ID for two services of the node."""
    used = {use.cob_id: use for use in _services(node)}
    sync = node.part.spec.sync
    if not is_restricted(sync.cob_id):
        place = node.part.at("sync", "cob_id")
        yield from _clash(rule, used, _Use(sync.cob_id, "SYNC", place))
    for pdo in node.pdos:
        if pdo.slot.cob_id is not None and not is_restricted(pdo.slot.cob_id):
            yield from _clash(rule, used, _Use(pdo.slot.cob_id, pdo.label, cob_id_place(node, pdo)))


def _clash(rule: Rule, used: dict[int, _Use], use: _Use) -> Iterator[Diagnostic]:
    other = used.setdefault(use.cob_id, use)
    if other is not use:
        message = f"{use.what} has the COB-ID {cob(use.cob_id)}, which is {other.what}"
        related = (Related(other.place, f"{other.what} is {cob(use.cob_id)}"),)
        yield rule.at(use.place, message, hint="choose another COB-ID, such as 0x680", related=related)


def _services(node: CanopenCell) -> Iterator[_Use]:
    """What a node has without being asked, as far as it is not restricted."""
    place, number = node.part.at("node"), node.part.spec.node
    yield _Use(Function.EMCY + number, f"EMCY of node {number}", place)
    yield _Use(Function.TIME, "TIME", place)


@node_rule("GW406")
def restricted_cob_id(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A COB-ID that no PDO and no SYNC may have."""
    spec, part = node.part.spec, node.part
    hint = "use one of a node-ID that does not exist, such as 0x1C0, or one from 0x680 to 0x6DF"
    written = [(spec.sync.cob_id, "SYNC", part.at("sync", "cob_id"))]
    written += [
        (pdo.cob_id, f"the PDO `{name}`", part.at("pdos", name, "cob_id"))
        for name, pdo in spec.pdos.items()
        if pdo.cob_id is not None
    ]
    for key, ranges in (("tpdo", spec.cob_ids.tpdo), ("rpdo", spec.cob_ids.rpdo)):
        for position, cob_ids in enumerate(ranges):
            first = next((cob_id for cob_id in cob_ids if is_restricted(cob_id)), None)
            if first is not None:
                written.append((first, f"`{key}`", part.at("cob_ids", key, position)))
    for cob_id, what, place in written:
        if is_restricted(cob_id):
            yield rule.at(place, f"{what} has the COB-ID {cob(cob_id)}, which is reserved", hint=hint)


@node_rule("GW409")
def too_few_cob_ids(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """More PDOs than COB-IDs."""
    used = {pdo.slot.cob_id for pdo in node.pdos if pdo.slot.cob_id is not None}
    used |= {use.cob_id for use in _services(node)} | {node.part.spec.sync.cob_id}
    for direction, key in reversed(_KEYS.items()):
        pdos = [pdo for pdo in node.pdos if pdo.direction is direction]
        missing = sum(pdo.slot.cob_id is None or pdo.slot.number > PDO_NUMBERS for pdo in pdos)
        if not missing:
            continue
        proposal = _proposal(missing, used)
        used |= set(proposal)
        declared = getattr(node.part.spec.cob_ids, key)
        total = sum(map(len, declared)) or "none"
        message = (
            f"{missing} of {len(pdos)} PDOs {_WORDS[direction]} {verb('have', count=missing)} no COB-ID: "
            f"four are predefined, and {total} declared"
        )
        hint = "use REAL32, or keep variables out of PDOs with `canopen: object`"
        if len(proposal) == missing:
            spans = _spans([*chain.from_iterable(declared), *proposal])
            hint = f"add `cob_ids: {{{key}: {spans}}}` if nobody else uses them"
        place = node.part.at("cob_ids", key) if declared else node.part.key
        yield rule.at(place, message, hint=hint)


def _proposal(count: int, used: set[int]) -> list[int]:
    """So many identifiers that nothing predefined is likely to have."""
    free = [cob_id for span in (_UNUSED, *_HIGH_NODES) for cob_id in span if cob_id not in used]
    return free[:count]


def _spans(cob_ids: list[int]) -> str:
    """Identifiers as the file writes them: `0x680..0x68F`, a list of such where there are gaps."""
    spans: list[list[int]] = []
    for cob_id in cob_ids:
        if spans and cob_id == spans[-1][1] + 1:
            spans[-1][1] = cob_id
        else:
            spans.append([cob_id, cob_id])
    texts = [cob(first) if first == last else f"{cob(first)}..{cob(last)}" for first, last in spans]
    return texts[0] if len(texts) == 1 else f"[{', '.join(texts)}]"


@node_rule("GW431")
def pdo_key_of_other_side(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A key of a PDO that means nothing in its direction."""
    for pdo in _declared(node):
        receives = pdo.direction is Direction.INPUT
        written = node.part.spec.pdos[pdo.name].model_fields_set
        wrong, right = ("event", "deadline") if receives else ("deadline", "event")
        if wrong in written:
            verb = "goes" if receives else "comes"
            message = f"the PDO `{pdo.name}` {verb} {_WORDS[pdo.direction]} and has `{wrong}`"
            place = node.part.key_at("pdos", pdo.name, wrong)
            yield rule.at(place, message, hint=f"write `{right}`, or remove it")
        if "sync_start" in written and (receives or not 0 < pdo.transmission < FIRST_EVENT_TYPE):
            message = f"the PDO `{pdo.name}` has `sync_start` and is not sent with every n-th SYNC"
            place = node.part.key_at("pdos", pdo.name, "sync_start")
            yield rule.at(place, message, hint="remove `sync_start`, or write `transmission: sync`")


@node_rule("GW416", Severity.WARNING)
def sync_without_period(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """Synchronous PDOs without a period of SYNC."""
    if node.part.spec.sync.period is not None:
        return
    pdo = next((pdo for pdo in node.pdos if pdo.transmission < FIRST_EVENT_TYPE), None)
    if pdo is not None:
        message = f"{pdo.label} is synchronous (type {pdo.transmission}), but the period of SYNC is not known"
        hint = "add `sync: {period: 10ms}`, with `producer: true` if no other node sends SYNC"
        yield rule.at(_key_place(node, pdo, "transmission"), message, hint=hint)


@node_rule("GW417")
def producer_without_period(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A SYNC producer without a period."""
    if node.part.spec.sync.producer and node.part.spec.sync.period is None:
        message = f"node {node.part.spec.node} is a SYNC producer without a period"
        yield rule.at(node.part.at("sync", "producer"), message, hint="add `period: 10ms` to `sync`")


@node_rule("GW419", Severity.WARNING)
@first_at_each_place
def event_below_inhibit(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """An event time shorter than the inhibit time."""
    for pdo in node.pdos:
        if pdo.direction is Direction.INPUT or pdo.transmission < FIRST_EVENT_TYPE:
            continue
        if pdo.event is None or pdo.inhibit is None or pdo.event >= pdo.inhibit:
            continue
        message = (
            f"the event time of {pdo.label}, {seconds(pdo.event)}, is shorter than its inhibit time, "
            f"{seconds(pdo.inhibit)}"
        )
        hint = "make the event time several times as long as the inhibit time"
        yield rule.at(_key_place(node, pdo, "event"), message, hint=hint)


def cob_id_place(node: CanopenCell, pdo: ExpandedPdo) -> Position:
    """Where the file gives a PDO its COB-ID: at the PDO, among the declared ones, or by the node-ID."""
    if pdo.name and node.part.spec.pdos[pdo.name].cob_id is not None:
        return node.part.at("pdos", pdo.name, "cob_id")
    if pdo.slot.predefined:
        return node.part.at("node")
    key = _KEYS[pdo.direction]
    for position, cob_ids in enumerate(getattr(node.part.spec.cob_ids, key)):
        if pdo.slot.cob_id in cob_ids:
            return node.part.at("cob_ids", key, position)
    return node.part.key


def _key_place(node: CanopenCell, pdo: ExpandedPdo, key: str) -> Position:
    """Where a key of a PDO is written: at the PDO, or among the defaults."""
    if pdo.name and key in node.part.spec.pdos[pdo.name].model_fields_set:
        return node.part.at("pdos", pdo.name, key)
    return node.part.at("pdo", key)


def _declared(node: CanopenCell) -> Iterator[ExpandedPdo]:
    """The PDOs of the file; those of the automatic layout have none of these mistakes."""
    return (pdo for pdo in node.pdos if pdo.name)


def _contents(cell: ExpandedCell, pdo: ExpandedPdo) -> Iterator[tuple[str, int]]:
    """The name of everything in a PDO, and the bit after it."""
    for offset, word in pdo.status_offsets:
        yield word.name, offset + word.type.bits
    for offset, entry in pdo.offsets:
        yield cell.variables[entry.variable].name, offset + entry.plan.type.bits
