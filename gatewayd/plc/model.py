"""What a PLC program needs of a cell, whatever the make of the PLC and the link: the part of the model that all share.

Types are the elementary types of IEC 61131-3. Numbers of variables are those of the status block, counted from 1.
"""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.core.definition import Fallback, Limits, Value, ValueKind


@dataclass(frozen=True, slots=True)
class Encoding:
    """How a number goes over the wire."""

    type: str
    """A key of `plc.numbers.NUMBERS`."""
    order: str
    """Of words and bytes in registers; empty where the bus has only one."""
    scale: float
    offset: float

    @property
    def is_scaled(self) -> bool:
        """Whether the raw number is not the value."""
        return (self.scale, self.offset) != (1, 0)


@dataclass(frozen=True, slots=True)
class Tag:
    """One variable as the PLC sees it. Where it lies, the tags of each link say."""

    number: int
    name: str
    """Of the mapping: `tcp[0]`."""
    member: str
    """Of the data type that it is in: `tcp`."""
    element: int | None
    """Index in the member, where that is an array."""
    kind: ValueKind
    type: str
    """Elementary type of the value in the PLC."""
    arithmetic: str
    """REAL or LREAL: in which scale and offset are applied; empty where nothing is scaled."""
    encoding: Encoding | None
    """None: a single bit."""
    unit: str
    comment: str
    limits: Limits | None
    on_stale: Fallback
    owners: tuple[int, ...]
    """Numbers of the writers that may own it."""

    @property
    def path(self) -> str:
        """Below a variable of the data type: `tcp[0]`."""
        return self.member if self.element is None else f"{self.member}[{self.element}]"

    @property
    def notation(self) -> str:
        """Where it lies, for people."""
        raise NotImplementedError

    def type_in_mapping(self, name: str) -> str:
        """How the mapping calls a type of `plc.numbers.NUMBERS` at this place."""
        return name


@dataclass(frozen=True, slots=True)
class TagFamily:
    """A variable, or a family of variables of one type as an array from 0."""

    name: str
    type: str
    tags: tuple[Tag, ...]

    @property
    def is_array(self) -> bool:
        """Whether it has elements."""
        return self.tags[0].element is not None


@dataclass(frozen=True, slots=True)
class CellModel:
    """A cell for one PLC."""

    cell: str
    source: str
    """Name of the mapping file, without its folder."""
    fingerprint: int
    prefix: str
    """Of everything that is generated."""
    writer: str
    """Who the PLC is in the mapping; empty: it only reads."""
    writer_number: int
    """As in the owner table; 0: it only reads."""
    writers: tuple[str, ...]
    inputs: tuple[TagFamily, ...]
    """What this PLC may write."""
    outputs: tuple[TagFamily, ...]
    """What it reads."""
    variables: tuple[str, ...]
    """All variables of the mapping by number, from 1 on."""
    left_out: tuple[str, ...]
    """What of the mapping is not there, and why."""


def initial(tag: Tag) -> Value | None:
    """What the value is while nothing fresh is known, as the mapping's `on_stale` says; None: as it was."""
    return tag.on_stale.apply(None, tag.kind)  # type: ignore[arg-type]
