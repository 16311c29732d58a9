"""The variables of a cell: what a line of a mapping means in the robot, with its type, range and direction."""

from __future__ import annotations

from typing import Final

from gatewayd.core.definition import Direction, ValueKind
from gatewayd.links.robot.dashboard.definition import defined
from gatewayd.links.robot.dashboard.sections import DashboardPlace
from gatewayd.links.robot.reference import FieldDeclaration, Target, resolve
from gatewayd.links.robot.sections import RobotField, RobotPlace, RobotSection, RobotValidity
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import Defined, ExpandedVariable
from gatewayd.mapping.model import VariableSpec
from gatewayd.rtde.fields import INPUTS, OUTPUTS, Field
from gatewayd.rtde.ranges import Range, usual_range
from gatewayd.rtde.types import INTEGER_RANGES, DataType

_GROWING: Final = ("timestamp",)
_MOVING: Final = ("speed_slider_fraction",)
_COUNTERPARTS: Final = {
    "actual_digital_output_bits": "standard_digital_output (with its mask)",
    "actual_configurable_digital_output_bits": "configurable_digital_output (with its mask)",
    "standard_analog_output0": "standard_analog_output_0 (with its mask)",
    "standard_analog_output1": "standard_analog_output_1 (with its mask)",
    "target_speed_fraction": "speed_slider_fraction (with its mask)",
}
"""Outputs that are often taken for the input of nearly the same name."""
_OUTPUT_REGISTER: Final = "output_"


def define(line: Part[VariableSpec], document: Document) -> tuple[list[Defined], bool]:
    """The values that a line names, in order, and whether they are a family. Raises UnresolvedReference."""
    robot, name = document.part(RobotSection), line.spec.by(DashboardPlace).dashboard
    if name is not None:
        return [defined(name, robot.spec.dashboard if robot is not None else None)], False
    place = line.spec.by(RobotPlace).field
    reference = place.field
    targets = resolve(reference, declared(place))
    of_all = robot is not None and robot.spec.valid is not None
    is_asked = line.spec.by(RobotValidity).valid is not None
    values = [
        _defined(
            target,
            running=is_asked or (of_all and _is_of_program(target.field.name)),
            # What is known of the catalogue's type says nothing of another one.
            usual=usual_range(target.field.name, target.element) if place.type is None else None,
        )
        for target in targets
    ]
    return values, reference.many or len(targets) > 1


def declared(place: RobotField) -> FieldDeclaration:
    """What a line says of its field besides the name."""
    is_input = None if place.direction is None else place.direction == "input"
    return FieldDeclaration(DataType.from_word(place.type) if place.type is not None else None, is_input)


def field_of(variable: ExpandedVariable) -> Field | None:
    """The catalogue's entry of the field that carries it; None if it has none."""
    return (INPUTS if variable.direction is Direction.INPUT else OUTPUTS).get(variable.field)


def type_of(variable: ExpandedVariable) -> DataType | None:
    """The type that is declared for the field that carries it; None where the catalogue says it."""
    if variable.via:
        return None
    is_bit_register = not variable.target.startswith(variable.field)
    return None if is_bit_register else declared(variable.spec.by(RobotPlace).field).type


def is_program_output(variable: ExpandedVariable) -> bool:
    """Whether it is an output register, which only the robot program writes."""
    return _is_of_program(variable.field)


def _is_of_program(field: str) -> bool:
    return field.startswith(_OUTPUT_REGISTER)


def _defined(target: Target, *, running: bool, usual: Range | None) -> Defined:
    field = target.field.name
    direction = Direction.INPUT if target.is_input else Direction.OUTPUT
    low, high = INTEGER_RANGES.get(target.type.code, (None, None))
    is_output = direction is Direction.OUTPUT
    return Defined(
        target=target.name,
        direction=direction,
        field=field,
        type=target.type.word,
        kind=_kind(target.type),
        low=low,
        high=high,
        bit=target.bit,
        element=target.element,
        usual=usual,
        valid_running=is_output and running,
        grows=field in _GROWING,
        moves=field in _MOVING,
        counterpart=_counterpart(target) if is_output else _reported(target),
    )


def _kind(data_type: DataType) -> ValueKind:
    if data_type is DataType.BOOL:
        return ValueKind.BOOL
    return ValueKind.INT if data_type.bits is not None else ValueKind.FLOAT


def _reported(target: Target) -> str:
    """The output register of the same number; empty for inputs that are no registers."""
    return f"output_{target.name.removeprefix('input_')}" if target.name.startswith("input_") else ""


def _counterpart(target: Target) -> str:
    if _is_of_program(target.name):
        return f"input_{target.name.removeprefix(_OUTPUT_REGISTER)}"
    return _COUNTERPARTS.get(target.field.name, "input_int_register_0")
