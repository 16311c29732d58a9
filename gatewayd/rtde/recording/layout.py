"""The columns of a recording: how the fields of a recipe lie in them, and which fields a header means."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

HOST_TIME = "host_time"
"""Column that a recording has on request, behind the fields: when the package was received by the clock of the machine
that recorded, in seconds since 1970 UTC, as a DOUBLE."""

_FIRST = "_0"
_UNKNOWN = DataType.DOUBLE
"""The type of a column of which nothing is known: the official reader makes a float of every one."""
_VECTORS = {(kind.code, kind.count): kind for kind in DataType if kind.is_vector}
_LENGTHS = sorted({kind.count for kind in DataType if kind.is_vector}, reverse=True)


def columns(recipe: Recipe, *, host_time: bool = False) -> tuple[str, ...]:
    """The header: the name of a field, or `name_0` ... `name_5` for the elements of a vector (guide, CSVWriter)."""
    names = (
        f"{name}_{element}" if kind.is_vector else name
        for name, kind in recipe.kinds.items()
        for element in range(kind.count)
    )
    return (*names, HOST_TIME) if host_time else tuple(names)


def column_types(recipe: Recipe, *, host_time: bool = False) -> tuple[DataType, ...]:
    """The type of each column."""
    kinds = (kind.element for kind in recipe.types for _ in range(kind.count))
    return (*kinds, DataType.DOUBLE) if host_time else tuple(kinds)


def fields_of(header: Sequence[str], types: Sequence[DataType] | None = None) -> tuple[Recipe, bool]:
    """The recipe that a header means, and whether host time follows as the last column.

    `types` are those of the columns where the file has them, else the guides' are taken and DOUBLE for other names.
    Elements become a vector again where all stand in their order. ValueError for a name that stands there twice.
    """
    host_time = len(header) > 1 and header[-1] == HOST_TIME
    names = header[:-1] if host_time else header
    declared = dict(zip(names, types, strict=False)) if types is not None else {}
    found = dict(_fields(names, declared))
    if sum(kind.count for kind in found.values()) != len(names):
        twice = next(name for place, name in enumerate(names) if name in names[:place])
        raise ValueError(f"the column {twice} is there twice")
    return Recipe(list(found), list(found.values())), host_time


def _fields(names: Sequence[str], declared: Mapping[str, DataType]) -> Iterator[tuple[str, DataType]]:
    place = 0
    while place < len(names):
        name = names[place]
        vector = _vector(names[place:], declared) if name.endswith(_FIRST) else None
        if vector is not None:
            yield name.removesuffix(_FIRST), vector
        else:
            yield name, declared.get(name) or _known(name)
        place += vector.count if vector is not None else 1


def _vector(names: Sequence[str], declared: Mapping[str, DataType]) -> DataType | None:
    """The type of the vector whose elements stand first in `names`; None: they are columns of their own."""
    base = names[0].removesuffix(_FIRST)
    known = _field_type(base)
    if _field_type(names[0]) is not None:
        return None
    length = known.count if known is not None else _run(base, names)
    if list(names[:length]) != [f"{base}_{element}" for element in range(length)]:
        return None
    kinds = {declared.get(name, known.element if known is not None else _UNKNOWN) for name in names[:length]}
    return _VECTORS.get((kinds.pop().code, length)) if len(kinds) == 1 else None


def _run(base: str, names: Sequence[str]) -> int:
    """How many elements of a vector of no guide follow each other, where a vector has as many; 1 otherwise."""
    count = 0
    while count < len(names) and names[count] == f"{base}_{count}":
        count += 1
    return count if count in _LENGTHS else 1


def _field_type(name: str) -> DataType | None:
    field = OUTPUTS.get(name) or INPUTS.get(name)
    return field.type if field is not None else None


def _known(name: str) -> DataType:
    """The type of a column alone: of a field, or of an element whose vector is not whole."""
    kind = _field_type(name) or _field_type(name.rpartition("_")[0])
    return kind.element if kind is not None else _UNKNOWN
