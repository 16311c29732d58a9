"""Rules GW851 to GW855: commands of the dashboard server, and who may give them."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.core.definition import Direction, FallbackKind
from gatewayd.links.registry import languages
from gatewayd.links.robot.dashboard.sections import DashboardSection
from gatewayd.links.robot.dashboard.variables import POWERFUL, VIA, name_of
from gatewayd.links.robot.sections import RobotSection
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule
from gatewayd.mapping.document import Document
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.model import WriterSpec
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.report.wording import alternatives


def commands(cell: ExpandedCell) -> Iterator[ExpandedVariable]:
    """The commands of a cell."""
    return (each for each in cell.variables if each.via == VIA and each.direction is Direction.INPUT)


def section_of(document: Document) -> DashboardSection | None:
    """What the file says of the dashboard server."""
    robot = document.part(RobotSection)
    return robot.spec.dashboard if robot is not None else None


@cell_rule("GW851")
def command_of_several_owners(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """`unlock`, `power` or `brake_release` that more than one writer could give."""
    for command in commands(cell):
        name = name_of(command.field)
        lock = cell.locks[command.lock] if command.lock is not None else None
        if name not in POWERFUL or lock is None or not (lock.is_any or len(lock.owners) > 1):
            continue
        who = "any writer" if lock.is_any else f"each of {', '.join(f'`{owner}`' for owner in lock.owners)}"
        message = f"`{command.name}` (dashboard {name}) may be given by {who}"
        hint = "it prepares the robot to move: name the one writer that looks after it, `owner: plc`"
        yield rule.at(lock.position, message, hint=hint)


@cell_rule("GW852")
def held_command(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A fallback of a command other than `clear`."""
    for command in commands(cell):
        if command.spec.on_release.kind is not FallbackKind.CLEAR:
            message = f"`{command.name}` is a command: no fallback makes the robot do anything, or undoes it"
            yield rule.at(command.at("on_release"), message, hint="remove `on_release`")


@cell_rule("GW853")
def command_twice(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two variables for one command."""
    first: dict[str, ExpandedVariable] = {}
    for command in commands(cell):
        earlier = first.setdefault(command.field, command)
        if earlier is not command:
            name = name_of(command.field)
            message = f"`{command.name}` and `{earlier.name}` are both the command {name}, each with an owner"
            related = (Related(earlier.at("dashboard"), f"`{earlier.name}`, first used here"),)
            hint = "keep one, with its owners and places"
            yield rule.at(command.at("dashboard"), message, hint=hint, related=related)


@cell_rule("GW854")
def load_without_programs(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """`load` or `loaded` where the file numbers no programs."""
    section = section_of(cell.document)
    if section is None or section.programs:
        return
    for variable in cell.variables:
        if variable.via == VIA and name_of(variable.field) in ("load", "loaded"):
            message = f"`{variable.name}` is the number of a program, and no programs are numbered"
            hint = "write them into the section: robot: {dashboard: {programs: {1: pick.urp}}}"
            yield rule.at(variable.at("dashboard"), message, hint=hint)


@cell_rule("GW855")
def command_by_other_link(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A command that a writer may give by a link whose values are no commands."""
    ways = alternatives([language.key for language in languages() if language.commands])
    for command in commands(cell):
        lock = cell.locks[command.lock] if command.lock is not None else None
        for owner in lock.owners if lock is not None else ():
            other = _other_way(cell.document.writers[owner].spec)
            if other is None:
                continue
            message = f"`{owner}` could give the command `{command.name}` by `{other}`"
            related = (Related(cell.document.writers[owner].key, f"`{owner}` is known here"),)
            hint = f"what starts a robot has to be meant: let a writer by {ways} own it"
            assert lock is not None
            yield rule.at(lock.position, message, hint=hint, related=related)


def _other_way(writer: WriterSpec) -> str | None:
    """The kind of link by which the writer is known and that gives no commands."""
    known = (language for language in languages() if language.knows(writer))
    return next((language.key for language in known if not language.commands), None)
