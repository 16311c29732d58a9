"""Rules GW7xx: conversions between the robot's types and those of the registers that lose something."""

from __future__ import annotations

from collections.abc import Iterator
from math import isclose, isfinite

from gatewayd.core.definition import Direction, ValueKind
from gatewayd.links.modbus_places.placing import ExpandedPlacement, PlacementProblem, all_placements
from gatewayd.links.modbus_places.rules.wording import first_of_each_line, where, wrong
from gatewayd.mapping.diagnostics import Diagnostic, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.modbus.codec import TYPES, Codec, turns
from gatewayd.report.format import counted
from gatewayd.report.wording import number

_FLOAT_DIGITS = {"float32": 1 << 24, "float64": 1 << 53}
"""Integers up to here survive in a real of the type."""
_MIN_STEPS = 10


@cell_rule("GW701", Severity.WARNING)
def time_in_float32(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """The controller's time in a float32."""
    for placement in _numbers(cell):
        if placement.type == "float32" and placement.variable.grows:
            name, place = placement.variable.name, where(placement)
            message = f"`{name}` grows without end, and float32 at {place} loses its last digits"
            yield rule.at(placement.key_position("type"), message, hint="use `type: float64`")


@cell_rule("GW702", Severity.WARNING)
def fraction_lost(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A real in an integer type without a scale."""
    for placement in _numbers(cell, ValueKind.FLOAT):
        if _is_integer(placement) and placement.spec.scale is None:
            message = (
                f"`{placement.variable.name}` is a real, but {placement.type} at {where(placement)} "
                "shows whole numbers only"
            )
            hint = "add a scale such as `scale: 0.001`, or `scale: 1` if whole numbers are meant"
            yield rule.at(placement.key_position("type"), message, hint=hint)


@cell_rule("GW703", Severity.WARNING)
def narrow_integer(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An integer from the robot in a register too small for it."""
    for placement in _numbers(cell, ValueKind.INT):
        variable, bounds, (low, high) = placement.variable, placement.variable.range, _reach(placement)
        if variable.direction is Direction.INPUT or bounds is None or not _is_integer(placement):
            continue
        if bounds[0] < low or bounds[1] > high:
            message = (
                f"`{variable.name}` can be {number(bounds[0])} to {number(bounds[1])}, "
                f"but {placement.type} at {where(placement)} shows {number(low)} to {number(high)}"
            )
            hint = "use a wider type, or state the range with `limits: [least, greatest]`"
            yield rule.at(placement.key_position("type"), message, hint=hint)


@cell_rule("GW713", Severity.WARNING)
def field_not_shown(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A real in registers that can never show what its field holds."""
    reported: set[int] = set()
    for placement in all_placements(cell):
        variable, bounds = placement.variable, placement.variable.range
        if placement.codec is None or variable.kind is not ValueKind.FLOAT or not _is_integer(placement):
            continue
        # Towards the robot limits are the mapping's own wish: GW704 and GW705 look after it.
        is_wish = variable.direction is Direction.INPUT and variable.spec.limits is not None
        if bounds is None or bounds[0] >= bounds[1] or is_wish or id(placement.spec) in reported:
            continue
        loss = _loss(placement, bounds)
        if loss is not None:
            reported.add(id(placement.spec))
            low, high = map(number, bounds)
            message = f"`{variable.name}` ({variable.target}) goes from {low} to {high}, but {loss[0]}"
            yield rule.at(placement.key_position("scale"), message, hint=loss[1])


def _loss(placement: ExpandedPlacement, bounds: tuple[float, float]) -> tuple[str, str] | None:
    """What is wrong with a place for values between these bounds, and the remedy."""
    low, high = _reach(placement)
    slack = abs(placement.scale) / 2
    span = bounds[1] - bounds[0]
    form = f"{placement.type} at {where(placement)}"
    shows = f"{form} shows {number(low)} to {number(high)}"
    if bounds[0] < 0 <= low and bounds[0] < low - slack:
        return (
            f"{shows}: everything below becomes 0" if low == 0 else shows,
            "use a signed type such as int16",
        )
    if bounds[0] < low - slack or bounds[1] > high + slack:
        return (
            shows,
            "use a wider type or a coarser scale, or state the range with `limits: [least, greatest]`",
        )
    steps = span / abs(placement.scale)
    if placement.spec.scale is not None and steps < _MIN_STEPS:
        text = f"scale {number(placement.scale)} leaves {counted(int(steps) + 1, 'value')} of it to {form}"
        return text, f"robot value = raw * scale: use a finer scale such as {number(_fine(span))}"
    return None


@cell_rule("GW714", Severity.WARNING)
def limit_between_steps(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A limit between two numbers of the register."""
    for placement in _numbers(cell, ValueKind.FLOAT):
        variable, limits = placement.variable, placement.variable.spec.limits
        if variable.direction is Direction.OUTPUT or limits is None or not _is_integer(placement):
            continue
        if limits[1] - limits[0] < _MIN_STEPS * abs(placement.scale):
            continue  # GW704, or GW608
        for limit in limits:
            raw = (limit - placement.offset) / placement.scale
            if not _within_type(raw, placement) or isclose(raw, round(raw), abs_tol=1e-6):
                continue
            nearest = round(raw)
            meant = nearest * placement.scale + placement.offset
            message = (
                f"the limit {number(limit)} of `{variable.name}` lies between two values of {placement.type} "
                f"with scale {number(placement.scale)}: {nearest} ({number(meant)}) is the nearest"
            )
            is_zero = isclose(meant, 0, abs_tol=1e-9 * abs(placement.scale))
            message += ", and stays 0" if is_zero else f", and means {number(limit)}"
            hint = f"write {number(meant)} as limit, or use a finer scale"
            yield rule.at(variable.at("limits"), message, hint=hint)
            break


def _within_type(raw: float, placement: ExpandedPlacement) -> bool:
    low, high = placement.ends
    return low <= raw <= high


@cell_rule("GW704", Severity.WARNING)
def coarse_scale(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A scale too coarse for the limits."""
    for placement in _numbers(cell, ValueKind.FLOAT):
        limits = placement.variable.spec.limits
        if limits is None or placement.spec.scale is None or not _is_integer(placement):
            continue
        span = limits[1] - limits[0]
        steps = span / abs(placement.scale)
        if 0 < steps < _MIN_STEPS:
            message = (
                f"the scale {number(placement.scale)} leaves {counted(int(steps) + 1, 'value')} of "
                f"`{placement.variable.name}` between {number(limits[0])} and {number(limits[1])}"
            )
            hint = f"robot value = raw * scale: use a finer scale such as {number(_fine(span))}"
            yield rule.at(placement.key_position("scale"), message, hint=hint)


def _fine(span: float) -> float:
    """A power of ten that makes at least a thousand steps of `span`."""
    scale = 1.0
    while span / scale < 1000 and scale > 1e-9:
        scale /= 10
    return scale


@cell_rule("GW705", Severity.WARNING)
def limit_not_reachable(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A limit that the register type cannot express."""
    for placement in _numbers(cell):
        variable, limits = placement.variable, placement.variable.spec.limits
        if variable.direction is Direction.OUTPUT or limits is None or placement.type == "bool":
            continue
        low, high = _reach(placement)
        slack = abs(placement.scale) / 2
        # What the robot's own type excludes is GW609.
        least = limits[0] if variable.low is None else max(limits[0], variable.low)
        most = limits[1] if variable.high is None else min(limits[1], variable.high)
        if least < low - slack or most > high + slack:
            message = (
                f"`{variable.name}` may be {number(limits[0])} to {number(limits[1])}, "
                f"but {placement.type} with scale {number(placement.scale)} reaches {number(low)} to {number(high)}"
            )
            hint = "use a wider type or a coarser scale, or narrow the limits"
            yield rule.at(placement.key_position("type"), message, hint=hint)


@cell_rule("GW706")
def scale_of_zero(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A scale of zero."""
    for placement in wrong(cell, PlacementProblem.SCALE_OF_ZERO):
        message = f"`{placement.variable.name}` has the scale 0"
        yield rule.at(
            placement.key_position("scale"), message, hint="leave `scale` out, or write for example 0.1"
        )


@cell_rule("GW707")
def scaled_bit(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Scale, offset or order at a bit."""
    for placement in first_of_each_line(all_placements(cell)):
        spec = placement.spec
        keys = [key for key in ("scale", "offset") if getattr(spec, key) is not None]
        whole = placement.codec is not None and placement.variable.kind is ValueKind.BOOL and keys
        if placement.problem is PlacementProblem.SCALED_BIT or whole:
            key = keys[0] if keys else "order"
            message = f"`{placement.variable.name}` is a bit and has `{key}`"
            yield rule.at(placement.key_position(key), message, hint=f"remove `{key}`")


@cell_rule("GW712", Severity.WARNING)
def order_without_effect(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An order that means nothing for a type of one register."""
    for placement in _numbers(cell):
        order = placement.spec.order
        if order in (None, "ABCD") or turns(order, placement.type):
            continue
        name = placement.variable.name
        message = f"`{name}` is {placement.type} at {where(placement)}, and `order: {order}` changes nothing"
        hint = "remove `order`: a `bool` is 0 or 1"
        if placement.type != "bool":
            hint = "remove `order`, or write BADC to swap the two bytes"
        yield rule.at(placement.key_position("order"), message, hint=hint)


@cell_rule("GW708", Severity.WARNING)
def uneven_scale(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An integer with a scale that does not come out even."""
    for placement in _numbers(cell, ValueKind.INT):
        variable = placement.variable
        if placement.type == "bool":
            continue
        if variable.direction is Direction.INPUT:
            even = _whole(placement.scale) and _whole(placement.offset)
        else:
            even = TYPES[placement.type].is_real or (
                _whole(1 / placement.scale) and _whole(placement.offset / placement.scale)
            )
        if not even:
            message = (
                f"`{variable.name}` is a whole number, which scale {number(placement.scale)} "
                f"and offset {number(placement.offset)} round"
            )
            key = "scale" if placement.spec.scale is not None else "offset"
            hint = "leave scale and offset out, or choose them so that every value comes out even"
            yield rule.at(placement.key_position(key), message, hint=hint)


def _whole(value: float) -> bool:
    return isfinite(value) and isclose(value, round(value), rel_tol=1e-9)


@cell_rule("GW709", Severity.WARNING)
def integer_in_real(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An integer in a real that has too few digits for it."""
    for placement in _numbers(cell, ValueKind.INT):
        variable, digits = placement.variable, _FLOAT_DIGITS.get(placement.type)
        bounds = variable.range
        if digits is None or bounds is None:
            continue
        if max(-bounds[0], bounds[1]) > digits:
            message = (
                f"`{variable.name}` can be {number(bounds[0])} to {number(bounds[1])}, "
                f"but {placement.type} is exact only up to {digits}"
            )
            hint = "use an integer type, or state the range with `limits: [least, greatest]`"
            yield rule.at(placement.key_position("type"), message, hint=hint)


@cell_rule("GW710", Severity.WARNING)
def number_as_bool(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A number shown as 0 or 1."""
    for placement in _numbers(cell):
        variable = placement.variable
        if placement.type == "bool" and variable.kind is not ValueKind.BOOL:
            message = f"`{variable.name}` is a number ({variable.type}), but bool at {where(placement)} shows 0 or 1"
            hint = f"use a number type, or map one bit, `{variable.target}.N`"
            yield rule.at(placement.key_position("type"), message, hint=hint)


@cell_rule("GW711", Severity.WARNING)
def fallback_not_shown(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A stale value that the register cannot show."""
    for placement in _numbers(cell):
        variable = placement.variable
        value, codec = variable.spec.on_stale.value, placement.codec
        if variable.direction is Direction.INPUT or value is None or isinstance(value, bool) or codec is None:
            continue
        shown = _round_trip(codec, value)
        if shown is None or abs(shown - value) > abs(placement.scale) / 2 + 1e-6 * abs(value):
            message = (
                f"`{variable.name}` is to be {number(value)} when stale, "
                f"but {placement.type} at {where(placement)} shows {'nothing' if shown is None else number(shown)}"
            )
            hint = "use a value that the register can show, or another type"
            yield rule.at(variable.at("on_stale"), message, hint=hint)


def _round_trip(codec: Codec, value: float) -> float | None:
    shown = codec.decode(codec.encode(value))
    return None if shown is None or not isfinite(shown) else float(shown)


def _numbers(cell: ExpandedCell, kind: ValueKind | None = None) -> Iterator[ExpandedPlacement]:
    """The first of each line that lies in whole registers and has a codec; of one kind, or of all."""
    for placement in first_of_each_line(all_placements(cell)):
        if placement.codec is not None and kind in (None, placement.variable.kind):
            yield placement


def _is_integer(placement: ExpandedPlacement) -> bool:
    """Whether the register type is one of whole numbers."""
    return not TYPES[placement.type].is_real and placement.type != "bool"


def _reach(placement: ExpandedPlacement) -> tuple[float, float]:
    """Least and greatest robot value that the register can express."""
    low, high = placement.ends
    ends = (low * placement.scale + placement.offset, high * placement.scale + placement.offset)
    return min(ends), max(ends)
