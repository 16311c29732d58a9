"""Rules GW202, GW204, GW209, GW211, GW222 and GW229: places in Modbus areas that cannot hold what they are to hold."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.modbus_places.placing import PlacementProblem, all_placements
from gatewayd.links.modbus_places.rules.wording import AREA_WORDS, first_of_each_line, where, wrong
from gatewayd.mapping.diagnostics import Diagnostic, Rule
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.modbus.areas import AREA_NAMES, Area

_LAST_ADDRESS = 0xFFFF
_TRADITIONAL = {
    Area.HOLDING: range(40001, 50000),
    Area.INPUT: range(30001, 40000),
    Area.DISCRETE: range(10001, 20000),
}


@cell_rule("GW202")
def beyond_last_address(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A value that runs past address 65535."""
    for placement in wrong(cell, PlacementProblem.BEYOND_END):
        last = placement.address + placement.words - 1
        message = (
            f"`{placement.variable.name}` would lie at {AREA_WORDS[placement.area]}s {placement.address} "
            f"to {last}, but the last address is {_LAST_ADDRESS} ({placement.area.notation(_LAST_ADDRESS)})"
        )
        hint = "begin the line at a lower address"
        yield rule.at(placement.position, message, hint=hint)


@cell_rule("GW204")
def traditional_address(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An address that looks like 40001 counting."""
    for placement in first_of_each_line(all_placements(cell)):
        address = placement.spec.address
        if address in _TRADITIONAL.get(placement.area, ()):
            meant = address - _TRADITIONAL[placement.area].start
            message = (
                f"address {address} of `{placement.variable.part.name}` looks like the {address} of a manual"
            )
            hint = (
                f"addresses count from 0: for the manual's {address} write {meant} "
                f"({placement.area.notation(meant)})"
            )
            yield rule.at(placement.position, message, hint=hint)


@cell_rule("GW209")
def number_in_bit(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A number in a place that holds a single bit."""
    for placement in wrong(cell, PlacementProblem.NUMBER_IN_BIT):
        variable = placement.variable
        message = (
            f"`{variable.name}` is a number ({variable.field}, {variable.type}) "
            f"and cannot lie in {where(placement)}"
        )
        area = "holding" if placement.area in (Area.COIL, Area.HOLDING) else "input"
        hint = f"give it whole registers, {{{area}: N}}, or map one bit of it, `{variable.target}.N`"
        yield rule.at(placement.position, message, hint=hint)


@cell_rule("GW211")
def bit_without_place(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Type bit at a whole register."""
    for placement in wrong(cell, PlacementProblem.BIT_WITHOUT_PLACE):
        message = f"`{placement.variable.name}` has the type bit, but {where(placement)} is a whole register"
        hint = f"write the bit, {AREA_NAMES[placement.area]}: {placement.address}.0, or type: bool"
        yield rule.at(placement.position, message, hint=hint)


@cell_rule("GW229")
def byte_type(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A byte that is no int8 or uint8, or one of these in a whole register."""
    for placement in wrong(cell, PlacementProblem.BYTE_TYPE):
        name, area = placement.variable.name, AREA_NAMES[placement.area]
        register = f"{AREA_WORDS[placement.area]} {placement.address}"
        if placement.spec.is_byte:
            message = f"`{name}` has the type {placement.type} in a byte of {register}"
            hint = (
                f"write `type: uint8` or `type: int8`, or the whole register, {{{area}: {placement.address}}}"
            )
        else:
            message = f"`{name}` has the type {placement.type}, but {register} is a whole one"
            hint = f"write the byte, {{{area}: {placement.address}.high}} or {placement.address}.low, or a 16-bit type"
        yield rule.at(placement.position, message, hint=hint)


@cell_rule("GW222")
def type_of_bit(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A number type for a place that holds a single bit."""
    for placement in wrong(cell, PlacementProblem.TYPE_IN_BIT):
        message = f"`{placement.variable.name}` has the type {placement.spec.type} at {where(placement)}"
        yield rule.at(placement.position, message, hint="leave `type` out")
