"""What is drawn of a recording, and where: a panel for each joint or element, with its unit. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording import columns
from gatewayd.rtde.types import DataType

TIMESTAMP = "timestamp"

_JOINTS = ("base", "shoulder", "elbow", "wrist 1", "wrist 2", "wrist 3")
_AXES = ("x", "y", "z", "rx", "ry", "rz")
_SPATIAL = ("TCP", "tcp", "force", "wrench", "pose", "elbow", "gravity", "cog", "accelerometer", "base_")
"""In the names of vectors that belong to axes in space, not to joints."""
_PAIRED = ("actual_", "target_")
"""Beginnings of names of one quantity, which are drawn in one panel."""
_UNITS = {
    "q": "rad",
    "qd": "rad/s",
    "qdd": "rad/s²",
    "current": "A",
    "moment": "Nm",
    "TCP_pose": "m, rad",
    "TCP_force": "N, Nm",
    "tcp_offset": "m, rad",
    "ft_raw_wrench": "N, Nm",
}
"""Quantity -> unit, where the guides are silent and the URScript manual is not."""


@dataclass(frozen=True, slots=True)
class Curve:
    """One column of the recording in a panel."""

    field: str
    column: str
    stepped: bool
    """Of an integer or a bit, which has nothing between two values."""


@dataclass(frozen=True, slots=True)
class Panel:
    """A pair of axes."""

    title: str
    unit: str
    """Empty where it is not known, or there is none."""
    curves: tuple[Curve, ...]

    @property
    def label(self) -> str:
        """What stands at its upright axis: `q, base in rad`."""
        return f"{self.title} in {self.unit}" if self.unit else self.title


def together(recipes: Iterable[Recipe]) -> Recipe:
    """The fields of several recordings, each once."""
    found = {name: kind for recipe in recipes for name, kind in recipe.kinds.items()}
    return Recipe(list(found), list(found.values()))


def chosen(recipe: Recipe, wanted: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The columns that names, elements (`actual_q[1]`) and patterns (`actual_*`) mean, and what means none.

    Without a wish all columns but the time.
    """
    names = columns(recipe)
    if not wanted:
        return tuple(name for name in names if name != TIMESTAMP), ()
    found: dict[str, None] = {}
    unknown = []
    for wish in wanted:
        pattern = wish.replace("[", "_").removesuffix("]") if wish.endswith("]") else wish
        fields = [field for field in recipe.names if fnmatchcase(field, pattern)]
        meant = [name for field in fields for name in names[recipe.slots[field]]]
        meant = meant or [name for name in names if fnmatchcase(name, pattern)]
        found |= dict.fromkeys(meant)
        unknown += [wish] if not meant else []
    return tuple(found), tuple(unknown)


def panels(recipe: Recipe, drawn: Iterable[str]) -> tuple[Panel, ...]:
    """The panels of these columns, in the order of the fields; `target_` and `actual_` of a quantity share theirs."""
    wanted = set(drawn)
    names = columns(recipe)
    found: dict[str, dict[int, list[Curve]]] = {}
    for field, slot in recipe.slots.items():
        stepped = recipe.kinds[field].element is not DataType.DOUBLE
        for element, column in enumerate(names[slot]):
            if column in wanted:
                curves = found.setdefault(_quantity(field), {}).setdefault(element, [])
                curves.append(Curve(field, column, stepped))
    return tuple(
        Panel(_title(curves, element, recipe), _unit(curves[0].field, element), tuple(curves))
        for elements in found.values()
        for element, curves in sorted(elements.items())
    )


def _quantity(field: str) -> str:
    return next((field.removeprefix(begin) for begin in _PAIRED if field.startswith(begin)), field)


def _title(curves: Sequence[Curve], element: int, recipe: Recipe) -> str:
    fields = [curve.field for curve in curves]
    name = fields[0] if len(fields) == 1 else _quantity(fields[0])
    count = max(recipe.kinds[field].count for field in fields)
    if count == 1:
        return name
    spatial = count == len(_AXES) // 2 or any(part in name for part in _SPATIAL)
    return f"{name}, {(_AXES if spatial else _JOINTS)[element]}"


def _unit(field: str, element: int) -> str:
    """The unit of an element: of two, as of a pose, the first is that of x, y and z."""
    known = OUTPUTS.get(field) or INPUTS.get(field)
    unit = (known.unit if known is not None else "") or _UNITS.get(_quantity(field), "")
    linear, comma, angular = unit.partition(", ")
    return angular if comma and element >= 3 else linear
