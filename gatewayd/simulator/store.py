"""The variables of the simulated controller: one flat list of numbers, every field a fixed slice of it.

Fields that move by themselves are computed when somebody looks and at most once a moment. A `RecipeView` is the
compiled way to the packed values of a recipe; equal recipes share one, so a package is made once however many clients
get it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from operator import itemgetter
from weakref import WeakValueDictionary

from gatewayd.report.format import counted
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import INTEGER_RANGES, DataType
from gatewayd.simulator.arm import ControllerMoment
from gatewayd.simulator.kinematics import Vector
from gatewayd.simulator.signals import Signal

Scalar = int | float
"""An element of a value; BOOL is bool, an int."""


def fitting(value: Scalar, code: str) -> Scalar:
    """`value` as an element of format `code` holds it: rounded, kept in range, NaN as 0; a truth value for `?`."""
    if code == "d":
        return float(value)
    if code == "?":
        return bool(value)
    if isinstance(value, float) and math.isnan(value):
        return 0
    low, high = INTEGER_RANGES[code]
    return round(min(max(value, low), high))


class FieldStore:
    """The values of all fields at one moment."""

    def __init__(
        self,
        types: Mapping[str, DataType],
        signals: Mapping[str, Signal],
        initial: Mapping[str, float | Vector],
    ) -> None:
        self.moment = ControllerMoment(0, 0.0, 0.0, 0.0)
        """Now. Who sets it also moves the fields that follow it."""
        self.edition = 0
        """Changes whenever a value may have: part of the key under which packages are kept."""
        self._types = dict(types)
        self._signals = {name: signal for name, signal in signals.items() if name in types}
        self._places: dict[str, slice] = {}
        self._views: WeakValueDictionary[tuple[str, ...], RecipeView] = WeakValueDictionary()
        end = 0
        for name, kind in types.items():
            self._places[name] = slice(end, end + kind.count)
            end += kind.count
        self._initial = {name: value for name, value in initial.items() if name in types}
        self.cells: list[Scalar] = [0] * end
        """All elements. Only the owner of the store writes here, and only what fits the type."""
        self.reset()

    def __contains__(self, name: str) -> bool:
        return name in self._types

    def reset(self) -> None:
        """Every field back to its first value."""
        for name, kind in self._types.items():
            value = self._initial.get(name, 0)
            self.write(name, value if isinstance(value, tuple) else (value,) * kind.count)

    def type(self, name: str) -> DataType:
        """The type of a field; KeyError if there is none of that name."""
        return self._types[name]

    def place(self, name: str) -> slice:
        """Where a field lies in `cells`."""
        return self._places[name]

    def moves(self, name: str) -> bool:
        """Whether the field changes by itself."""
        return name in self._signals

    def pin(self, name: str, values: Sequence[Scalar]) -> None:
        """Write a field and, if it moved by itself, make it stay there."""
        if self._signals.pop(name, None) is not None:
            for view in list(self._views.values()):
                view.compile()
        self.write(name, values)

    def write(self, name: str, values: Sequence[Scalar]) -> None:
        """Set a field; ValueError unless there is one element for each of its type."""
        self.check(name, values)
        kind = self._types[name]
        self.cells[self._places[name]] = [fitting(value, kind.code) for value in values]
        self.edition += 1

    def check(self, name: str, values: Sequence[Scalar]) -> None:
        """ValueError unless there is one element for each of the field's type; KeyError if there is no such field."""
        kind = self._types[name]
        if len(values) != kind.count:
            message = f"{name} takes {counted(kind.count, 'value')}, not {len(values)}"
            raise ValueError(message)

    def read(self, name: str) -> tuple[Scalar, ...]:
        """The elements of a field now."""
        self.refresh((name,))
        return tuple(self.cells[self._places[name]])

    def refresh(self, names: Iterable[str]) -> None:
        """Bring those of `names` that move by themselves up to the present moment."""
        for place, signal in self.movers(names):
            self.cells[place] = signal(self.moment)

    def movers(self, names: Iterable[str]) -> list[tuple[slice, Signal]]:
        """Place and source of those of `names` that move by themselves."""
        return [(self._places[name], self._signals[name]) for name in names if name in self._signals]

    def view(self, names: tuple[str, ...]) -> RecipeView:
        """The packed values of `names`, all of them fields. Keep it as long as it is needed."""
        view = self._views.get(names)
        if view is None:
            view = self._views[names] = RecipeView(self, names)
        return view


class RecipeView:
    """The values of one output recipe."""

    def __init__(self, store: FieldStore, names: tuple[str, ...]) -> None:
        self.names = names
        """The recipe."""
        self._store = store
        self._recipe = Recipe(names, [store.type(name) for name in names])
        self._made: tuple[ControllerMoment, int] | None = None
        self._payload = b""
        self.compile()

    def compile(self) -> None:
        """Look up again which fields move."""
        places = [self._store.place(name) for name in self.names]
        cells = [cell for place in places for cell in range(place.start, place.stop)]
        self._pick = itemgetter(*cells) if len(cells) > 1 else lambda values: (values[cells[0]],)
        self._movers = self._store.movers(dict.fromkeys(self.names))
        self._made = None

    def payload(self) -> bytes:
        """The values at the store's moment, packed."""
        store = self._store
        now = (store.moment, store.edition)
        if now != self._made:
            cells, moment = store.cells, store.moment
            for place, signal in self._movers:
                cells[place] = signal(moment)
            self._payload = self._recipe.pack(self._pick(cells))
            self._made = now
        return self._payload
