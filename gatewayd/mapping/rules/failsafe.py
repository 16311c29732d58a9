"""Rules GW6xx: what happens when a side is lost, and what values are let through."""

from __future__ import annotations

import re
from collections.abc import Iterator

from gatewayd.core.definition import Direction, FallbackKind, ValueKind
from gatewayd.links.registry import languages
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.mapping.rules.writers import is_supervised
from gatewayd.report.wording import number

_MOTION_WORD = re.compile(
    "drive|enable|execute|go|home|jog|motion|move|play|resume|run|speed|start|step|velocity", re.IGNORECASE
)
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+")


@cell_rule("GW601")
def fallback_outside_limits(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A fallback value outside the limits."""
    for variable in _lines(cell):
        limits, value = variable.spec.limits, variable.spec.on_release.value
        if limits is None or value is None or isinstance(value, bool) or limits[0] > limits[1]:
            continue
        if not limits[0] <= value <= limits[1]:
            low, high = map(number, limits)
            message = (
                f"`{variable.part.name}` falls back to {number(value)}, outside its limits {low} to {high}"
            )
            related = (Related(variable.at("limits"), "the limits are here"),)
            hint = f"use a value from {low} to {high}"
            yield rule.at(variable.at("on_release"), message, hint=hint, related=related)


@cell_rule("GW602")
def fallback_type(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A fallback value that the variable cannot have."""
    for variable in _lines(cell):
        for key in ("on_release", "on_stale"):
            value = getattr(variable.spec, key).value
            expected = None if value is None else _mismatch(variable, value)
            if expected is not None:
                shown = str(value).lower() if isinstance(value, bool) else number(value)
                message = f"`{variable.part.name}` ({variable.target}, {variable.type}) cannot be {shown}"
                yield rule.at(variable.at(key), message, hint=f"write {expected}")


def _mismatch(variable: ExpandedVariable, value: float) -> str | None:
    """What should stand in the place of `value`; None where it fits."""
    if variable.kind is ValueKind.BOOL:
        return None if value in (0, 1) else "true or false"
    if isinstance(value, bool):
        return "a number"
    if variable.kind is ValueKind.FLOAT or variable.low is None or variable.high is None:
        return None
    fits = value == int(value) and variable.low <= value <= variable.high
    return None if fits else f"a whole number from {variable.low} to {variable.high}"


@cell_rule("GW603", Severity.WARNING)
def held_motion(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A motion command that stays on when its owner is lost."""
    for variable, silent in silent_motion(cell):
        if variable.spec.on_release.kind is FallbackKind.HOLD:
            message = (
                f"`{variable.part.name}` is held when its owner is lost, and `{silent}` is not supervised"
            )
            hint = f"use `on_release: clear`, or add `timeout: 1s` to `{silent}`"
            yield rule.at(variable.at("on_release"), message, hint=hint)


@cell_rule("GW604", Severity.WARNING)
def unsupervised_motion(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A motion command whose owner nobody supervises."""
    for variable, silent in silent_motion(cell):
        if variable.spec.on_release.kind is not FallbackKind.HOLD:
            writer = cell.document.writers[silent]
            message = f"`{variable.part.name}` looks like a motion command, and `{silent}` is not supervised"
            related = (Related(writer.key, f"`{silent}` has no timeout"),)
            hint = f"add `timeout: 1s` to `{silent}`, or `lease: 2s` to the variable"
            yield rule.at(variable.position, message, hint=hint, related=related)


def silent_motion(cell: ExpandedCell) -> Iterator[tuple[ExpandedVariable, str]]:
    """Motion commands that no lease bounds, and the first owner that could be lost unnoticed."""
    for variable in _lines(cell):
        if variable.lock is None or not _is_motion(variable):
            continue
        lock = cell.locks[variable.lock]
        silent = [name for name in lock.owners if not is_supervised(cell.document.writers[name].spec)]
        if lock.lease is None and silent:
            yield variable, silent[0]


def _is_motion(variable: ExpandedVariable) -> bool:
    return variable.moves or any(map(_MOTION_WORD.fullmatch, _WORD.findall(variable.part.name)))


@cell_rule("GW605")
def policy_of_other_side(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """On_stale or valid at an input, or on_release at an output."""
    policies = {key: what for language in languages() for key, what in language.output_policies.items()}
    for variable in _lines(cell):
        is_input = variable.direction is Direction.INPUT
        key, other = ("on_stale", "on_release") if is_input else ("on_release", "on_stale")
        if key in variable.spec.model_fields_set:
            message = (
                f"`{variable.part.name}` is an {variable.direction.value} ({variable.target}); "
                f"`{key}` has no effect on it"
            )
            yield rule.at(variable.part.key_at(key), message, hint=f"write `{other}`, or remove `{key}`")
        for key, what in policies.items():
            if is_input and key in variable.spec.model_fields_set:
                message = (
                    f"`{variable.part.name}` is an input ({variable.target}); `{key}` has no effect on it"
                )
                yield rule.at(variable.part.key_at(key), message, hint=f"remove `{key}`: {what}")


@cell_rule("GW608")
def limits_inverted(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Limits that no value can satisfy."""
    for variable in _lines(cell):
        limits = variable.spec.limits
        if limits is not None and limits[0] >= limits[1]:
            low, high = map(number, limits)
            message = f"the limits of `{variable.part.name}` begin at {low} and end at {high}"
            hint = f"write [{high}, {low}]" if limits[0] > limits[1] else "write two different numbers"
            yield rule.at(variable.at("limits"), message, hint=hint)


@cell_rule("GW609")
def limits_outside_type(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Limits beyond what the robot's register can hold."""
    for variable in _lines(cell):
        limits = variable.spec.limits
        if limits is None or variable.low is None or variable.high is None:
            continue
        if limits[0] < variable.low or limits[1] > variable.high:
            low, high = map(number, limits)
            message = (
                f"`{variable.part.name}` is limited to {low} to {high}, but {variable.target} holds "
                f"{variable.low} to {variable.high}"
            )
            yield rule.at(
                variable.at("limits"), message, hint=f"stay within {variable.low} to {variable.high}"
            )


@cell_rule("GW610")
def limits_without_effect(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Limits where nothing can be limited."""
    for variable in _lines(cell):
        if variable.kind is ValueKind.BOOL and variable.spec.limits is not None:
            message = f"`{variable.part.name}` is a bit ({variable.target}) and has limits"
            yield rule.at(variable.part.key_at("limits"), message, hint="remove `limits`")
        elif variable.direction is Direction.OUTPUT and variable.spec.clamp:
            message = f"`{variable.part.name}` comes from the robot and is never clamped"
            yield rule.at(variable.part.key_at("clamp"), message, hint="remove `clamp`")


@cell_rule("GW611", Severity.WARNING)
def clear_outside_limits(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A fallback of zero that the limits exclude."""
    for variable in _lines(cell):
        limits = variable.spec.limits
        if variable.direction is Direction.OUTPUT or variable.kind is ValueKind.BOOL or limits is None:
            continue
        if variable.spec.on_release.kind is not FallbackKind.CLEAR or limits[0] <= 0 <= limits[1]:
            continue
        if limits[0] < limits[1]:
            low, high = map(number, limits)
            name = variable.part.name
            message = f"`{name}` is cleared to 0, outside its limits {low} to {high}, when its owner is lost"
            hint = f"write `on_release: {low if limits[0] > 0 else high}`, or `on_release: hold`"
            written = "on_release" in variable.spec.model_fields_set
            yield rule.at(variable.at("on_release" if written else "limits"), message, hint=hint)


@cell_rule("GW612")
def clamp_without_limits(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Clamping without limits."""
    for variable in _lines(cell):
        if variable.spec.clamp and variable.spec.limits is None and variable.direction is Direction.INPUT:
            message = f"`{variable.part.name}` is to be clamped, but has no limits"
            hint = "add `limits: [least, greatest]`, or remove `clamp`"
            yield rule.at(variable.part.key_at("clamp"), message, hint=hint)


def _lines(cell: ExpandedCell) -> Iterator[ExpandedVariable]:
    """The first variable of each line: those of a family are alike in all that these rules judge."""
    for variable in cell.variables:
        if not variable.member:
            yield variable
