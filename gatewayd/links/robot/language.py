"""The robot's part of the mapping language: it defines the variables of a cell."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar, Final

from gatewayd.core.definition import Direction
from gatewayd.links.language import DefiningLanguage, Patience, WriterName
from gatewayd.links.robot.dashboard.sections import DashboardPlace, DashboardSection
from gatewayd.links.robot.declaration import KIND
from gatewayd.links.robot.definition import define, type_of
from gatewayd.links.robot.plan import WATCHDOG_MARGIN, RobotPlan, WatchdogPlan
from gatewayd.links.robot.rates import package_period, package_rate
from gatewayd.links.robot.reference import is_bit_register, is_known
from gatewayd.links.robot.sections import (
    ADOPT_FOR,
    RobotField,
    RobotPlace,
    RobotSection,
    RobotValidity,
    Watchdog,
)
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import CellSettings, Defined, ExpandedCell
from gatewayd.mapping.model import VariableSpec
from gatewayd.mapping.section import Section
from gatewayd.rtde.fields import SoftwareVersion

_STALE_PERIODS: Final = 5
_MIN_STALE_AFTER: Final = 0.1
_TIMESTAMP: Final = "timestamp"
_PROGRAM_STATE: Final = "runtime_state"
"""The field that says whether the robot program runs."""
_UNKNOWN: Final = RobotSection(host="unknown")

_SERIES: Final = {
    "cb3": ("UR3", "UR5", "UR10", "CB", "CB3.1", "CB-SERIES"),
    "e": ("UR3E", "UR5E", "UR7E", "UR10E", "UR12E", "UR16E", "UR20", "UR30", "E-SERIES", "ESERIES"),
    "x": ("POLYSCOPEX", "POLYSCOPE X", "PSX"),
}
"""Names on the robot's arm and in its manuals."""


class RobotLanguage(DefiningLanguage):
    """Section `robot`, and the keys `robot` and `valid` of a variable."""

    key = KIND.key
    section = RobotSection
    meaning = "the controller"
    required = True
    variable_keys = RobotPlace
    variable_policies = RobotValidity
    rules = ("gatewayd.links.robot.rules.fields", "gatewayd.links.robot.rules.companions",
             "gatewayd.links.robot.rules.watchdog", "gatewayd.links.robot.rules.rates",
             "gatewayd.links.robot.rules.validity")  # fmt: skip
    tables = "gatewayd.links.robot.tables"
    nested: ClassVar[Mapping[tuple[type[Section], str], type[Section]]] = {
        (RobotSection, "watchdog"): Watchdog,
        (RobotSection, "dashboard"): DashboardSection,
        (VariableSpec, "robot"): RobotField,
    }
    articles: ClassVar[Mapping[type[Section], str]] = {
        RobotSection: "the section `robot`",
        Watchdog: "the watchdog",
        DashboardSection: "the dashboard server",
        RobotField: "a field of the robot",
    }
    telling_keys = ("host", "frequency", "port", "series", "version", "adopt_for", "valid")
    synonyms: ClassVar[Mapping[tuple[str, str], str]] = {
        ("series", name): series for series, names in _SERIES.items() for name in names
    }
    output_policies: ClassVar[Mapping[str, str]] = {"valid": "it says when an output is good"}
    unwritten: ClassVar[Mapping[str, object]] = {"adopt_for": ADOPT_FOR}

    def without_effect(self, document: Document) -> Iterable[tuple[Position, str, str]]:
        """`adopt_for` where nothing is adopted, and what is declared of a field that the name says already."""
        robot = document.part(RobotSection)
        if (
            robot is not None
            and robot.spec.on_connect == "fallback"
            and "adopt_for" in robot.spec.model_fields_set
        ):
            message = "`adopt_for` is for adopted inputs, and `on_connect: fallback` adopts none"
            yield robot.key_at("adopt_for"), message, "remove one of the two"
        lines = document.variables.values()
        has_any = any(line.spec.by(DashboardPlace).dashboard is not None for line in lines)
        if robot is not None and robot.spec.dashboard is not None and not has_any:
            message = "the dashboard server is opened, and no variable is a command or a state of it"
            yield (
                robot.key_at("dashboard"),
                message,
                "add for example `start: {dashboard: play}`, or remove it",
            )
        for line in lines:
            place = line.spec.by(RobotPlace).robot
            if place is None:
                if line.spec.by(RobotValidity).valid is not None:
                    message = "`valid` is for outputs that packages carry, and the dashboard server needs no program"
                    yield line.key_at("valid"), message, "remove it"
                continue
            if place.direction is not None and is_known(place.field):
                message = f"the direction of `{place.field}` follows from its name"
                yield line.key_at("robot", "direction"), message, "remove it"
            if place.type is not None and is_bit_register(place.field):
                message = f"`{place.field}` is a bit of a register word and has no type of its own"
                yield line.key_at("robot", "type"), message, "remove it"

    def names_writers(self, document: Document) -> Iterable[WriterName]:
        """The writers that the watchdog requires."""
        robot = document.part(RobotSection)
        if robot is not None and robot.spec.watchdog is not None:
            for index, name in enumerate(robot.spec.watchdog.requires or ()):
                position = robot.at("watchdog", "requires", index)
                yield WriterName(
                    name,
                    position,
                    "a writer that the watchdog requires",
                    "a watchdog cannot require `any`",
                    robot.at("watchdog", "requires"),
                )

    def patience(self, document: Document) -> Iterable[Patience]:
        """The robot program, by its watchdog: it waits for two feeds, and the first may have been due just then."""
        robot = document.part(RobotSection)
        if robot is not None and robot.spec.watchdog is not None:
            yield Patience(
                "the robot program stops",
                (WATCHDOG_MARGIN - 1) / robot.spec.watchdog.frequency,
                robot.key_at("watchdog"),
                "feed the watchdog less often (`frequency: 0.5`)",
            )

    def define(self, line: Part[VariableSpec], document: Document) -> tuple[Sequence[Defined], bool]:
        """The values that a line names, in order, and whether they are a family."""
        return define(line, document)

    def named(self, line: Part[VariableSpec]) -> str:
        """The reference of a line."""
        name = line.spec.by(DashboardPlace).dashboard
        return f"dashboard {name}" if name is not None else str(line.spec.by(RobotPlace).field.field)

    def settings(self, document: Document) -> CellSettings:
        """When values are stale, and what becomes of those that the controller holds."""
        part = document.part(RobotSection)
        robot = part.spec if part is not None else _UNKNOWN
        return CellSettings(
            robot.stale_after or max(_STALE_PERIODS * package_period(robot), _MIN_STALE_AFTER),
            robot.on_connect == "fallback",
            robot.adopt_for,
            package_rate(robot),
        )

    def compile(self, cell: ExpandedCell) -> RobotPlan:
        """How to reach the controller and what to ask of it."""
        part = cell.document.part(RobotSection)
        assert part is not None
        robot, writers = part.spec, list(cell.document.writers)
        watchdog = robot.watchdog
        return RobotPlan(
            host=robot.host,
            port=robot.port,
            frequency=robot.frequency,
            outputs=tuple(name for name in _subscribed(cell) if name != _TIMESTAMP),
            inputs=_fields(cell, Direction.INPUT),
            verify=robot.verify,
            types=_declared_types(cell),
            series=robot.series,
            version=str(SoftwareVersion(*robot.version)) if robot.version is not None else None,
            watchdog=None
            if watchdog is None
            else WatchdogPlan(
                watchdog.field,
                watchdog.frequency,
                tuple(writers.index(name) for name in dict.fromkeys(watchdog.requires or ())),
            ),
        )


def _subscribed(cell: ExpandedCell) -> tuple[str, ...]:
    """Fields of outputs, and what says whether the program runs where the quality of one hangs on it."""
    fields = _fields(cell, Direction.OUTPUT)
    if not any(variable.valid_running for variable in cell.variables):
        return fields
    return tuple(dict.fromkeys((*fields, _PROGRAM_STATE)))


def _declared_types(cell: ExpandedCell) -> tuple[tuple[str, str], ...]:
    found = {variable.field: kind.word for variable in cell.variables if (kind := type_of(variable))}
    return tuple(found.items())


def _fields(cell: ExpandedCell, direction: Direction) -> tuple[str, ...]:
    return tuple(
        dict.fromkeys(
            variable.field
            for variable in cell.variables
            if variable.direction is direction and not variable.via
        )
    )


LANGUAGE: Final = RobotLanguage()
