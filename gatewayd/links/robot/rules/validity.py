"""Rule GW613: when outputs of the robot are good."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.core.definition import Direction
from gatewayd.links.robot.definition import is_program_output
from gatewayd.links.robot.sections import RobotSection, RobotValidity
from gatewayd.mapping.diagnostics import Diagnostic, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule


@cell_rule("GW613", Severity.WARNING)
def valid_without_program(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Valid: running where no robot program writes."""
    outputs = [variable for variable in cell.variables if variable.direction is Direction.OUTPUT]
    for variable in outputs:
        if (
            variable.spec.by(RobotValidity).valid is not None
            and not variable.member
            and not is_program_output(variable)
        ):
            message = f"`{variable.part.name}` ({variable.target}) is just as valid while no program runs"
            hint = "remove `valid`; it is for output registers"
            yield rule.at(variable.part.key_at("valid"), message, hint=hint)
    robot = cell.document.part(RobotSection)
    complete = len(cell.document.declared("variables")) == len(cell.document.variables)
    if robot is None or robot.spec.valid is None or not complete or cell.unresolved:
        return
    if not any(is_program_output(variable) for variable in outputs):
        message = "`valid: running` is for output registers, and none is mapped"
        yield rule.at(robot.key_at("valid"), message, hint="remove it, or map an output register")
