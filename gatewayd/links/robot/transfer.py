"""Copying between packages and the process image, compiled once per session.

A package's values are one flat tuple (vectors flattened, see `gatewayd.rtde.recipe`). Variables that follow each other
both in the tuple and in the image are moved as one slice; bits of a word are spread only when the word has changed.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass

from gatewayd.core.definition import Direction, Value, Variable

Slots = Mapping[str, slice]
"""Where each field of a recipe lies in its flat tuple."""


@dataclass(frozen=True, slots=True)
class ElementPlace:
    """Where a value lies among others: an element, or one bit of it."""

    offset: int
    """The element."""
    mask: int | None
    """The bit of the element; None: the whole of it."""

    def of(self, values: Sequence[Value]) -> Value:
        """The value that lies there."""
        return values[self.offset] if self.mask is None else bool(int(values[self.offset]) & self.mask)

    def put(self, values: list[Value], value: Value) -> None:
        """Set the value that lies there."""
        if self.mask is None:
            values[self.offset] = value
        else:
            word = int(values[self.offset])
            values[self.offset] = word | self.mask if value else word & ~self.mask


@dataclass(frozen=True, slots=True)
class FieldPart(ElementPlace):
    """What one variable is in the values of its field."""

    variable: int


class OutputTransfer:
    """From a package into the image, for the output variables whose fields the recipe has, `without` some."""

    __slots__ = ("_moves", "_seen", "_words")

    def __init__(self, variables: Sequence[Variable], slots: Slots, without: Container[int] = ()) -> None:
        singles: list[tuple[int, int]] = []
        words: dict[int, list[tuple[int, int]]] = {}
        for index, variable in enumerate(variables):
            if variable.direction is Direction.INPUT or variable.field not in slots or index in without:
                continue
            slot = slots[variable.field].start + (variable.element or 0)
            if variable.bit is None:
                singles.append((index, slot))
            else:
                words.setdefault(slot, []).append((index, variable.bit))
        self._moves = tuple(_runs(singles))
        self._words = tuple((slot, tuple(bits)) for slot, bits in words.items())
        self._seen: list[Value | None] = [None] * len(self._words)

    def copy(self, flat: Sequence[Value], values: list[Value]) -> None:
        """Write the package's values into the image's."""
        for target, source in self._moves:
            values[target] = flat[source]
        for position, (slot, bits) in enumerate(self._words):
            word = flat[slot]
            if word != self._seen[position]:
                self._seen[position] = word
                number = int(word)
                for index, bit in bits:
                    values[index] = bool(number >> bit & 1)

    def forget(self) -> None:
        """Spread every word anew with the next package: somebody else has changed the image meanwhile."""
        self._seen = [None] * len(self._words)


class InputTransfer:
    """From the image into the flat tuple of one input recipe.

    What no variable is mapped to (other bits of a word, other elements of a vector) keeps the value in `base`, which
    `rebase` takes over from the controller.
    """

    __slots__ = ("_bits", "_singles", "base", "fields", "members", "parts", "slots")

    def __init__(
        self, variables: Sequence[Variable], fields: Sequence[str], slots: Slots, without: Container[int] = ()
    ) -> None:
        self.fields = tuple(fields)
        self.slots = dict(slots)
        wanted = [
            (index, variable)
            for index, variable in enumerate(variables)
            if variable.direction is Direction.INPUT and variable.field in slots and index not in without
        ]
        self.members = tuple(index for index, _variable in wanted)
        """Indices of the variables that the recipe carries."""
        self.parts: dict[str, tuple[FieldPart, ...]] = {
            name: tuple(_part(index, variable) for index, variable in wanted if variable.field == name)
            for name in self.fields
        }
        """The variables of each field."""
        self._singles = tuple(
            (index, self._slot(variable)) for index, variable in wanted if variable.bit is None
        )
        self._bits = tuple(
            (index, self._slot(variable), 1 << variable.bit)
            for index, variable in wanted
            if variable.bit is not None
        )
        self.base: list[Value] = [0] * max((slot.stop for slot in slots.values()), default=0)

    def rebase(self, held: Mapping[str, Sequence[Value]]) -> None:
        """Take over what the controller holds; fields without a read-back keep 0."""
        for field, values in held.items():
            if field in self.slots:
                self.base[self.slots[field]] = values

    def adopted(self, fields: Iterable[str]) -> dict[int, Value]:
        """The base as values by variable index, for the variables of `fields`, which are some of the recipe's."""
        return {
            part.variable: part.of(self.base[self.slots[field]])
            for field in fields
            for part in self.parts[field]
        }

    def gather(self, values: Sequence[Value]) -> tuple[Value, ...]:
        """The recipe's flat tuple as the image wants it now."""
        flat = self.base.copy()
        for index, slot in self._singles:
            flat[slot] = values[index]
        for index, slot, mask in self._bits:
            word = int(flat[slot])
            flat[slot] = word | mask if values[index] else word & ~mask
        return tuple(flat)

    def free(self, field: str, values: Sequence[Value]) -> list[Value]:
        """What no variable carries in the values of a field; zero elsewhere."""
        left = list(values)
        for part in self.parts[field]:
            part.put(left, 0)
        return left

    def _slot(self, variable: Variable) -> int:
        return int(self.slots[variable.field].start) + (variable.element or 0)


def _part(index: int, variable: Variable) -> FieldPart:
    return FieldPart(variable.element or 0, None if variable.bit is None else 1 << variable.bit, index)


def _runs(pairs: Iterable[tuple[int, int]]) -> list[tuple[slice, slice]]:
    """Merge (image index, flat index) pairs that step together into slices."""
    runs: list[tuple[slice, slice]] = []
    for target, source in pairs:
        if runs and (runs[-1][0].stop, runs[-1][1].stop) == (target, source):
            last_target, last_source = runs.pop()
            runs.append((slice(last_target.start, target + 1), slice(last_source.start, source + 1)))
        else:
            runs.append((slice(target, target + 1), slice(source, source + 1)))
    return runs
