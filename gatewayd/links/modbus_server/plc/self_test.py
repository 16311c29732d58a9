"""What the PLC's half of the self test goes through: its registers of the robot program, and the two bits that lead."""

from __future__ import annotations

from collections.abc import Sequence

from gatewayd.core.definition import CellDefinition
from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plc.model import RegisterTag, SelfTestPlan, TestedTag
from gatewayd.links.robot_program import register_number, self_test_rounds, values_of
from gatewayd.report.wording import did_you_mean


def self_test_plan(
    text: str, inputs: Sequence[RegisterTag], outputs: Sequence[RegisterTag], cell: CellDefinition
) -> SelfTestPlan:
    """The plan with the handshake `TOGGLE:ACKNOWLEDGE`, both names of the mapping.

    Raises ExportError where that is no handshake towards the robot by which this PLC can lead, and where nothing is
    left to be tested.
    """
    first, separator, second = text.partition(":")
    if not separator:
        raise ExportError(f"--handshake {text}: name two bits, TOGGLE:ACKNOWLEDGE")
    toggle = _bit(first, inputs, cell, f"--handshake {text}: the toggle is a bit that this PLC writes")
    acknowledge = _bit(
        second, outputs, cell, f"--handshake {text}: the acknowledgement is a bit of the robot"
    )
    written = _tested(inputs, toggle, cell)
    compared = _tested(outputs, acknowledge, cell)
    if not (written or compared):
        raise ExportError(
            f"--handshake {text}: the robot program has no other registers that could be tested"
        )
    return SelfTestPlan(toggle, acknowledge, self_test_rounds(cell), written, compared)


def _bit(name: str, tags: Sequence[RegisterTag], cell: CellDefinition, rule: str) -> RegisterTag:
    found = {tag.name: tag for tag in tags if tag.type == "BOOL" and _is_register(tag, cell)}
    if name not in found:
        raise ExportError(f"{rule}: {did_you_mean(name, found, f'`{name}` is none')}")
    return found[name]


def _tested(tags: Sequence[RegisterTag], bit: RegisterTag, cell: CellDefinition) -> tuple[TestedTag, ...]:
    return tuple(
        TestedTag(tag, values_of(cell.variables[tag.number - 1]))
        for tag in tags
        if tag.number != bit.number and _is_register(tag, cell)
    )


def _is_register(tag: RegisterTag, cell: CellDefinition) -> bool:
    return register_number(cell.variables[tag.number - 1]) is not None
