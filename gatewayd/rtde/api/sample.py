"""One package of a robot as an object with an attribute for each field; nothing is decoded twice, nothing copied."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from operator import itemgetter
from typing import Any, TypeAlias

from gatewayd.rtde.api.sample_fields import SampleFields
from gatewayd.rtde.catalogue import suggest
from gatewayd.rtde.recipe import Recipe, Scalar

Value: TypeAlias = Scalar | tuple[Scalar, ...]
"""A number or truth value; of a vector one for each element."""


class SampleLayout:
    """Where the fields of a session's samples lie; made once for all of them.

    `recipe` is that of the packages, `wanted` the fields that were asked for, which may lie in another order.
    """

    __slots__ = ("outputs", "pick", "places", "sample")

    def __init__(self, recipe: Recipe, wanted: tuple[str, ...]) -> None:
        self.places: dict[str, int | slice] = {
            name: slot if slot.stop - slot.start > 1 else slot.start for name, slot in recipe.slots.items()
        }
        """Place of each field of the packages in the flat tuple: an index, or a slice of a vector."""
        names = tuple(name for name in wanted if name in recipe.kinds)
        self.outputs = Recipe(names, [recipe.kinds[name] for name in names])
        """The layout of `Sample.values`."""
        self.pick = _picker([index for name in names for index in _indices(recipe.slots[name])])
        """From the flat tuple of a package to that of the wanted fields."""
        self.sample = _with_properties(self.places)
        """The class of its samples."""


class Sample(SampleFields):
    """The values of one package. Immutable; made by the robot.

    Every field is an attribute: `sample.actual_q[3]`, `sample.timestamp`. Vectors are tuples. Units are those of the
    controller (guide, section "Field names and associated types"; `gatewayd.rtde.fields`): SI, angles in rad.
    """

    __slots__ = ("_flat", "_layout", "received")

    def __init__(self, layout: SampleLayout, flat: tuple[Scalar, ...], received: float) -> None:
        self._layout = layout
        self._flat = flat
        self.received = received
        """When it was received, in seconds of the event loop's clock."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self._flat[self._layout.places[name]]
        except KeyError:
            raise AttributeError(_absent(name, self._layout)) from None

    def __getitem__(self, name: str) -> Value:
        try:
            return self._flat[self._layout.places[name]]
        except KeyError:
            raise KeyError(_absent(name, self._layout)) from None

    def __contains__(self, name: object) -> bool:
        return name in self._layout.places

    def __dir__(self) -> Iterator[str]:
        yield from super().__dir__()
        yield from self._layout.places

    def __repr__(self) -> str:
        shown = ", ".join(f"{name}={self[name]!r}" for name in self.names[:4])
        return f"<Sample {shown}{', ...' if len(self.names) > 4 else ''}>"

    @property
    def names(self) -> tuple[str, ...]:
        """The wanted fields that the controller has, in the order in which they were asked for."""
        return self._layout.outputs.names

    @property
    def values(self) -> tuple[Scalar, ...]:
        """The values of `names`, flat, a place for each element of a vector (slots: `Robot.outputs`)."""
        return self._layout.pick(self._flat)

    def as_dict(self) -> dict[str, Value]:
        """The values of `names` by name."""
        flat, places = self._flat, self._layout.places
        return {name: flat[places[name]] for name in self._layout.outputs.names}


def _with_properties(places: Mapping[str, int | slice]) -> type[Sample]:
    """Samples that find these fields without `__getattr__`, which costs five times as much."""
    properties = {name: _property(place) for name, place in places.items() if not hasattr(Sample, name)}
    return type(Sample.__name__, (Sample,), {"__slots__": (), **properties})


def _property(place: int | slice) -> property:
    return property(lambda sample: sample._flat[place])  # noqa: SLF001  its own


def _indices(slot: slice) -> range:
    return range(slot.start, slot.stop)


def _picker(indices: list[int]) -> Callable[[tuple[Scalar, ...]], tuple[Scalar, ...]]:
    if not indices:
        return lambda _: ()
    if indices == list(range(indices[0], indices[-1] + 1)):
        return itemgetter(slice(indices[0], indices[-1] + 1))
    return itemgetter(*indices)


def _absent(name: str, layout: SampleLayout) -> str:
    near = suggest(name, layout.places)
    return f"{name} is no field of this sample" + (f"; did you mean {' or '.join(near)}?" if near else "")
