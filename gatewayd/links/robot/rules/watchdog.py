"""Rules GW302, GW311 and GW515: the watchdog of the robot program."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.robot.language import LANGUAGE
from gatewayd.links.robot.rules.controller import watchdog_field as fed_field
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.mapping.rules.writers import is_supervised
from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.types import DataType

_WATCHDOG_TYPES = (DataType.INT32, DataType.DOUBLE)


@cell_rule("GW302")
def watchdog_field(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A watchdog on a field that cannot be fed."""
    watchdog = fed_field(cell.document)
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


@cell_rule("GW311")
def watchdog_mapped(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A variable on the register of the watchdog."""
    watchdog = fed_field(cell.document)
    if watchdog is None:
        return
    for variable in cell.variables:
        if variable.field == watchdog[0]:
            message = f"`{variable.name}` writes {variable.target}, which the gateway feeds as the watchdog"
            related = (Related(watchdog[1], "the watchdog is here"),)
            hint = "use another register for one of the two"
            yield rule.at(variable.at("robot"), message, hint=hint, related=related)
            return


@cell_rule("GW515", Severity.WARNING)
def unsupervised_watchdog(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A watchdog that requires a writer without a timeout."""
    for required in LANGUAGE.names_writers(cell.document):
        writer = cell.document.writers.get(required.name)
        if writer is not None and not is_supervised(writer.spec):
            message = f"the watchdog requires `{writer.name}`, which has no timeout"
            related = (Related(writer.key, f"`{writer.name}` is here"),)
            hint = f"add `timeout: 1s` to `{writer.name}`"
            yield rule.at(required.position, message, hint=hint, related=related)
