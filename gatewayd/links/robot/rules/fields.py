"""Rules GW3xx: the robot's fields, rates and recipes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain

from gatewayd.core.definition import Direction
from gatewayd.links.robot.definition import field_of, type_of
from gatewayd.links.robot.reference import ReferenceProblem, UnresolvedReference
from gatewayd.links.robot.rules.controller import controller, unresolved, watchdog_field
from gatewayd.links.robot.sections import RobotPlace, RobotSection
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.rules.registry import cell_rule, plant_rule
from gatewayd.mapping.rules.writers import more_places
from gatewayd.report.wording import alternatives
from gatewayd.rtde.catalogue import OLD_LIST_LIMIT, is_fieldbus_range, list_size, suggest
from gatewayd.rtde.fields import INPUTS, OUTPUTS, UNTYPED, Series, SoftwareVersion

_LONG_LISTS_SINCE = SoftwareVersion(5, 17)
_UPPER_INPUTS = frozenset(
    name for name in INPUTS if name.startswith("input_") and not is_fieldbus_range(name)
)


@cell_rule("GW301")
def unknown_field(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A name that no RTDE guide and no implementation knows."""
    for part, error in unresolved(cell):
        if error.problem is ReferenceProblem.UNKNOWN_FIELD:
            message = f"the robot has no field `{error.name}` (variable `{part.name}`)"
            yield rule.at(part.at("robot"), message, hint=_suggestion(error.name))
    watchdog = watchdog_field(cell.document)
    if watchdog is not None and watchdog[0] not in INPUTS and watchdog[0] not in OUTPUTS:
        message = f"the robot has no field `{watchdog[0]}` to feed as a watchdog"
        yield rule.at(watchdog[1], message, hint=_suggestion(watchdog[0]))


_NAMES = (
    *dict.fromkeys((*INPUTS, *OUTPUTS)),
    *(f"{side}_bit_register_{number}" for side in ("input", "output") for number in range(64)),
)
"""Fields, and the gateway's own names for bits of the reserved words."""


def _suggestion(name: str) -> str:
    if name in UNTYPED:
        return f"the newest controllers have it; declare the type that they give it: {{field: {name}, type: DOUBLE}}"
    close = suggest(name, _NAMES)
    if not close:
        newer = f"if the controller has it, declare its type: {{field: {name}, type: DOUBLE}}"
        return f"fields are listed in the RTDE guide; registers are such as output_int_register_0; {newer}"
    return f"did you mean {alternatives(close)}?"


@cell_rule("GW303")
def field_not_in_version(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A field that the controller software does not have yet."""
    series, version = controller(cell.document)
    if series is None:
        return
    seen: set[str] = set()
    for variable in cell.variables:
        field = field_of(variable)
        if field is None or type_of(variable) is not None or variable.part.name in seen:
            continue
        if field.available(series, version):
            continue
        seen.add(variable.part.name)
        shown = f"software {version}" if version is not None else "any software"
        message = f"`{field.name}` does not exist in {shown} of series {series.word}"
        first = field.first_version(series)
        known = field.exists(series) and first is not None
        hint = f"it exists from {first} on" if known else "no version of this series has it"
        yield rule.at(variable.at("robot"), message, hint=hint)


@cell_rule("GW317", Severity.WARNING)
def field_beyond_catalogue(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A declared type of a field that the catalogue lacks, or has with another type."""
    series, version = controller(cell.document)
    seen: set[str] = set()
    for variable in cell.variables:
        declared, field = type_of(variable), field_of(variable)
        if declared is None or variable.part.name in seen:
            continue
        seen.add(variable.part.name)
        if field is None:
            difference = "is not in the catalogue"
        elif field.type is not declared:
            difference = f"is {field.type.word} in the catalogue"
        elif series is not None and not field.available(series, version):
            difference = (
                f"is not in the catalogue for {series.word} {version if version is not None else ''}".rstrip()
            )
        else:
            continue
        message = f"`{variable.field}`, declared {declared.word}, {difference}"
        hint = "the controller's answer decides: with another type, or none, the variable is unavailable"
        yield rule.at(variable.at("robot", "type"), message, hint=hint)


@cell_rule("GW318")
def field_of_two_types(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two lines that declare different types or directions for one field."""
    known: dict[str, tuple[object, ExpandedVariable]] = {}
    reported: set[str] = set()
    for variable in cell.variables:
        field = field_of(variable)
        kind = type_of(variable) or (field.type if field is not None else None)
        declared, first = known.setdefault(variable.field, ((kind, variable.direction), variable))
        if declared != (kind, variable.direction) and variable.part.name not in reported:
            reported.add(variable.part.name)
            message = f"`{variable.field}` is declared differently by `{first.name}`"
            related = (Related(first.at("robot"), "declared here"),)
            hint = "a field has one type and one direction: write the same for both"
            yield rule.at(variable.at("robot"), message, hint=hint, related=related)


@cell_rule("GW312")
def series_and_version(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A software version that does not belong to the series."""
    robot = cell.document.part(RobotSection)
    if robot is None or robot.spec.version is None:
        return
    version = SoftwareVersion(*robot.spec.version)
    belongs = Series.from_major(version.major)
    if belongs is None:
        known = ", ".join(f"{series.major}.x ({series.word})" for series in Series)
        message = f"there is no controller software {version}"
        yield rule.at(robot.at("version"), message, hint=f"known are {known}")
    elif robot.spec.series is not None and robot.spec.series != belongs.word:
        message = f"software {version} belongs to series {belongs.word}, not to {robot.spec.series}"
        related = (Related(robot.at("series"), f"series {robot.spec.series}"),)
        yield rule.at(robot.at("version"), message, hint=f"write `series: {belongs.word}`", related=related)


@cell_rule("GW304")
def no_such_part(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A register, element or bit that the field does not have."""
    for part, error in unresolved(cell):
        if error.problem in _PARTS:
            message, hint = _PARTS[error.problem]
            text = str(part.spec.by(RobotPlace).field.field)
            values = {"name": error.name, "text": text, "last": _last(error)}
            position = part.at("robot")
            yield rule.at(position, message.format(**values), hint=hint.format(**values))


_PARTS = {
    ReferenceProblem.NOT_NUMBERED: (
        "`{text}`: `{name}` has no numbered registers",
        "ranges are for numbered registers, such as output_int_register_0..23",
    ),
    ReferenceProblem.NO_SUCH_REGISTER: ("there is no register `{name}`", "the last one is number {last}"),
    ReferenceProblem.NOT_A_VECTOR: ("`{text}`: `{name}` is not a vector", "leave the brackets out"),
    ReferenceProblem.NO_SUCH_ELEMENT: (
        "`{text}`: the vector `{name}` does not have this element",
        "its elements are 0 to {last}",
    ),
    ReferenceProblem.NOT_AN_INTEGER: (
        "`{text}`: `{name}` is not an integer and has no bits",
        "leave the dot and the number out",
    ),
    ReferenceProblem.NO_SUCH_BIT: ("`{text}`: `{name}` does not have this bit", "its bits are 0 to {last}"),
}


def _last(error: UnresolvedReference) -> int:
    if error.limit is None:
        return 0
    return error.limit if error.problem is ReferenceProblem.NO_SUCH_REGISTER else error.limit - 1


@cell_rule("GW305")
def input_mapped_twice(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two input variables on the same register or bits of the robot."""
    owners: dict[tuple[str, int | None], dict[int | None, ExpandedVariable]] = {}
    reported: set[tuple[str, str]] = set()
    for variable in cell.variables:
        if variable.direction is not Direction.INPUT or variable.via:
            continue
        taken = owners.setdefault((variable.field, variable.element), {})
        whole = taken.get(None)
        earlier = next(iter(taken.values()), None) if variable.bit is None else taken.get(variable.bit, whole)
        taken.setdefault(variable.bit, variable)
        if earlier is None or (earlier.part.name, variable.part.name) in reported:
            continue
        reported.add((earlier.part.name, variable.part.name))
        message = f"`{variable.name}` writes {variable.target}, as `{earlier.name}` does ({earlier.target})"
        related = (Related(earlier.at("robot"), f"`{earlier.name}`, first used here"),)
        more = more_places(earlier)
        hint = "map it once" + (f"; for more places give it a list: {more}" if more else "")
        yield rule.at(variable.at("robot"), message, hint=hint, related=related)


@cell_rule("GW308", Severity.WARNING)
def long_recipe(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """More field names than an old controller takes in one request."""
    series, version = controller(cell.document)
    robot = cell.document.part(RobotSection)
    limited = series is Series.CB3 or (
        series is Series.E and version is not None and version < _LONG_LISTS_SINCE
    )
    if robot is None or not limited:
        return
    outputs = _names(variable for variable in cell.variables if variable.direction is Direction.OUTPUT)
    read_back = _names(variable for variable in cell.variables if variable.field in OUTPUTS)
    names = list(dict.fromkeys((*outputs, *read_back))) if robot.spec.verify else outputs
    if _length(names) <= OLD_LIST_LIMIT:
        return
    size = _length(names)
    message = (
        f"the names of {len(names)} fields take {size} bytes, but this controller takes {OLD_LIST_LIMIT}: "
    )
    if _length(outputs) > OLD_LIST_LIMIT:
        message += "outputs that have no room have no value"
        hint = "leave fields out"
    else:
        message += "inputs that have no room are not compared with what was written"
        hint = "write `verify: false` if no input needs to be, or leave fields out"
    yield rule.at(cell.document.key_at("variables"), message, hint=hint)


def _names(variables: Iterable[ExpandedVariable]) -> list[str]:
    return list(dict.fromkeys(variable.field for variable in variables if not variable.via))


def _length(names: Sequence[str]) -> int:
    return list_size(("timestamp", *names))


@cell_rule("GW309", Severity.WARNING)
def upper_range(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An input register outside the range for fieldbuses."""
    hint = "use integers and doubles 0 to 23, bits 0 to 63"
    seen: set[str] = set()
    for variable in cell.variables:
        if variable.field in _UPPER_INPUTS and variable.part.name not in seen:
            seen.add(variable.part.name)
            message = f"`{variable.name}` uses {variable.target}, which URCaps and ur_rtde may claim"
            yield rule.at(variable.at("robot"), message, hint=hint)
    watchdog = watchdog_field(cell.document)
    if watchdog is not None and watchdog[0] in _UPPER_INPUTS:
        message = f"the watchdog feeds {watchdog[0]}, which URCaps and ur_rtde may claim"
        yield rule.at(watchdog[1], message, hint=hint)


@plant_rule("GW313")
def robot_claimed_twice(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells that claim the same input of one robot."""
    claimed: dict[tuple[str, int, str], tuple[ExpandedCell, str, Position]] = {}
    for cell in cells:
        robot = cell.document.part(RobotSection)
        if robot is None:
            continue
        watchdog = watchdog_field(cell.document)
        claims = chain(
            (
                (variable.field, variable.name, variable.at("robot"))
                for variable in cell.variables
                if variable.direction is Direction.INPUT
            ),
            [(watchdog[0], "watchdog", watchdog[1])] if watchdog is not None else [],
        )
        for field, name, position in claims:
            key = robot.spec.host.casefold(), robot.spec.port, field
            other, earlier, place = claimed.setdefault(key, (cell, name, position))
            if other is not cell:
                message = f"{field} of {robot.spec.host} is claimed by the cell `{other.document.cell}` too"
                related = (Related(place, f"`{earlier}`, first claimed here"),)
                hint = "map all inputs of one robot in one file"
                yield rule.at(position, message, hint=hint, related=related)
                break
