"""Which variables a session does not serve, and why: fields refused, and types other than the mapping was made for.

The controller's own types are the truth: a variable whose field turns out to be of another type is left alone instead
of being read or written wrongly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from gatewayd.core.definition import Direction, ValueKind, Variable
from gatewayd.links.robot.companions import DOMAINS
from gatewayd.rtde.companions import COMPANIONS
from gatewayd.rtde.session import Session
from gatewayd.rtde.types import INTEGER_RANGES, DataType


def unavailable(
    session: Session, variables: Sequence[Variable], declared: Mapping[str, str] = MappingProxyType({})
) -> dict[int, str]:
    """Reason by variable index, in the controller's word and with its likely cause.

    `declared` are the types that the mapping declares for fields, by their words.
    """
    refused = {
        (missing.field, missing.output): f"{missing.word}: {missing.hint}" for missing in session.unavailable
    }
    recipes = [session.outputs, *(claimed.recipe for claimed in session.inputs.values())]
    types = {name: kind for recipe in recipes for name, kind in recipe.kinds.items()}
    reasons: dict[int, str] = {}
    for index, variable in enumerate(variables):
        reason = (
            refused.get((variable.field, variable.direction is Direction.OUTPUT))
            or _misfit(variable, types, declared)
            or _domain_unknown(session, variable, variables, refused)
        )
        if reason is not None:
            reasons[index] = reason
    return reasons


def _misfit(variable: Variable, types: Mapping[str, DataType], declared: Mapping[str, str]) -> str | None:
    """Why the type that the controller answered cannot carry the variable; None if it can, or answered none."""
    answered, word = types.get(variable.field), declared.get(variable.field)
    if answered is None:
        return None
    if word is not None:
        is_other = answered.word != word
        return (
            f"the controller answers {answered.word}, but the mapping declares {word}" if is_other else None
        )
    if _carries(answered, variable):
        return None
    return f"the controller answers {answered.word}, which is not what the mapping was made for"


def _domain_unknown(
    session: Session,
    variable: Variable,
    variables: Sequence[Variable],
    refused: Mapping[tuple[str, bool], str],
) -> str | None:
    """Why a value would act in a domain that nobody asked for: its type can be neither chosen nor kept."""
    needs = COMPANIONS.get(variable.field) if variable.direction is Direction.INPUT else None
    if needs is None or needs.type is None:
        return None
    if not any(needs.type in accepted.recipe.names for accepted in session.inputs.values()):
        why = refused.get((needs.type, False), "not claimed")
        return f"current or voltage cannot be chosen without {needs.type}: {why}"
    chosen = any(variable.field == needs.type and variable.bit in (None, needs.bit) for variable in variables)
    if chosen or DOMAINS in session.outputs.names:
        return None
    return f"whether it is current or voltage is neither mapped ({needs.type}) nor sent by the controller ({DOMAINS})"


def _carries(answered: DataType, variable: Variable) -> bool:
    width = answered.bits
    if (variable.element or 0) >= answered.count:
        return False
    if variable.bit is not None:
        return width is not None and variable.bit < width
    if variable.kind is ValueKind.INT:
        return (variable.low, variable.high) == INTEGER_RANGES.get(answered.code)
    return width is None and (answered.code == "?") == (variable.kind is ValueKind.BOOL)
