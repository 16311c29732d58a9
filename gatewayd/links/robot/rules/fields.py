"""Rules GW3xx: the robot's fields, rates and recipes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from math import floor, isclose

from gatewayd.core.definition import Direction
from gatewayd.links.robot.reference import ReferenceProblem
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule, Severity
from gatewayd.mapping.document import Document
from gatewayd.mapping.expand import ConcreteVariable, ExpandedCell, Unresolved
from gatewayd.mapping.rules.registry import cell_rule, plant_rule
from gatewayd.mapping.rules.wording import number
from gatewayd.rtde.catalogue import INPUTS, OUTPUTS, REGISTERS, Series, SoftwareVersion, suggest
from gatewayd.rtde.types import DataType

__all__ = ["LEAST_RATE"]

LEAST_RATE = 0.1
"""Packages per second below which nobody can mean it; 0 stands for the controller's own rate."""

_SHORT_LISTS = 2048
_LONG_LISTS_SINCE = SoftwareVersion(5, 17)
_UPPER_INPUTS = frozenset(
    f"{family.prefix}{register}"
    for family in REGISTERS
    if family.prefix.startswith("input_")
    for register in family.numbers
    if register not in family.fieldbus
)
_WATCHDOG_TYPES = (DataType.INT32, DataType.DOUBLE)


@cell_rule(
    "GW301",
    "unknown-field",
    "a name that no RTDE guide and no implementation knows",
)
def unknown_field(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """References and the watchdog with an unknown field."""
    for item in cell.unresolved:
        if item.problem is ReferenceProblem.UNKNOWN_FIELD:
            message = f"the robot has no field `{item.name}` (variable `{item.part.name}`)"
            yield rule.at(item.part.at("robot"), message, hint=_suggestion(item.name))
    watchdog = _watchdog(cell.document)
    if watchdog is not None and watchdog[0] not in INPUTS and watchdog[0] not in OUTPUTS:
        message = f"the robot has no field `{watchdog[0]}` to feed as a watchdog"
        yield rule.at(watchdog[1], message, hint=_suggestion(watchdog[0]))


_NAMES = (
    *dict.fromkeys((*INPUTS, *OUTPUTS)),
    *(f"{side}_bit_register_{number}" for side in ("input", "output") for number in range(64)),
)
"""Fields, and the gateway's own names for bits of the reserved words."""


def _suggestion(name: str) -> str:
    close = suggest(name, _NAMES)
    if not close:
        return "fields are listed in the RTDE guide; registers are such as output_int_register_0"
    return "did you mean " + " or ".join(f"`{item}`" for item in close) + "?"


@cell_rule(
    "GW302",
    "watchdog-field",
    "a watchdog on a field that cannot be fed",
)
def watchdog_field(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Watchdogs on outputs and on fields that are no plain number."""
    watchdog = _watchdog(cell.document)
    if watchdog is None:
        return
    name, position = watchdog
    hint = "use an integer or double input register, for example `input_int_register_23`"
    if name in INPUTS:
        if INPUTS[name].type not in _WATCHDOG_TYPES:
            message = f"`{name}` is {INPUTS[name].type.word}; a watchdog needs an integer or a double"
            yield rule.at(position, message, hint=hint)
    elif name in OUTPUTS:
        yield rule.at(position, f"`{name}` comes from the robot and cannot be fed", hint=hint)


@cell_rule(
    "GW303",
    "field-not-in-version",
    "a field that the controller software does not have yet",
)
def field_not_in_version(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Fields that come later than the given software."""
    series, version = _controller(cell.document)
    if series is None:
        return
    seen: set[str] = set()
    for variable in cell.variables:
        field = variable.field
        if variable.part.name in seen or field.available(series, version):
            continue
        seen.add(variable.part.name)
        shown = f"software {version}" if version is not None else "any software"
        message = f"`{field.name}` does not exist in {shown} of series {series.word}"
        first = field.first_version(series)
        known = field.exists(series) and first is not None
        hint = f"it exists from {first} on" if known else "no version of this series has it"
        yield rule.at(variable.at("robot"), message, hint=hint)


@cell_rule(
    "GW312",
    "series-and-version",
    "a software version that does not belong to the series",
)
def series_and_version(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Major versions of another series."""
    robot = cell.document.robot
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


@cell_rule(
    "GW304",
    "no-such-part",
    "a register, element or bit that the field does not have",
)
def no_such_part(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """References beyond or beside what a field consists of."""
    for item in cell.unresolved:
        if item.problem in _PARTS:
            message, hint = _PARTS[item.problem]
            values = {"name": item.name, "text": str(item.part.spec.robot), "last": _last(item)}
            position = item.part.at("robot")
            yield rule.at(position, message.format(**values), hint=hint.format(**values))


_PARTS = {
    ReferenceProblem.NOT_NUMBERED: (
        "`{text}`: `{name}` has no numbered registers",
        "ranges are for numbered registers, such as output_int_register_0..23",
    ),
    ReferenceProblem.NO_SUCH_REGISTER: ("there is no register `{name}`", "the last one is number {last}"),
    ReferenceProblem.NOT_A_VECTOR: ("`{text}`: `{name}` is no vector", "leave the brackets out"),
    ReferenceProblem.NO_SUCH_ELEMENT: (
        "`{text}`: the vector `{name}` does not have this element",
        "its elements are 0 to {last}",
    ),
    ReferenceProblem.NOT_AN_INTEGER: (
        "`{text}`: `{name}` is no integer and has no bits",
        "leave the dot and the number out",
    ),
    ReferenceProblem.NO_SUCH_BIT: ("`{text}`: `{name}` does not have this bit", "its bits are 0 to {last}"),
}


def _last(item: Unresolved) -> int:
    if item.limit is None:
        return 0
    return item.limit if item.problem is ReferenceProblem.NO_SUCH_REGISTER else item.limit - 1


@cell_rule(
    "GW305",
    "input-mapped-twice",
    "two input variables on the same register or bits of the robot",
)
def input_mapped_twice(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Inputs that share bits of a field."""
    owners: dict[tuple[str, int | None], dict[int | None, ConcreteVariable]] = {}
    reported: set[tuple[str, str]] = set()
    for variable in cell.variables:
        if variable.direction is not Direction.INPUT:
            continue
        taken = owners.setdefault((variable.field.name, variable.element), {})
        whole = taken.get(None)
        earlier = next(iter(taken.values()), None) if variable.bit is None else taken.get(variable.bit, whole)
        taken.setdefault(variable.bit, variable)
        if earlier is None or (earlier.part.name, variable.part.name) in reported:
            continue
        reported.add((earlier.part.name, variable.part.name))
        message = f"`{variable.name}` writes {variable.target}, as `{earlier.name}` does ({earlier.target})"
        related = (Related(earlier.at("robot"), f"`{earlier.name}`, first used here"),)
        hint = f"map it once; more places for it make a list: modbus: [{_places(earlier)}, ...]"
        yield rule.at(variable.at("robot"), message, hint=hint, related=related)


def _places(variable: ConcreteVariable) -> str:
    specs = variable.spec.modbus
    return str(specs[0].address) if specs else "100"


@cell_rule(
    "GW306",
    "rate-above-base",
    "a rate above the controller's own",
)
def rate_above_base(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Frequencies of packages and of the watchdog above the base rate."""
    series, _ = _controller(cell.document)
    robot = cell.document.robot
    if robot is None or series is None:
        return
    wanted = [(robot.spec.frequency, robot.at("frequency"), "packages")]
    if robot.spec.watchdog is not None:
        wanted.append((robot.spec.watchdog.frequency, robot.at("watchdog", "frequency"), "watchdog feeds"))
    for frequency, position, what in wanted:
        if frequency > series.base_rate:
            message = f"{number(frequency)} {what} per second, but series {series.word} runs at {series.base_rate} Hz"
            yield rule.at(position, message, hint=f"ask for {series.base_rate} or less")


@cell_rule(
    "GW307",
    "rate-not-a-divisor",
    "a rate that the controller cannot make",
    Severity.WARNING,
)
def rate_not_a_divisor(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Frequencies between two steps of the controller."""
    robot = cell.document.robot
    if robot is None or robot.spec.frequency < LEAST_RATE:
        return
    series, _ = _controller(cell.document)
    base, wanted = (series or Series.E).base_rate, robot.spec.frequency
    steps = base / wanted
    if steps < 1 or isclose(steps, round(steps), rel_tol=1e-3):
        return
    real = base / floor(steps)
    message = f"{number(wanted)} Hz does not divide {base} Hz: the controller will send {real:.4g} Hz"
    below = base / (floor(steps) + 1)
    hint = f"write {real:.4g} or {below:.4g}"
    yield rule.at(robot.at("frequency"), message, hint=hint)


@cell_rule(
    "GW314",
    "rate-too-low",
    "a rate of less than one package in ten seconds",
)
def rate_too_low(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Frequencies below 0.1 Hz that are not 0."""
    robot = cell.document.robot
    if robot is not None and 0 < robot.spec.frequency < LEAST_RATE:
        message = f"{number(robot.spec.frequency)} Hz is less than one package in ten seconds"
        hint = (
            f"`frequency` is in Hz: write at least {number(LEAST_RATE)}, or 0 for the controller's own rate"
        )
        yield rule.at(robot.at("frequency"), message, hint=hint)


@cell_rule(
    "GW308",
    "long-recipe",
    "more field names than an old controller takes in one request",
    Severity.WARNING,
)
def long_recipe(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Output recipes beyond 2048 bytes for software that has the limit."""
    series, version = _controller(cell.document)
    robot = cell.document.robot
    limited = series is Series.CB3 or (
        series is Series.E and version is not None and version < _LONG_LISTS_SINCE
    )
    if robot is None or not limited:
        return
    outputs = _names(variable for variable in cell.variables if variable.direction is Direction.OUTPUT)
    read_back = _names(variable for variable in cell.variables if variable.field.name in OUTPUTS)
    names = list(dict.fromkeys((*outputs, *read_back))) if robot.spec.verify else outputs
    if _length(names) <= _SHORT_LISTS:
        return
    message = f"the names of {len(names)} fields take {_length(names)} bytes, this controller takes {_SHORT_LISTS}: "
    if _length(outputs) > _SHORT_LISTS:
        message += "outputs that have no room have no value"
        hint = "leave fields out"
    else:
        message += "inputs that have no room are not compared with what was written"
        hint = "write `verify: false` if no input needs to be, or leave fields out"
    yield rule.at(cell.document.key_at("variables"), message, hint=hint)


def _names(variables: Iterable[ConcreteVariable]) -> list[str]:
    return list(dict.fromkeys(variable.field.name for variable in variables))


def _length(names: Sequence[str]) -> int:
    return len(",".join(("timestamp", *names)))


@cell_rule(
    "GW309",
    "upper-range",
    "an input register outside the range for fieldbuses",
    Severity.WARNING,
)
def upper_range(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Upper input registers, once per line, and the watchdog's."""
    hint = "use integers and doubles 0 to 23, bits 0 to 63"
    seen: set[str] = set()
    for variable in cell.variables:
        if variable.field.name in _UPPER_INPUTS and variable.part.name not in seen:
            seen.add(variable.part.name)
            message = f"`{variable.name}` uses {variable.target}, which URCaps and ur_rtde may claim"
            yield rule.at(variable.at("robot"), message, hint=hint)
    watchdog = _watchdog(cell.document)
    if watchdog is not None and watchdog[0] in _UPPER_INPUTS:
        message = f"the watchdog feeds {watchdog[0]}, which URCaps and ur_rtde may claim"
        yield rule.at(watchdog[1], message, hint=hint)


@cell_rule(
    "GW311",
    "watchdog-mapped",
    "a variable on the register of the watchdog",
)
def watchdog_mapped(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Input variables on the watchdog's field."""
    watchdog = _watchdog(cell.document)
    if watchdog is None:
        return
    for variable in cell.variables:
        if variable.field.name == watchdog[0]:
            message = f"`{variable.name}` writes {variable.target}, which the gateway feeds as the watchdog"
            related = (Related(watchdog[1], "the watchdog is here"),)
            hint = "use another register for one of the two"
            yield rule.at(variable.at("robot"), message, hint=hint, related=related)
            return


@plant_rule(
    "GW313",
    "robot-claimed-twice",
    "two cells that claim the same input of one robot",
)
def robot_claimed_twice(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Equal input fields of one controller in two cells."""
    claimed: dict[tuple[str, int, str], tuple[ExpandedCell, str, Position]] = {}
    for cell in cells:
        robot = cell.document.robot
        if robot is None:
            continue
        watchdog = _watchdog(cell.document)
        claims = chain(
            (
                (variable.field.name, variable.name, variable.at("robot"))
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


def _controller(document: Document) -> tuple[Series | None, SoftwareVersion | None]:
    """What the file says of the controller; the series may follow from the version."""
    robot = document.robot
    if robot is None:
        return None, None
    version = SoftwareVersion(*robot.spec.version) if robot.spec.version is not None else None
    if robot.spec.series is not None:
        series = Series.from_word(robot.spec.series)
        # A version of another series is a finding of its own and says nothing about fields.
        return series, version if version is not None and version.major == series.major else None
    return (Series.from_major(version.major), version) if version is not None else (None, None)


def _watchdog(document: Document) -> tuple[str, Position] | None:
    robot = document.robot
    if robot is None or robot.spec.watchdog is None:
        return None
    return robot.spec.watchdog.field, robot.at("watchdog", "field")
