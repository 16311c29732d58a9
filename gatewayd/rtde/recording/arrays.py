"""Recordings as arrays, by the extra `numpy`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from gatewayd.rtde.recording.errors import MissingExtraError, RecordingError
from gatewayd.rtde.recording.layout import HOST_TIME, column_types, columns
from gatewayd.rtde.recording.reading import open_recording
from gatewayd.rtde.recording.running import program_runs

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from gatewayd.rtde.recipe import Recipe, Scalar
    from gatewayd.rtde.recording.reading import RecordingReader

_KINDS = {"?": "?", "B": "u1", "I": "u4", "Q": "u8", "i": "i4", "d": "f8"}
"""`DataType.code` -> type of an array."""


def read_arrays(
    path: str | Path, *, delimiter: str | None = None, running: bool = False
) -> dict[str, NDArray[Any]]:
    """The fields of a recording by name, each an array of its type: one value for each package, in their order.

    That of a vector has the shape (packages, elements). A recording with host time has `host_time` as well, in seconds
    since 1970 UTC. A last package that is not whole is left out, with `running` also those while no robot program ran.
    Raises RecordingError, MissingExtraError.
    """
    try:
        import numpy as np
    except ImportError as error:
        raise MissingExtraError("Reading a recording as arrays", "numpy", "numpy") from error
    with open_recording(path, delimiter=delimiter) as recording:
        recipe, host_time = recording.recipe, recording.host_time
        names = columns(recipe, host_time=host_time)
        kinds = [_KINDS[kind.code] for kind in column_types(recipe, host_time=host_time)]
        table = np.fromiter(
            _rows(recording, _test(path, recipe, running=running)),
            np.dtype(list(zip(names, kinds, strict=True))),
        )
    found = {
        name: np.stack([table[column] for column in names[slot]], axis=1)
        if recipe.kinds[name].is_vector
        else np.ascontiguousarray(table[name])
        for name, slot in recipe.slots.items()
    }
    return found | ({HOST_TIME: np.ascontiguousarray(table[HOST_TIME])} if host_time else {})


def _test(path: str | Path, recipe: Recipe, *, running: bool) -> Callable[[Sequence[Scalar]], bool]:
    if not running:
        return lambda _values: True
    found = program_runs(recipe)
    if found is None:
        text = "has neither runtime_state nor robot_status_bits, which tell whether a program ran; record one of them"
        raise RecordingError(f"{path}: {text}")
    return found


def _rows(
    recording: RecordingReader, wanted: Callable[[Sequence[Scalar]], bool]
) -> Iterator[tuple[Scalar | None, ...]]:
    return (
        (*values, time) if recording.host_time else values
        for values, time in recording.rows()
        if wanted(values)
    )
