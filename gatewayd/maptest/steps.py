"""One step of a test with a plant: time passes, something happens, and what came of it is compared."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import isclose
from typing import Any, Final, NamedTuple

from gatewayd.core.definition import OPERATOR, Value
from gatewayd.core.refusal import Refusal
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Part
from gatewayd.mapping.testing import FREE, OPERATOR_NAME, StepSpec, action_of
from gatewayd.maptest.actions import CellNames, act, reason_of
from gatewayd.maptest.explanation import Explanation
from gatewayd.maptest.plant import Plant
from gatewayd.report.format import exact

_PRECISION: Final = 1e-9
"""By what part of itself a real may differ from what is expected: scales are decimal, the robot's doubles are not."""


@dataclass(frozen=True, slots=True)
class FailedStep:
    """One thing that is not as a test says."""

    position: Position
    step: int
    """Counted from 1."""
    message: str
    """What was expected, and what is."""
    hint: str


class _Found(NamedTuple):
    position: Position
    message: str
    hint: str


def run_step(plant: Plant, names: CellNames, number: int, part: Part[StepSpec]) -> list[FailedStep]:
    """Carry a step out; returns what is not as it says, the answer to its request first."""
    step = part.spec
    if step.after is not None:
        plant.wait(step.after, [names.writers[name] for name in step.alive or ()])
    refusal = act(plant, names, step)
    found = [*_answers(plant, names, part, refusal), *_mismatches(plant, names, part)]
    return [FailedStep(step.position, number, step.message, step.hint) for step in found]


def value_of(plant: Plant, index: int) -> Value:
    """What the robot is given, or what a fieldbus is shown."""
    return plant.cell.image.values[index]


def owner_of(plant: Plant, index: int) -> str:
    """Who owns a variable, as `owner` of a step names it."""
    lock = plant.cell.definition.variables[index].lock
    owner = plant.cell.ownership.owners[lock] if lock is not None else None
    if owner is None:
        return FREE
    return OPERATOR_NAME if owner == OPERATOR else plant.cell.definition.writers[owner].name


def quality_of(plant: Plant, index: int) -> str:
    """The quality, as `quality` of a step names it."""
    return plant.cell.image.quality[index].name.lower()


# -- the answer to a request ------------------------------------------------------------------------------------------


def _answers(
    plant: Plant, names: CellNames, part: Part[StepSpec], refusal: Refusal | None
) -> Iterator[_Found]:
    step, reason = part.spec, reason_of(refusal)
    if reason == step.refused:
        return
    if refusal is None:
        message = f"expected the request to be refused ({step.refused}), but it was accepted"
        yield _Found(part.at("refused"), message, _after(plant, names, step))
        return
    why = plant.explanation.refusal(refusal)
    if step.refused is None:
        place, message = part.key_at(action_of(step) or ""), f"the request was refused: {why}"
    else:
        place = part.at("refused")
        message = f"expected the request to be refused ({step.refused}), but it was for another reason: {why}"
    yield _Found(place, message, f"if that is meant, write `refused: {reason}`")


def _after(plant: Plant, names: CellNames, step: StepSpec) -> str:
    """Who owns what a request was about, now that it was accepted."""
    asked = [*(step.write or step.force or ()), *(step.take or step.release or ())]
    owners = dict.fromkeys(plant.explanation.owner(lock) for lock in names.locks(asked))
    return f"after it: {', '.join(owners)}" if owners else "remove `refused`"


# -- what is expected -------------------------------------------------------------------------------------------------


class _Comparison(NamedTuple):
    present: Callable[[Plant, int], Any]
    same: Callable[[Any, Any], bool]
    subject: str
    """What is compared, with the place of the name."""
    circumstances: Callable[[Explanation, int], str]
    hint: Callable[[Explanation, int], str]


def _same_value(value: Value, expected: Value) -> bool:
    return value == expected or isclose(value, expected, rel_tol=_PRECISION, abs_tol=_PRECISION)


def _same_word(value: str, expected: str) -> bool:
    return value == expected


_COMPARED: Final = {
    "expect": _Comparison(value_of, _same_value, "{}", Explanation.circumstances, Explanation.hint),
    "owner": _Comparison(
        owner_of, _same_word, "the owner of {} to be", Explanation.circumstances, Explanation.hint
    ),
    "quality": _Comparison(
        quality_of, _same_word, "the quality of {} to be", Explanation.source, Explanation.quality_hint
    ),
}
"""By key of a step."""


def _mismatches(plant: Plant, names: CellNames, part: Part[StepSpec]) -> Iterator[_Found]:
    for key, compared in _COMPARED.items():
        table: Mapping[str, Any] = getattr(part.spec, key) or {}
        for name, expected in table.items():
            index = names.variables[name]
            value = compared.present(plant, index)
            if not compared.same(value, expected):
                subject = compared.subject.format(name)
                why = compared.circumstances(plant.explanation, index)
                message = f"expected {subject} {_text(expected)}, is {_text(value)} ({why})"
                yield _Found(part.at(key, name), message, compared.hint(plant.explanation, index))


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return exact(value) if isinstance(value, (int, float)) else str(value)
