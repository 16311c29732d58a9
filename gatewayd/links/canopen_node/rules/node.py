"""Rules GW401, GW413 to GW415, GW420 to GW425, GW432, GW435, GW437 to GW439: node, number types, writers by CANopen."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import Direction, ValueKind
from gatewayd.links.canopen_node.bus_load import BIT_RATES, FIRST_EVENT_TYPE
from gatewayd.links.canopen_node.expand import (
    CanopenCell,
    MappedObject,
    linear_of,
    place_of,
    scale_problem,
    writes_by,
)
from gatewayd.links.canopen_node.plan import ObjectPlan
from gatewayd.links.canopen_node.rules.registry import first_at_each_place, node_rule
from gatewayd.links.canopen_node.sections import CanopenPlaces, CanopenWriter
from gatewayd.links.canopen_values import reach_of
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule, Severity
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.model import WriterSpec
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.mapping.rules.writers import known_by, ways_of, ways_of_variable
from gatewayd.report.format import counted
from gatewayd.report.wording import number, one_and_more, seconds

_REAL32_DIGITS = 2**24
_MIN_STEPS = 10
"""Fewer values of a real are no measure of it."""
_RPDO = "RPDO"


@cell_rule("GW401")
def no_canopen_section(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Variables or writers on CANopen in a file without a canopen section."""
    if cell.document.has("canopen"):
        return
    hint = "add `canopen: {channel: can0, bitrate: 500000, node: 16}`"
    for part in cell.document.variables.values():
        if part.spec.by(CanopenPlaces).canopen is not None:
            message = f"`{part.name}` is on CANopen, but the file has no section `canopen`"
            yield rule.at(part.key_at("canopen"), message, hint=hint)
            return
    for writer, spec in _writers(cell):
        if spec.canopen is not None:
            message = f"the writer `{writer.name}` is on CANopen, but the file has no section `canopen`"
            yield rule.at(writer.key_at("canopen"), message, hint=hint)
            return


@node_rule("GW413")
def canopen_type(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A CANopen type that does not suit the robot's type."""
    for variable, placed in _lines(cell, node):
        place = place_of(variable)
        if not placed.fits and place is not None and scale_problem(variable, linear_of(place)) is None:
            message = f"`{variable.part.name}` ({variable.target}, {variable.type}) cannot be {place.type}"
            hint = f"write {_suited(variable)}, or leave `type` out"
            yield rule.at(variable.at("canopen", "type"), message, hint=hint)


@node_rule("GW438")
def canopen_scale(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A scale that is not possible: 0, or on a bit."""
    for variable, _ in _lines(cell, node):
        problem = scale_problem(variable, linear_of(place_of(variable)))
        if problem is not None:
            place = variable.at("canopen", "scale")
            yield rule.at(place, f"`{variable.part.name}` {problem}", hint="leave `scale` and `offset` out")


def _shown(plan: ObjectPlan) -> list[float]:
    """The least and the greatest value that an integer object shows."""
    scale, offset = plan.linear or (1, 0)
    return sorted(end * scale + offset for end in plan.type.bounds)


def _suited(variable: ExpandedVariable) -> str:
    if variable.kind is ValueKind.BOOL:
        return "BOOLEAN"
    if variable.kind is ValueKind.FLOAT:
        return "REAL64 or REAL32, or an integer type with `scale`"
    return "an INTEGER or UNSIGNED type"


@node_rule("GW437")
def guarding_beside_heartbeat(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """Guarding of a node that produces a heartbeat."""
    if node.part.spec.guarding.time is not None and node.part.spec.heartbeat is not None:
        message = "the node produces a heartbeat, so that no master can guard it"
        yield rule.at(
            node.part.key_at("guarding"), message, hint="write `heartbeat: none`, or remove `guarding`"
        )
    for writer, spec in _writers(cell):
        if spec.guarding is not None and node.part.spec.heartbeat is not None:
            message = f"`{writer.name}` promises to guard a node that produces a heartbeat, which answers no guarding"
            hint = "write `canopen: {heartbeat: none}`, or `node` and `heartbeat` in place of `guarding`"
            yield rule.at(writer.key_at("guarding"), message, hint=hint)


@node_rule("GW414", Severity.WARNING)
def real32_loss(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A double of the robot in a REAL32 that loses digits."""
    for variable, placed in _lines(cell, node):
        place = place_of(variable)
        if placed.plan.type is not CanType.REAL32 or variable.kind is not ValueKind.FLOAT:
            continue
        limits = variable.spec.limits
        coarse = limits is not None and max(-limits[0], limits[1]) > _REAL32_DIGITS
        if variable.grows or coarse:
            message = f"`{variable.part.name}` needs more digits than a REAL32 has"
            yield rule.at(_type_place(variable), message, hint="write `canopen: {type: REAL64}`")
        elif place is None or place.type is None:
            message = f"`{variable.part.name}` is a double of the robot and becomes a REAL32 with 7 digits"
            hint = "write `canopen: {type: REAL32}` if that is enough, or `{type: REAL64}`"
            yield rule.at(_type_place(variable), message, hint=hint)


@node_rule("GW415", Severity.WARNING)
def narrow_canopen_type(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """An integer object that can never show what the robot sends."""
    reported: set[str] = set()
    for placed in node.objects:
        variable = cell.variables[placed.variable]
        bounds, reach = variable.range, reach_of(placed.plan.type, placed.plan.linear)
        if variable.direction is Direction.INPUT or bounds is None or not placed.fits:
            continue
        if reach.low is None or reach.high is None or reach.is_real or variable.part.name in reported:
            continue
        steps = (bounds[1] - bounds[0]) / abs((placed.plan.linear or (1, 0))[0])
        if bounds[0] < reach.low or bounds[1] > reach.high:
            low, high = _shown(placed.plan)
            text = f"{placed.plan.type_text} shows {number(low)} to {number(high)}"
            hint = "use a wider type, or state the range with `limits: [least, greatest]`"
        elif variable.kind is ValueKind.FLOAT and 0 < steps < _MIN_STEPS:
            text = f"{placed.plan.type_text} leaves {counted(int(steps) + 1, 'value')} of it"
            hint = "use a finer scale"
        else:
            continue
        reported.add(variable.part.name)
        # An integer is alike in all elements of a line, a real is not: a pose has metres and radians.
        name = variable.name if variable.kind is ValueKind.FLOAT else variable.part.name
        message = f"`{name}` can be {number(bounds[0])} to {number(bounds[1])}, but {text}"
        yield rule.at(_type_place(variable), message, hint=hint)


@node_rule("GW420")
def watched_itself(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A writer whose heartbeat is that of this node."""
    own = node.part.spec.node
    for writer, spec in _writers(cell):
        if spec.node == own:
            message = f"the writer `{writer.name}` has the node-ID {own}, which is this cell's own"
            related = (Related(node.part.at("node"), f"this cell is node {own}"),)
            hint = "write the node-ID of the master, often 1 or 127"
            yield rule.at(writer.at("node"), message, hint=hint, related=related)


@node_rule("GW421")
def unknown_bit_rate(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A bit-rate that CANopen does not have."""
    rate = node.part.spec.bitrate
    if rate in BIT_RATES:
        return
    near = rate * 1000 if rate * 1000 in BIT_RATES else min(BIT_RATES, key=lambda known: abs(known - rate))
    message = f"{rate} bit/s is not a CANopen bit-rate"
    hint = f"write {near}, if that is the bit-rate of the bus"
    yield rule.at(node.part.at("bitrate"), message, hint=hint)


@node_rule("GW422", Severity.WARNING)
def idle_canopen_writer(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A writer by PDO or SDO where there is nothing for it to write."""
    if len(cell.document.declared("variables")) > len(cell.document.variables):
        return
    by_sdo = any(placed.direction is Direction.INPUT for placed in node.objects)
    by_rpdo = any(entry.direction is Direction.INPUT for pdo in node.pdos for entry in pdo.entries)
    for writer, spec in _writers(cell):
        if (spec.canopen == "rpdo" and not by_rpdo) or (spec.by_sdo and not by_sdo):
            what = "in a PDO" if by_sdo else "on CANopen"
            ways = " and ".join(sorted(ways_of(writer.spec)))
            message = f"`{writer.name}` writes by {ways}, but no variable towards the robot is {what}"
            hint = "write `canopen: auto` at its variables, or remove `canopen` here"
            yield rule.at(writer.at("canopen"), message, hint=hint)


@node_rule("GW423")
def out_of_reach(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """An input that none of its owners can write where it lies."""
    if not cell.document.writers:
        return
    for variable in _inputs(cell):
        owners = _owners(cell, variable)
        ways = ways_of_variable(variable, cell)
        if not owners or not ways:
            continue
        reach = frozenset().union(*(ways_of(writer) for _, writer in owners))
        names = one_and_more([name for name, _ in owners])
        if _RPDO in ways and _RPDO not in reach:
            message = f"`{variable.part.name}` is in an RPDO, and its owner {names} does not write by RPDO"
            hint = "name a writer with `canopen: rpdo` as owner, or write `canopen: object`"
            yield rule.at(_canopen_place(variable), message, hint=hint)
        elif not ways & reach:
            message = (
                f"`{variable.part.name}` can be written by {' and '.join(sorted(ways))} only, "
                f"but its owner {names} writes by {' and '.join(sorted(reach))}"
            )
            hint = "name another owner, or put the variable where its owner writes"
            yield rule.at(variable.position, message, hint=hint)


@node_rule("GW432", Severity.WARNING)
@first_at_each_place
def owner_elsewhere(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """An owner that cannot write where the variable lies."""
    for variable in _inputs(cell):
        assert variable.lock is not None
        lock = cell.locks[variable.lock]
        ways = ways_of_variable(variable, cell)
        owners = _owners(cell, variable)
        if lock.is_any or not ways or not any(ways & ways_of(writer) for _, writer in owners):
            continue
        for name, writer in owners:
            if not ways & ways_of(writer):
                message = (
                    f"the owner `{name}` writes by {' and '.join(sorted(ways_of(writer)))}, "
                    f"but `{variable.part.name}` can be written by {' and '.join(sorted(ways))} only"
                )
                hint = f"put `{variable.part.name}` where `{name}` writes, or remove that owner"
                yield rule.at(lock.position, message, hint=hint)


def _owners(cell: ExpandedCell, variable: ExpandedVariable) -> list[tuple[str, WriterSpec]]:
    if variable.lock is None:
        return []
    return [(name, cell.document.writers[name].spec) for name in cell.locks[variable.lock].owners]


def _inputs(cell: ExpandedCell) -> Iterator[ExpandedVariable]:
    """The first input of each line that has an owner."""
    for variable in cell.variables:
        if variable.direction is Direction.INPUT and variable.lock is not None and not variable.member:
            yield variable


@cell_rule("GW424")
def two_canopen_writers(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two writers for one service of the node."""
    for service in ("by_rpdo", "by_sdo"):
        found = [
            (writer, spec)
            for writer, spec in _writers(cell)
            if getattr(spec, service) and not (service == "by_rpdo" and spec.pdos)
        ]
        for other, spec in found[1:]:
            first, former = found[0]
            if service == "by_sdo" and spec.by_rpdo and former.by_rpdo:
                continue
            message = f"`{other.name}` writes by {service[3:].upper()} too, like `{first.name}`"
            related = (Related(first.at("canopen"), f"`{first.name}` is here"),)
            hint = "make one writer of the two, let one write by sdo, or name its PDOs: `pdos: command`"
            yield rule.at(other.at("canopen"), message, hint=hint, related=related)


@node_rule("GW439")
def writer_of_pdo(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A PDO that a writer cannot have, or that its variables' owner does not send."""
    towards = {pdo.name: pdo for pdo in node.pdos if pdo.name and pdo.direction is Direction.INPUT}
    first: dict[str, Part[WriterSpec]] = {}
    for writer, spec in _writers(cell):
        for name in spec.pdos:
            message = ""
            if not spec.by_rpdo:
                message = f"`{writer.name}` has `pdos`, but does not write by RPDO"
            elif name not in towards:
                message = f"there is no PDO `{name}` towards the robot"
            elif first.setdefault(name, writer) is not writer:
                message = f"the PDO `{name}` is `{first[name].name}`'s already"
            if message:
                yield rule.at(
                    writer.at("pdos"),
                    message,
                    hint="name PDOs that are this writer's alone",
                )
    for pdo in node.pdos if first else ():
        for entry in pdo.entries if pdo.direction is Direction.INPUT else ():
            variable = cell.variables[entry.variable]
            owners = [(name, writer.by(CanopenWriter)) for name, writer in _owners(cell, variable)]
            senders = [name for name, spec in owners if spec.by_rpdo]
            if senders and not any(writes_by(spec, pdo, cell) for _, spec in owners):
                message = (
                    f"`{variable.name}` is in {pdo.label}, which is not its owner {one_and_more(senders)}'s"
                )
                yield rule.at(
                    variable.position, message, hint="put it into a PDO of its owner, or name another owner"
                )


@cell_rule("GW425")
def half_supervision(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A watched heartbeat without a node, a time, or CANopen."""
    for writer, spec in _writers(cell):
        given = [key for key in ("node", "heartbeat", "guarding") if getattr(spec, key) is not None]
        if not given:
            continue
        if spec.canopen is None:
            message = f"the writer `{writer.name}` has `{given[0]}`, but does not write by CANopen"
            hint = f"add `canopen: rpdo`, or remove `{given[0]}`"
            yield rule.at(writer.key_at(given[0]), message, hint=hint)
        elif ("node" in given) is not ("heartbeat" in given):
            other, hint = "node", "add `node: 1`, the node-ID of the writer"
            if given[0] == "node":
                other, hint = "heartbeat", "add `heartbeat: 500ms`"
            message = f"the writer `{writer.name}` has `{given[0]}` without `{other}`"
            yield rule.at(writer.key_at(given[0]), message, hint=hint)


@node_rule("GW435", Severity.WARNING)
def timeout_of_silence(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A timeout for a CANopen writer that may be silent for good reason."""
    received = [pdo for pdo in node.pdos if pdo.direction is Direction.INPUT]
    if not received or any(pdo.event is not None or pdo.transmission < FIRST_EVENT_TYPE for pdo in received):
        return
    for writer, spec in _writers(cell):
        timeout, only_here = writer.spec.timeout, len(known_by(writer.spec)) == 1
        promised = spec.heartbeat if spec.heartbeat is not None else spec.guarding
        if spec.by_rpdo and only_here and timeout is not None and promised is None:
            message = f"`{writer.name}` is lost after {seconds(timeout)} without a PDO, but no PDO is sent regularly"
            hint = "write `node: 1, heartbeat: 1s` in place of `timeout`, or give the PDOs a `deadline`"
            yield rule.at(writer.at("timeout"), message, hint=hint)


def _writers(cell: ExpandedCell) -> Iterator[tuple[Part[WriterSpec], CanopenWriter]]:
    """Each writer, and what it has by CANopen."""
    return ((writer, writer.spec.by(CanopenWriter)) for writer in cell.document.writers.values())


def _lines(cell: ExpandedCell, node: CanopenCell) -> Iterator[tuple[ExpandedVariable, MappedObject]]:
    """The first variable of each line that is an object, with the object."""
    seen: set[str] = set()
    for placed in node.objects:
        variable = cell.variables[placed.variable]
        if variable.part.name not in seen:
            seen.add(variable.part.name)
            yield variable, placed


def _canopen_place(variable: ExpandedVariable) -> Position:
    return variable.part.at("canopen") if place_of(variable) is not None else variable.position


def _type_place(variable: ExpandedVariable) -> Position:
    """Place of the type where it is written, else of what stands for it."""
    return variable.part.at("canopen", "type") if place_of(variable) is not None else variable.position
