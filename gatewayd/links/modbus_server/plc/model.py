"""What a PLC program needs of a cell, whatever the make of the PLC: the neutral model that every target writes down.

Types are the elementary types of IEC 61131-3. Numbers of variables are those of the status block, counted from 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gatewayd.core.definition import Fallback, Limits, Value, ValueKind
from gatewayd.core.status_layout import BASE
from gatewayd.modbus.areas import Area

WORD_BITS = 16


@dataclass(frozen=True, slots=True)
class Encoding:
    """How a number lies in registers."""

    type: str
    """A key of `gatewayd.modbus.codec.TYPES`."""
    order: str
    scale: float
    offset: float

    @property
    def is_scaled(self) -> bool:
        """Whether the raw number is not the value."""
        return (self.scale, self.offset) != (1, 0)


@dataclass(frozen=True, slots=True)
class Tag:
    """One variable as the PLC sees it."""

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
    """None: a bit of a register, a coil or a discrete input."""
    bit: int | None
    """Bit of the register, the lowest one of a byte; None: whole registers, or a coil or discrete input."""
    area: Area
    address: int
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
        """Where it lies, for people: `400131 (130)`, `400001.3 (0.3)`."""
        part = "" if self.bit is None else f".{self.bit}"
        if self.encoding is not None and self.bit is not None:
            part = ".high" if self.bit else ".low"
        return f"{self.area.notation(self.address)}{part} ({self.address}{part})"


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
class Poll:
    """One request that is sent over and over: what lies there goes into, or comes from, an array of the image."""

    name: str
    """Of the array: `read1`, `status2`, `write1`."""
    area: Area
    address: int
    count: int
    """Registers, or coils and discrete inputs."""
    tags: tuple[Tag, ...] = ()
    writes: bool = False
    slow: bool = False
    """Read in turns with the other slow ones, one in each round."""
    shared: bool = False
    """Of a write: to send it takes locks that others may hold, so it is sent on demand only."""
    what: str = ""
    """In words, for comments."""

    @property
    def function(self) -> int:
        """The Modbus function code."""
        return WRITES[self.area] if self.writes else READS[self.area]

    @property
    def notation(self) -> str:
        """`400001`."""
        return self.area.notation(self.address)


READS: Mapping[Area, int] = {Area.COIL: 1, Area.DISCRETE: 2, Area.HOLDING: 3, Area.INPUT: 4}
WRITES: Mapping[Area, int] = {Area.COIL: 15, Area.HOLDING: 16}


@dataclass(frozen=True, slots=True)
class PlcModel:
    """A cell for one PLC."""

    cell: str
    source: str
    """Name of the mapping file, without its folder."""
    fingerprint: int
    prefix: str
    """Of everything that is generated."""
    host: str
    port: int
    unit: int
    writer: str
    """Who the PLC is in the mapping; empty: it only reads."""
    writer_number: int
    """As in the owner table; 0: it only reads."""
    writers: tuple[str, ...]
    timeout: float | None
    """Seconds within which the PLC has to ask for something."""
    inputs: tuple[TagFamily, ...]
    """What this PLC may write."""
    outputs: tuple[TagFamily, ...]
    """What it reads."""
    variables: tuple[str, ...]
    """All variables of the mapping by number, from 1 on."""
    polls: tuple[Poll, ...]
    left_out: tuple[str, ...]
    """What of the mapping is not there, and why."""
    period: float
    """Seconds from one round of requests to the next."""

    @property
    def reads(self) -> tuple[Poll, ...]:
        """The requests that bring values."""
        return tuple(poll for poll in self.polls if not poll.writes and poll.tags)

    @property
    def writes(self) -> tuple[Poll, ...]:
        """The requests that carry values."""
        return tuple(poll for poll in self.polls if poll.writes)

    @property
    def status(self) -> tuple[Poll, ...]:
        """The requests for parts of the status block."""
        return tuple(poll for poll in self.polls if not poll.writes and not poll.tags)

    def array_of(self, offset: int) -> tuple[str, int]:
        """Where a word of the status block lies: name of the array and index. Raises KeyError."""
        for poll in self.status:
            index = offset - (poll.address - BASE)
            if 0 <= index < poll.count:
                return poll.name, index
        raise KeyError(offset)


def initial(tag: Tag) -> Value | None:
    """What the value is while nothing fresh is known, as the mapping's `on_stale` says; None: as it was."""
    return tag.on_stale.apply(None, tag.kind)  # type: ignore[arg-type]
