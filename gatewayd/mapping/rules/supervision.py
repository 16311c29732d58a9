"""Rules GW515, GW521, GW522 and GW613: who notices that a writer hangs, and keys that nothing lets act."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.core.definition import Direction
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule, Severity
from gatewayd.mapping.expand import ExpandedCell, is_program_output
from gatewayd.mapping.rules.failsafe import silent_motion
from gatewayd.mapping.rules.ownership import endless_locks
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.mapping.rules.wording import names_and_more

__all__: list[str] = []


@cell_rule(
    "GW515",
    "unsupervised-watchdog",
    "a watchdog that requires a writer without a timeout",
    Severity.WARNING,
)
def unsupervised_watchdog(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Required writers without `timeout`."""
    for position, name in _unsupervised_requirements(cell):
        message = f"the watchdog requires `{name}`, which has no timeout"
        related = (Related(cell.document.writers[name].key, f"`{name}` is here"),)
        yield rule.at(position, message, hint=f"add `timeout: 1s` to `{name}`", related=related)


def _unsupervised_requirements(cell: ExpandedCell) -> Iterator[tuple[Position, str]]:
    """Writers that the watchdog requires and nobody supervises, with the place that names them."""
    robot = cell.document.robot
    if robot is None or robot.spec.watchdog is None:
        return
    for index, name in enumerate(robot.spec.watchdog.requires or ()):
        writer = cell.document.writers.get(name)
        if writer is not None and not writer.spec.is_supervised:
            yield robot.at("watchdog", "requires", index), name


@cell_rule(
    "GW521",
    "unsupervised-writer",
    "a writer that keeps what it owns when its program hangs",
    Severity.WARNING,
)
def unsupervised_writer(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Writers without supervision, unless another rule has reported already what that leads to."""
    reported = {name for _, name in silent_motion(cell)}
    reported |= {name for _, name in endless_locks(cell)}
    reported |= {name for _, name in _unsupervised_requirements(cell)}
    for writer in cell.document.writers.values():
        if writer.spec.is_supervised or writer.name in reported:
            continue
        kept = [
            cell.variables[lock.members[0]].part.name
            for lock in cell.locks
            if lock.lease is None and writer.name in lock.owners
        ]
        if not kept:
            continue
        by_can = not writer.spec.modbus
        message = (
            f"nobody notices when `{writer.name}` hangs; it keeps {names_and_more(list(dict.fromkeys(kept)))}"
        )
        hint = f"add `{'node: 1, heartbeat: 1s' if by_can else 'timeout: 2s'}` to `{writer.name}`"
        yield rule.at(writer.key, message, hint=hint)


@cell_rule(
    "GW522",
    "key-without-effect",
    "a key that nothing in the file lets act",
)
def key_without_effect(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """`timeout_counts`, `grace`, `whole` and `adopt_for` where they mean nothing."""
    yield from _writers(rule, cell)
    takeovers = {lock.name for lock in cell.locks if lock.takeover and len(lock.owners) > 1}
    used = {lock.name for lock in cell.locks if lock.group is not None}
    for group in cell.document.groups.values():
        if group.spec.whole and group.name in used - takeovers:
            message = f"the group `{group.name}` is `whole`, and nobody takes it over from anybody"
            hint = (
                "name the owners by priority (owner: [plc, hmi]) without `takeover: false`, or remove `whole`"
            )
            yield rule.at(group.key_at("whole"), message, hint=hint)
    robot = cell.document.robot
    if (
        robot is not None
        and robot.spec.on_connect == "fallback"
        and "adopt_for" in robot.spec.model_fields_set
    ):
        message = "`adopt_for` is for adopted inputs, and `on_connect: fallback` adopts none"
        yield rule.at(robot.key_at("adopt_for"), message, hint="remove one of the two")


def _writers(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    for writer in cell.document.writers.values():
        written = writer.spec.model_fields_set
        if "timeout_counts" in written and writer.spec.timeout is None:
            message = f"the writer `{writer.name}` has `timeout_counts` without `timeout`"
            hint = "add `timeout: 2s`, or remove it"
            yield rule.at(writer.key_at("timeout_counts"), message, hint=hint)
        if writer.spec.grace is not None and not writer.spec.modbus:
            message = f"the writer `{writer.name}` has `grace`, and no connection that could end"
            hint = "remove it; a CANopen writer is lost by its heartbeat or its timeout"
            yield rule.at(writer.key_at("grace"), message, hint=hint)


@cell_rule(
    "GW613",
    "valid-without-program",
    "valid: running where no robot program writes",
    Severity.WARNING,
)
def valid_without_program(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """`valid` at outputs that are no registers, and at a robot none of whose output registers are mapped."""
    outputs = [variable for variable in cell.variables if variable.direction is Direction.OUTPUT]
    for variable in outputs:
        if variable.spec.valid is not None and not variable.member and not is_program_output(variable.field):
            message = f"`{variable.part.name}` ({variable.target}) is as true while no program runs"
            hint = "remove `valid`; it is for output registers"
            yield rule.at(variable.part.key_at("valid"), message, hint=hint)
    robot = cell.document.robot
    complete = len(cell.document.declared("variables")) == len(cell.document.variables)
    if robot is None or robot.spec.valid is None or not complete or cell.unresolved:
        return
    if not any(is_program_output(variable.field) for variable in outputs):
        message = "`valid: running` is for output registers, and none is mapped"
        yield rule.at(robot.key_at("valid"), message, hint="remove it, or map an output register")
