"""What can happen in a step of a test: one function for each key, and the names that steps use."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final, TypeAlias

from gatewayd.core.definition import CellDefinition, Value
from gatewayd.core.program import NUMBERS
from gatewayd.core.refusal import Refusal
from gatewayd.mapping.testing import OPERATOR_NAME, StepSpec, action_of
from gatewayd.maptest.plant import REPEAT, Plant


class CellNames:
    """The names of a cell, as steps use them, to the core's indices."""

    def __init__(self, definition: CellDefinition) -> None:
        self.variables = {variable.name: index for index, variable in enumerate(definition.variables)}
        self.writers = {writer.name: index for index, writer in enumerate(definition.writers)}
        self._groups = {lock.name: lock.members[0] for lock in definition.locks}
        self._locks = [variable.lock for variable in definition.variables]

    def values(self, values: Mapping[str, Value]) -> dict[int, Value]:
        """The same by index."""
        return {self.variables[name]: value for name, value in values.items()}

    def indices(self, names: Sequence[str]) -> list[int]:
        """Variables; a group stands for its first one, which has the same lock."""
        return [self.variables[name] if name in self.variables else self._groups[name] for name in names]

    def locks(self, names: Sequence[str]) -> list[int]:
        """Their locks, each once."""
        found = dict.fromkeys(self._locks[index] for index in self.indices(names))
        return [lock for lock in found if lock is not None]


def act(plant: Plant, names: CellNames, step: StepSpec) -> Refusal | None:
    """Do what a step says after its time has passed; why it was refused, if it was.

    A write that is repeated ends with the first answer that the step does not expect.
    """
    key = action_of(step)
    if key is None:
        return None
    refusal = _ACTIONS[key](plant, names, step)
    left = step.repeat_for or 0.0
    while left > 0 and reason_of(refusal) == step.refused:
        plant.wait(min(REPEAT, left))
        left = round(left - REPEAT, 6)
        refusal = _ACTIONS[key](plant, names, step)
    return refusal


def reason_of(refusal: Refusal | None) -> str | None:
    """The reason as `refused` of a step names it; None: it was accepted."""
    return refusal.reason.name.lower() if refusal is not None else None


def _write(plant: Plant, names: CellNames, step: StepSpec) -> Refusal | None:
    return plant.write(names.writers[step.by or ""], names.values(step.write or {}))


def _take(plant: Plant, names: CellNames, step: StepSpec) -> Refusal | None:
    if step.by == OPERATOR_NAME:
        plant.take_as_operator(names.locks(step.take or ()))
        return None
    return plant.take(names.writers[step.by or ""], names.indices(step.take or ()))


def _release(plant: Plant, names: CellNames, step: StepSpec) -> Refusal | None:
    if step.by == OPERATOR_NAME:
        plant.free_as_operator(names.locks(step.release or ()))
        return None
    return plant.release(names.writers[step.by or ""], names.indices(step.release or ()))


def _lost(plant: Plant, names: CellNames, step: StepSpec) -> None:
    for name in step.lost or ():
        plant.lose(names.writers[name])


def _connected(plant: Plant, names: CellNames, step: StepSpec) -> None:
    for name in step.connected or ():
        plant.connect(names.writers[name])


def _robot(plant: Plant, names: CellNames, step: StepSpec) -> None:
    if isinstance(step.robot, dict):
        plant.robot.show(names.values(step.robot), plant.now)
    elif step.robot is not None:
        _ROBOT[step.robot](plant)


_ROBOT: Final[dict[str, Callable[[Plant], None]]] = {
    "connected": lambda plant: plant.robot.connect(plant.now),
    "lost": lambda plant: plant.robot.lose(plant.now),
    "silent": lambda plant: plant.robot.fall_silent(),
    "restarted": lambda plant: plant.robot.restart(plant.now),
}


def _program(plant: Plant, _names: CellNames, step: StepSpec) -> None:
    plant.robot.run_program(NUMBERS[step.program or ""])
    plant.robot.report(plant.now)


def _force(plant: Plant, names: CellNames, step: StepSpec) -> Refusal | None:
    return plant.force(names.values(step.force or {}))


def _unforce(plant: Plant, names: CellNames, step: StepSpec) -> None:
    plant.unforce(names.indices(step.unforce or ()))


def _unavailable(plant: Plant, names: CellNames, step: StepSpec) -> None:
    plant.robot.give(names.indices(step.unavailable or ()), available=False, now=plant.now)


def _available(plant: Plant, names: CellNames, step: StepSpec) -> None:
    plant.robot.give(names.indices(step.available or ()), available=True, now=plant.now)


_Action: TypeAlias = Callable[[Plant, CellNames, StepSpec], Refusal | None]
_ACTIONS: Final[dict[str, _Action]] = {
    "write": _write,
    "take": _take,
    "release": _release,
    "lost": _lost,
    "connected": _connected,
    "robot": _robot,
    "program": _program,
    "force": _force,
    "unforce": _unforce,
    "unavailable": _unavailable,
    "available": _available,
}
