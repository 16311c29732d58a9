"""Which devices, of all that share a line or a bus, a frame of a trace concerns."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple


class DeviceId(NamedTuple):
    """A device, by its cell and its name."""

    cell: str
    device: str


class Concerned(NamedTuple):
    """What a `Passage` says of them."""

    cell: str | None = None
    """None: they are of several."""
    links: tuple[str, ...] = ()


def concerned_by(devices: Collection[DeviceId]) -> Concerned:
    """Their cell, if all are of one, and their names."""
    cells = {device.cell for device in devices}
    return Concerned(cells.pop() if len(cells) == 1 else None, tuple(device.device for device in devices))
