"""Rules GW203, GW210, GW212 to GW215, GW220, GW223 and GW226: how variables lie in the unit's areas."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from gatewayd.core.definition import Direction
from gatewayd.core.status_layout import BASE
from gatewayd.links.modbus_places.placing import ExpandedPlacement
from gatewayd.links.modbus_places.rules.wording import AREA_WORDS, first_of_each_line, where
from gatewayd.links.modbus_server.expand import placements_of
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.modbus.areas import MAX_READ_REGISTERS, MAX_WRITE_BITS, MAX_WRITE_REGISTERS, Area

_LAST_ADDRESS = 0xFFFF
_READ_ONLY = (Area.INPUT, Area.DISCRETE)
_MAX_WRITE = {Area.HOLDING: MAX_WRITE_REGISTERS, Area.COIL: MAX_WRITE_BITS}


@cell_rule("GW203")
def status_block(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A variable in the registers of the status block."""
    inside = [
        item
        for item in placements_of(cell)
        if not item.area.of_bits and item.problem is None and item.addresses[-1] >= BASE
    ]
    for placement in first_of_each_line(inside):
        message = (
            f"`{placement.variable.name}` lies at {where(placement)}, "
            f"but registers from {BASE} on are the status block"
        )
        yield rule.at(placement.position, message, hint="place it below 60000")


@cell_rule("GW210")
def input_in_read_only_area(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An input variable that lies only where nobody can write."""
    for _, group in groupby(placements_of(cell), key=lambda item: item.variable.part.name):
        placements = list(group)
        first = placements[0]
        if first.variable.direction is Direction.INPUT and all(
            item.area in _READ_ONLY for item in placements
        ):
            message = (
                f"`{first.variable.name}` is an input of the robot ({first.variable.target}), "
                f"but nobody can write {where(first)}"
            )
            area = "coil" if first.area is Area.DISCRETE else "holding"
            yield rule.at(first.position, message, hint=f"place it in a writable area: {{{area}: N}}")


@cell_rule("GW212", Severity.WARNING)
def split_value(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A value that a client cuts in two when it reads or writes in full blocks."""
    reported: set[tuple[str, int]] = set()
    for area in (Area.HOLDING, Area.INPUT):
        placed = [item for item in placements_of(cell) if item.area is area and item.problem is None]
        inputs = [item for item in placed if item.variable.direction is Direction.INPUT]
        writable = inputs if area is Area.HOLDING else []
        for limit, verb, items in (
            (MAX_READ_REGISTERS, "reads", placed),
            (MAX_WRITE_REGISTERS, "writes", writable),
        ):
            for placement, start, boundary in _cut(items, limit):
                key = placement.variable.part.name, id(placement.spec)
                if key in reported:
                    continue
                reported.add(key)
                message = (
                    f"`{placement.variable.name}` at {where(placement)} is cut in two at {boundary} "
                    f"by a client that {verb} the block from {start} on in requests of {limit} registers"
                )
                hint = f"let it begin at {boundary}, or leave a gap in the block before it"
                yield rule.at(placement.position, message, hint=hint)


def _cut(placements: list[ExpandedPlacement], limit: int) -> Iterator[tuple[ExpandedPlacement, int, int]]:
    """Placements that a boundary cuts, with the start of their block and the boundary."""
    start = end = -1
    for placement in sorted(placements, key=lambda item: item.address):
        if placement.address > end:
            start = placement.address
        end = max(end, placement.address + placement.words)
        block = (placement.address - start) // limit
        if (placement.addresses[-1] - start) // limit != block:
            yield placement, start, start + (block + 1) * limit


@cell_rule("GW213")
def mixed_directions(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A register that mixes bits of both directions."""
    packed = [item for item in placements_of(cell) if item.bit is not None and item.area is Area.HOLDING]
    first: dict[int, ExpandedPlacement] = {}
    reported: set[tuple[str, str]] = set()
    for placement in packed:
        other = first.setdefault(placement.address, placement)
        lines = other.variable.part.name, placement.variable.part.name
        if other.variable.direction is placement.variable.direction or lines in reported:
            continue
        reported.add(lines)
        register = f"{AREA_WORDS[placement.area]} {placement.address}"
        notation = placement.area.notation(placement.address)
        message = (
            f"`{placement.variable.name}` ({placement.variable.direction.value}) shares {register} ({notation}) "
            f"with `{other.variable.name}` ({other.variable.direction.value})"
        )
        related = (Related(other.position, f"`{other.variable.name}`, {where(other)}"),)
        hint = "use one register for inputs and another for outputs"
        yield rule.at(placement.position, message, hint=hint, related=related)


@cell_rule("GW214")
def register_overlap(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two variables at the same place of an area."""
    for later, earlier, count in _overlaps(cell, mixed=False):
        more = f", and {count - 1} more of these lines" if count > 1 else ""
        message = (
            f"`{later.variable.name}` lies at {where(later)}, where `{earlier.variable.name}` lies{more}"
        )
        yield _overlap(rule, cell, later, earlier, message)


@cell_rule("GW215")
def bit_in_number(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A register that holds bits and a number."""
    for later, earlier, _ in _overlaps(cell, mixed=True):
        packed = later if later.bit is not None else earlier
        message = (
            f"`{later.variable.name}` lies at {where(later)}, in the same register as "
            f"`{earlier.variable.name}`: one is a {'bit' if packed.codec is None else 'byte'}, the other a number"
        )
        yield _overlap(rule, cell, later, earlier, message)


@cell_rule("GW223", Severity.WARNING)
def input_twice_in_area(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An input in two places of one area that one request can write."""
    first: dict[tuple[int, Area], ExpandedPlacement] = {}
    reported: set[str] = set()
    for placement in placements_of(cell):
        variable, most = placement.variable, _MAX_WRITE.get(placement.area)
        if variable.direction is Direction.OUTPUT or most is None or variable.part.name in reported:
            continue
        other = first.setdefault((variable.index, placement.area), placement)
        addresses = {*other.addresses, *placement.addresses}
        if other is placement or max(addresses) - min(addresses) >= most:
            continue
        reported.add(variable.part.name)
        message = (
            f"`{variable.name}` can be written at {where(placement)} and at {where(other)}: "
            "a request with two values for it is refused"
        )
        related = (Related(other.position, f"`{variable.name}`, {where(other)}, first placed here"),)
        hint = "leave one of the two, or put one where it is only read: {input: N}"
        yield rule.at(placement.position, message, hint=hint, related=related)


def _overlap(
    rule: Rule, cell: ExpandedCell, later: ExpandedPlacement, earlier: ExpandedPlacement, message: str
) -> Diagnostic:
    first = Related(earlier.position, f"`{earlier.variable.name}`, {where(earlier)}, first used here")
    return rule.at(later.position, message, hint=_room(cell, later), related=(first,))


def _overlaps(
    cell: ExpandedCell, *, mixed: bool
) -> Iterator[tuple[ExpandedPlacement, ExpandedPlacement, int]]:
    """Pairs of lines that overlap: first placement of the later line, what it meets, and how many do.

    A sweep over sorted places, so that a thousand variables cost no more than their sorting.
    """
    pairs: dict[tuple[str, int, str, int], list[tuple[ExpandedPlacement, ExpandedPlacement]]] = {}
    for area in Area:
        placed = [item for item in placements_of(cell) if item.area is area and item.problem is None]
        reach: ExpandedPlacement | None = None
        for placement in sorted(placed, key=_span):
            if reach is not None and _span(placement)[0] < _span(reach)[1]:
                earlier, later = sorted((reach, placement), key=lambda item: item.position)
                if ((earlier.bit is None) != (later.bit is None)) == mixed:
                    key = (*_line(later), *_line(earlier))
                    pairs.setdefault(key, []).append((later, earlier))
            if reach is None or _span(placement)[1] > _span(reach)[1]:
                reach = placement
    for found in pairs.values():
        later, earlier = min(found, key=lambda pair: pair[0].variable.index)
        yield later, earlier, len(found)


def _line(placement: ExpandedPlacement) -> tuple[str, int]:
    return placement.variable.part.name, id(placement.spec)


def _span(placement: ExpandedPlacement) -> tuple[int, int]:
    """First bit and the bit after the last, counting sixteen to an address."""
    start = placement.address * 16
    if placement.bit is not None:
        return start + placement.bit, start + placement.bit + (1 if placement.codec is None else 8)
    return start, start + placement.words * 16


def _room(cell: ExpandedCell, placement: ExpandedPlacement) -> str:
    """Remedy for an overlap: the next addresses of the area where the whole line fits."""
    area = placement.area
    here = [item for item in placements_of(cell) if item.area is area and item.problem is None]
    line = [item for item in here if _line(item) == _line(placement)]
    start = min(item.address for item in line)
    length = max(item.addresses[-1] for item in line) + 1 - start
    end = _LAST_ADDRESS + 1 if area.of_bits else BASE
    others = [item.addresses for item in here if _line(item) != _line(placement)]
    for taken in sorted(others, key=lambda addresses: addresses.start):
        if taken.start >= start + length:
            break
        start = max(start, taken.stop)
    if start + length > end:
        return "shorten one of the two lines, or use another area"
    last = start + length - 1
    if length == 1:
        return f"the line fits at {start} ({area.notation(start)})"
    return f"the line fits at {start} to {last} ({area.notation(start)} to {area.notation(last)})"


@cell_rule("GW220")
def no_modbus_section(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Variables with Modbus addresses in a file without a modbus section."""
    placements = placements_of(cell)
    if not placements or cell.document.has("modbus"):
        return
    first = placements[0]
    message = f"`{first.variable.name}` has a Modbus address, but the file has no section `modbus`"
    yield rule.at(first.position, message, hint="add `modbus: {listen: 127.0.0.1:1502}`")


_OF_INPUTS = frozenset({"owner", "group", "lease", "takeover", "on_release", "limits", "clamp", "deadband"})
"""Keys by which a line shows that an input is meant."""


@cell_rule("GW226", Severity.WARNING)
def input_among_outputs(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An input without an owner, a fallback or limits, placed among outputs."""
    for area in (Area.HOLDING, Area.COIL):
        inside = [item for item in placements_of(cell) if item.area is area and item.problem is None]
        placed = sorted(inside, key=lambda item: (item.addresses.start, item.bit or 0))
        for before, placement, after in zip((None, *placed), placed, (*placed[1:], None), strict=False):
            beside = [item for item in (before, after) if item is not None]
            if (
                placement.variable.direction is Direction.INPUT
                and placement.variable.counterpart
                and not _OF_INPUTS & placement.variable.spec.model_fields_set
                and beside
                and all(item.variable.direction is Direction.OUTPUT for item in beside)
                and any(_adjacent(item, placement) for item in beside)
            ):
                name, target = placement.variable.name, placement.variable.target
                message = (
                    f"`{name}` is written to the robot ({target}), but lies among what the robot reports"
                )
                related = tuple(
                    Related(item.position, f"`{item.variable.name}` is reported") for item in beside
                )
                hint = (
                    f"if the robot reports it, write {placement.variable.counterpart}; else name its `owner`"
                )
                yield rule.at(placement.position, message, hint=hint, related=related)


def _adjacent(placement: ExpandedPlacement, other: ExpandedPlacement) -> bool:
    """Whether no register lies between them."""
    first, second = sorted((placement.addresses, other.addresses), key=lambda addresses: addresses.start)
    return second.start <= first.stop
