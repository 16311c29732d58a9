"""The inputs that the controller gave us: what it was last given, what is due, and whether it reads back so.

Pure: flat tuples in and out, time as a parameter.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from gatewayd.core.definition import Value, Variable
from gatewayd.core.image import ProcessImage
from gatewayd.robot.transfer import InputTransfer, Slots, read_back
from gatewayd.rtde.claims import WATCHDOG_KEY, InputRecipe

__all__ = ["VERIFY_AFTER", "ClaimedInputs", "Doubt"]

VERIFY_AFTER = 0.5
"""Seconds after a change within which the controller must read the value back."""


@dataclass(frozen=True, slots=True)
class Doubt:
    """A field that does not read back what was sent."""

    field: str
    sent: Sequence[Value]
    held: Sequence[Value]

    def __str__(self) -> str:
        return f"{self.field}: sent {_text(self.sent)}, the controller holds {_text(self.held)}"


@dataclass(slots=True)
class _Recipe:
    """A claimed and adopted input recipe, and what the controller was last given by it."""

    transfer: InputTransfer
    sent: tuple[Value, ...]
    sent_at: float
    echo: slice | None
    """Where packages read the whole recipe back in its own order; None if they do not."""
    changed: dict[str, float] = field(default_factory=dict)
    """When a field was last given another value."""
    doubted: set[str] = field(default_factory=set)
    """Fields whose read-back differed and that were told already."""

    def note(self, flat: tuple[Value, ...], now: float) -> None:
        former, self.sent, self.sent_at = self.sent, flat, now
        if flat == former:
            return
        for name, slot in self.transfer.slots.items():
            if flat[slot] != former[slot]:
                self.changed[name] = now
                self.doubted.discard(name)

    def by_field(self) -> dict[str, Sequence[Value]]:
        return {name: self.sent[slot] for name, slot in self.transfer.slots.items()}


class ClaimedInputs:
    """The input recipes of one session. `slots` are those of the output recipe, which reads inputs back."""

    def __init__(self, variables: Sequence[Variable], slots: Slots) -> None:
        self._variables = variables
        self._slots = slots
        self._recipes: dict[str, _Recipe] = {}

    def adopt(
        self,
        claimed: Mapping[str, InputRecipe],
        flat: Sequence[Value],
        values: Sequence[Value],
        now: float,
        without: Container[int] = (),
    ) -> dict[int, Value]:
        """Take over recipes, `without` some variables, and what a package tells that they hold.

        Returns the values of variables that were not ours before. What neither the controller told nor a writer wrote
        counts as sent, so that it is not sent.
        """
        former, self._recipes = self._recipes, {}
        adopted: dict[int, Value] = {}
        for key, accepted in claimed.items():
            if key == WATCHDOG_KEY:
                continue
            recipe = accepted.recipe
            transfer = InputTransfer(self._variables, recipe.names, recipe.slots, without)
            known = former[key].by_field() if key in former else {}
            told = read_back(flat, self._slots, recipe.names)
            transfer.rebase(known | told)
            new = transfer.adopted(told.keys() - known.keys())
            sent = _present(transfer, values, new, known)
            self._recipes[key] = _Recipe(transfer, sent, now, self._echo(recipe.names))
            adopted |= new
        return adopted

    def due(self, image: ProcessImage) -> Iterator[tuple[str, tuple[Value, ...]]]:
        """Every recipe of which something was written or has changed since it was sent."""
        for key, recipe in self._recipes.items():
            flat = recipe.transfer.gather(image.values)
            if flat != recipe.sent or any(
                image.times[index] > recipe.sent_at for index in recipe.transfer.members
            ):
                yield key, flat

    def sent(self, key: str, flat: tuple[Value, ...], now: float) -> None:
        """Take down that a recipe was sent."""
        self._recipes[key].note(flat, now)

    def doubts(self, flat: Sequence[Value], now: float) -> Iterator[Doubt]:
        """The fields that a package reads back otherwise than they were sent, each told once."""
        for recipe in self._recipes.values():
            if recipe.echo is not None and flat[recipe.echo] == recipe.sent and not recipe.doubted:
                continue
            for name, wanted in recipe.transfer.slots.items():
                slot = self._slots.get(name)
                if now - recipe.changed.get(name, -math.inf) < VERIFY_AFTER:
                    continue
                if slot is None or _same(flat[slot], recipe.sent[wanted]):
                    recipe.doubted.discard(name)
                elif name not in recipe.doubted:
                    recipe.doubted.add(name)
                    yield Doubt(name, recipe.sent[wanted], flat[slot])

    def _echo(self, names: Sequence[str]) -> slice | None:
        slots = [self._slots[name] for name in names if name in self._slots]
        if len(slots) < len(names) or any(one.stop != other.start for one, other in pairwise(slots)):
            return None
        return slice(slots[0].start, slots[-1].stop)


def _present(
    transfer: InputTransfer,
    values: Sequence[Value],
    adopted: Mapping[int, Value],
    known: Mapping[str, Sequence[Value]],
) -> tuple[Value, ...]:
    """The recipe as it would be sent without anybody's write: adopted, sent before, or never told."""
    image = list(values)
    for index, value in adopted.items():
        image[index] = value
    flat = list(transfer.gather(image))
    for name, slot in transfer.slots.items():
        if name in known:
            flat[slot] = known[name]
    return tuple(flat)


def _same(held: Sequence[Value], sent: Sequence[Value]) -> bool:
    """Equal, where NaN equals NaN."""
    return all(a == b or (a != a and b != b) for a, b in zip(held, sent, strict=True))  # noqa: PLR0124


def _text(values: Sequence[Value]) -> str:
    return " ".join(f"{value:g}" if isinstance(value, float) else str(value) for value in values)
