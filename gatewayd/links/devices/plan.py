"""The compiled device: what all families have in common, immutable."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from gatewayd.core.definition import CellDefinition
from gatewayd.mapping.plan import NO_MEANING, LinkPlan


@dataclass(frozen=True, slots=True)
class Sending:
    """How one output of the robot goes to the device."""

    variable: int
    """Index into `CellDefinition.variables`."""
    brings_up_to_date: bool = False
    """Whether it is written as soon as the device is there, and not only when it changes."""
    every: float | None = None
    """Seconds after which it is written again though it did not change; None: never."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DevicePlan(LinkPlan):
    """One device; each family has a class of its own."""

    kind = "device"
    family: ClassVar[str] = ""
    """Name of the family (`families.FAMILIES`)."""

    name: str = field(metadata=NO_MEANING)
    """Its name in the file, which its link has too."""
    number: int
    """Which of the devices of the file it is, from 0: its place in the status block."""
    writer: int | None
    """The writer that it is; None: it writes nothing."""
    lost_after: float
    """Seconds without an answer after which it counts as lost."""
    watchdog: float | None
    """Seconds of the device's own watchdog; None: it has none."""
    sendings: tuple[Sending, ...] = ()
    """Outputs that it gets."""

    def identity(self, cell: CellDefinition) -> object:
        """What a running link cannot go on without: equal for two plans of which one can take the other's place.

        Variables and writers are in it by name, since their indices may differ.
        """
        raise NotImplementedError
