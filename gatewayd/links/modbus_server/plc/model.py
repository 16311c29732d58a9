"""What a PLC program needs of the registers of a cell: the neutral model that every target writes down."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gatewayd.core.status_layout import BASE
from gatewayd.links.robot_program import SelfTestValues
from gatewayd.modbus.areas import Area
from gatewayd.plc.model import CellModel, Tag

WORD_BITS = 16


@dataclass(frozen=True, slots=True)
class RegisterTag(Tag):
    """One variable as the PLC sees it, and its registers."""

    bit: int | None
    """Bit of the register, the lowest one of a byte; None: whole registers, or a coil or discrete input."""
    area: Area
    address: int

    @property
    def notation(self) -> str:
        """Where it lies, for people: `400131 (130)`, `400001.3 (0.3)`."""
        part = "" if self.bit is None else f".{self.bit}"
        if self.encoding is not None and self.bit is not None:
            part = ".high" if self.bit else ".low"
        return f"{self.area.notation(self.address)}{part} ({self.address}{part})"


@dataclass(frozen=True, slots=True)
class Poll:
    """One request that is sent over and over: what lies there goes into, or comes from, an array of the image."""

    name: str
    """Of the array: `read1`, `status2`, `write1`."""
    area: Area
    address: int
    count: int
    """Registers, or coils and discrete inputs."""
    tags: tuple[RegisterTag, ...] = ()
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
class TestedTag:
    """One variable of the self test, as the PLC sees it."""

    tag: RegisterTag
    values: SelfTestValues


@dataclass(frozen=True, slots=True)
class SelfTestPlan:
    """The PLC's half; the robot's half is made by `gatewayd export urscript` with the same handshake."""

    toggle: RegisterTag
    acknowledge: RegisterTag
    rounds: int
    inputs: tuple[TestedTag, ...]
    """What the PLC writes."""
    outputs: tuple[TestedTag, ...]
    """What it compares."""


@dataclass(frozen=True, slots=True)
class PlcModel(CellModel):
    """A cell for one PLC that reaches it by Modbus."""

    host: str
    port: int
    unit: int
    timeout: float | None
    """Seconds within which the PLC has to ask for something."""
    polls: tuple[Poll, ...]
    period: float
    """Seconds from one round of requests to the next."""
    self_test: SelfTestPlan | None = None
    """None: nobody asked for one."""

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
