"""From the values of some fields to a whole input package: nothing is sent that was not given or is known to be there.

A package of a recipe has a value for every field. Registers that are not given keep what they hold; a mask that is not
given is 0, and what it does not select may be anything, as it does nothing (guide, section "Field names and associated
types", inputs). Everything else has to be given.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping

from gatewayd.rtde.api.errors import WriteRefusedError, wrong_count
from gatewayd.rtde.api.sample import Value
from gatewayd.rtde.companions import COMPANIONS, MASK_BITS
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.types import INTEGER_RANGES, DataType

Elements = tuple[Scalar, ...]

_MASKS = frozenset(needs.mask for needs in COMPANIONS.values())
_SELECTED_BY: dict[str, tuple[str, int]] = {
    name: (needs.mask, -1 if needs.bit is None else 1 << needs.bit) for name, needs in COMPANIONS.items()
} | {needs.type: (needs.mask, -1) for needs in COMPANIONS.values() if needs.type is not None}
"""Field that acts through a mask -> the mask, and the bits of it that select the field."""
_RATIOS = frozenset(name for name, needs in COMPANIONS.items() if needs.bit is not None)
_FINITE = frozenset({"external_force_torque"})
"""Real inputs that act by themselves; a register may carry NaN, which is the program's affair."""


def elements(name: str, value: Value | Iterable[Scalar], kind: DataType) -> Elements:
    """The elements of a value of this type; ValueError or TypeError says what does not fit."""
    given: object = value
    if not isinstance(given, bool | int | float | Iterable):
        message = f"{name} is {kind.word} and does not take {given!r}"
        raise TypeError(message)
    flat: Elements = (value,) if isinstance(value, bool | int | float) else tuple(value)
    if len(flat) != kind.count:
        raise ValueError(wrong_count(name, flat, kind.count))
    for element in flat:
        _check(name, element, kind)
    try:
        return tuple(map(float, flat)) if kind.code == "d" else flat
    except OverflowError as error:
        message = f"{name} is {kind.word} and cannot hold so large a number"
        raise ValueError(message) from error


def _check(name: str, value: object, kind: DataType) -> None:
    if kind.code == "?":
        if not isinstance(value, bool):
            message = f"{name} is BOOL: True or False, not {value!r}"
            raise TypeError(message)
        return
    if isinstance(value, bool) or not isinstance(value, int if kind.code in INTEGER_RANGES else int | float):
        message = f"{name} is {kind.word} and does not take {value!r}"
        raise TypeError(message)
    low, high = INTEGER_RANGES.get(kind.code, (-math.inf, math.inf))
    if not low <= value <= high and not (isinstance(value, float) and math.isnan(value)):
        message = f"{name} is {kind.word} and holds {low} to {high}, not {value!r}"
        raise ValueError(message)
    if name in _FINITE and not -math.inf < value < math.inf:
        message = f"{name} takes finite numbers, not {value!r}"
        raise ValueError(message)
    if name in MASK_BITS and int(value) & ~MASK_BITS[name]:
        message = (
            f"{name} has no bits but {MASK_BITS[name]:#b}, and {value!r} sets others, which select nothing"
        )
        raise ValueError(message)
    if name in _RATIOS and not 0 <= value <= 1:
        message = f"{name} is a share from 0 to 1, not {value!r}"
        raise ValueError(message)


def complete(
    key: str, recipe: Recipe, given: Mapping[str, Elements], known: Callable[[str], Elements | None]
) -> Elements:
    """The flat values of a package of `recipe` (called `key`) that writes what is given.

    `known` tells what a field holds; None: nobody knows. WriteRefusedError names every field that is in the way.
    """
    values: dict[str, Elements] = {}
    problems: dict[str, str] = {}
    for name, kind in recipe.kinds.items():
        found = given.get(name)
        if found is None:
            found = _left_alone(name, kind, given, known)
        elif problem := _idle(name, given):
            problems[name] = problem
        if found is None:
            problems[name] = _missing(name, given)
        else:
            values[name] = found
    if problems:
        raise WriteRefusedError(key, problems)
    return tuple(element for name in recipe.names for element in values[name])


def _left_alone(
    name: str, kind: DataType, given: Mapping[str, Elements], known: Callable[[str], Elements | None]
) -> Elements | None:
    """What to send for a field that was not given, so that nothing changes by it; None: there is no such value."""
    if name in _MASKS:
        return (0,)
    if name in _SELECTED_BY:
        return None if _selected(name, given) else (0.0 if kind.code == "d" else 0,)
    return known(name)


def _selected(name: str, given: Mapping[str, Elements]) -> bool:
    mask, bits = _SELECTED_BY[name]
    return bool(int(given.get(mask, (0,))[0]) & bits)


def _idle(name: str, given: Mapping[str, Elements]) -> str:
    """Why a given value would do nothing; empty if it acts."""
    if name not in _SELECTED_BY or _selected(name, given):
        return ""
    return f"does nothing as {_SELECTED_BY[name][0]} does not select it: give the mask too, or use the helper for it"


def _missing(name: str, given: Mapping[str, Elements]) -> str:
    if name in _SELECTED_BY:
        return f"{_SELECTED_BY[name][0]} = {given[_SELECTED_BY[name][0]][0]} selects it, and it was not given"
    return (
        "was not given, and what it holds is not known: give it too, or put it in an input recipe of its own"
    )
