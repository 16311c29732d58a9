"""What of a cell's definition goes on in a new one.

A variable does if it has the same name and the same place in the robot, a writer by its name, a lock if it has the same
members. With another robot nobody keeps a lock, and what the present one holds ends here: a command is meant for the
robot that it was given to.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gatewayd.core.definition import OPERATOR, CellDefinition, Direction, Lock, Variable


class Match:
    """Indices of what goes on from one definition to the next: old -> new."""

    def __init__(self, old: CellDefinition, new: CellDefinition, *, same_robot: bool = True) -> None:
        self.same_robot = same_robot
        variables = {_identity(variable): index for index, variable in enumerate(new.variables)}
        self.variables = {
            index: variables[_identity(variable)]
            for index, variable in enumerate(old.variables)
            if _identity(variable) in variables
        }
        self.values = self.variables if same_robot else {}
        """Those of them whose values go on."""
        writers = {writer.name: index for index, writer in enumerate(new.writers)}
        self.writers = {
            index: writers[writer.name] for index, writer in enumerate(old.writers) if writer.name in writers
        }
        self.writers[OPERATOR] = OPERATOR
        locks = {lock.name: index for index, lock in enumerate(new.locks)}
        self.locks = {
            index: locks[lock.name]
            for index, lock in enumerate(old.locks)
            if lock.name in locks and self._same_members(lock, new.locks[locks[lock.name]])
        }
        self.places = {
            _place(variable): index
            for index, variable in enumerate(new.variables)
            if variable.direction is Direction.INPUT
        }
        """Registers that somebody will write, and by which variable."""
        self.old, self.new = old, new

    def _same_members(self, old: Lock, new: Lock) -> bool:
        return {self.variables.get(member) for member in old.members} == set(new.members)

    def may_keep(self, lock: int, owner: int) -> bool:
        """Whether the owner of an old lock may go on owning it."""
        successor = self.locks.get(lock)
        return (
            self.same_robot
            and successor is not None
            and (owner == OPERATOR or self.writers.get(owner) in self.new.locks[successor].owners)
        )

    def due(self, variables: set[int]) -> Iterator[int]:
        """New indices of those inputs; what owes its register a fallback owes it under another name too."""
        for index in variables if self.same_robot else ():
            successor = self.variables.get(index, self.places.get(_place(self.old.variables[index])))
            if successor is not None:
                yield successor

    def force_goes_on(self, variable: int) -> bool:
        """Whether what the local operator forces stays forced."""
        lock = self.old.variables[variable].lock
        return self.same_robot and variable in self.variables and (lock is None or lock in self.locks)

    def inputs_without_successor(self) -> list[int]:
        """Inputs whose register in this robot nobody would write any more, so that nobody could ever clear it.

        A command has none: it has acted, and nothing of it stays.
        """
        return [
            index
            for index, variable in enumerate(self.old.variables)
            if variable.direction is Direction.INPUT
            and not variable.is_command
            and not (self.same_robot and _place(variable) in self.places)
        ]


def at(indices: Mapping[int, int], index: int | None) -> int | None:
    """The new index; None of what is gone, and where there was none."""
    return None if index is None else indices.get(index)


def _identity(variable: Variable) -> tuple[object, ...]:
    """What has to be the same for a value to go on; limits, policies and addresses may differ."""
    return variable.name, variable.direction, variable.kind, *_place(variable)


def _place(variable: Variable) -> tuple[object, ...]:
    return (
        (variable.via, variable.field) if variable.via else (variable.field, variable.bit, variable.element)
    )
