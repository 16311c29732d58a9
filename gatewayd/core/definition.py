"""What a cell consists of, as declared by its mapping: variables, locks, writers.

Everything here is immutable and holds no state. Indices (`Variable.lock`, `Lock.members`, `Lock.owners`)
are positions in the tuples of `CellDefinition`; people see them counted from 1 (`number`).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum

OPERATOR = 254
"""Writer index of the local operator, who is in no mapping and ranks above every owner. People see 255.

The index is the same for every cell and lies beyond all declared writers, so that a reload never gives it to another.
Only the control socket acts under it.
"""

Value = bool | int | float
"""A value in the robot's own unit: bool for a bit, int for integers, float for doubles."""


class Direction(Enum):
    """Which way a variable flows, seen from the robot as RTDE names it."""

    INPUT = "input"
    """fieldbus -> robot; written by its owner."""
    OUTPUT = "output"
    """robot -> fieldbus; nobody but the robot writes it."""


class ValueKind(IntEnum):
    """The Python type of a variable's values."""

    BOOL = 0
    INT = 1
    FLOAT = 2

    @property
    def zero(self) -> Value:
        """What `clear` means for this kind."""
        return _ZEROS[self]


_ZEROS: tuple[Value, ...] = (False, 0, 0.0)


class FallbackKind(Enum):
    """What is seen when a value's source or owner is lost."""

    CLEAR = "clear"
    HOLD = "hold"
    VALUE = "value"
    EXCEPTION = "exception"
    """Outputs only: reading answers Modbus exception 0B, a TPDO stops."""


@dataclass(frozen=True, slots=True)
class Fallback:
    """A fail-safe policy; `value` is meant for `FallbackKind.VALUE` alone."""

    kind: FallbackKind = FallbackKind.CLEAR
    value: Value | None = None

    def apply(self, present: Value, kind: ValueKind) -> Value:
        """The value that replaces `present` for a variable of `kind`."""
        if self.kind is FallbackKind.VALUE and self.value is not None:
            return self.value
        return kind.zero if self.kind is FallbackKind.CLEAR else present


@dataclass(frozen=True, slots=True)
class Limits:
    """Closed range in the robot's unit; outside it a write is refused, or clamped where the mapping says so."""

    low: float
    high: float
    clamp: bool = False


@dataclass(frozen=True, slots=True)
class Variable:
    """One named thing of the mapping: a bit, a register, a field, or an element of a vector."""

    number: int
    """Position in the cell counted from 1; what the status block and the tables show."""
    name: str
    direction: Direction
    kind: ValueKind
    field: str
    """RTDE field that carries it, for example `input_bit_registers0_to_31`."""
    bit: int | None = None
    """Bit of the field, for fields that are words of bits."""
    element: int | None = None
    """Element of the field, for vectors."""
    low: float | None = None
    """Least value the robot's type can hold; None for bits and reals."""
    high: float | None = None
    """Greatest value the robot's type can hold; None for bits and reals."""
    limits: Limits | None = None
    on_stale: Fallback = Fallback()
    """What the fieldbus sees when the robot stops reporting (outputs)."""
    on_release: Fallback = Fallback()
    """What the robot is given when the owner is lost (inputs)."""
    lock: int | None = None
    """Index of the lock that guards it (inputs; None for outputs)."""
    deadband: float = 0.0
    """Least change of a real that makes an event-driven PDO send."""
    shown: tuple[float, float] | None = None
    """Least and greatest value that every place of it can show; None: all of them."""
    shows_nan: bool = True
    """Whether every place of it can show NaN and the infinities as what they are."""
    valid_running: bool = False
    """Outputs that mean something only while the robot program runs."""
    via: str = ""
    """Name of the link that carries it, where the robot's packages do not; `field` is in its terms then."""
    unit: str = ""
    comment: str = ""

    @property
    def is_command(self) -> bool:
        """Whether it is an input that a link of its own carries: it acts once, when it is written (`core.commands`)."""
        return self.via != "" and self.direction is Direction.INPUT


@dataclass(frozen=True, slots=True)
class Lock:
    """What is owned: one input variable, or a group whose variables are only ever owned together."""

    name: str
    members: tuple[int, ...]
    owners: tuple[int, ...]
    """Writers that may own it; with `takeover` the first has the highest priority."""
    takeover: bool = False
    """A writer named earlier takes the lock from one named later."""
    lease: float | None = None
    """Seconds for which the owner holds it without renewing; None: until release, disconnect or time-out."""
    whole: bool = False
    """A takeover by writing has to write every member."""


@dataclass(frozen=True, slots=True)
class Writer:
    """A party that may write inputs. How a link recognises it is the link's plan."""

    name: str
    timeout: float | None = None
    """Seconds without any request after which the writer counts as lost; None: the connection alone decides."""
    grace: float = 0.0
    """Seconds for which what it owned by a connection stays its own after the connection has ended."""
    counts_writes: bool = False
    """Only writes and lock requests feed `timeout`, reads do not."""
    heartbeat: float | None = None
    """Seconds without its heartbeat after which the writer is lost, where it promised one."""


@dataclass(frozen=True, slots=True)
class CellDefinition:
    """All that the core needs to know of one robot cell."""

    name: str
    fingerprint: int
    """32 bits that change with every change of meaning of the mapping."""
    variables: tuple[Variable, ...]
    locks: tuple[Lock, ...]
    writers: tuple[Writer, ...]
    stale_after: float
    """Seconds without a fresh package after which outputs are stale."""
    clear_on_connect: bool = False
    """After adopting the controller's inputs, give ownerless inputs their release fallback at once."""
    adopt_for: float | None = None
    """Seconds, counted once per process, after which adopted inputs that nobody owns take their release fallback; None:
    they keep what the controller held."""

    def writer_name(self, writer: int) -> str:
        """The name of a declared writer; `operator` for the local operator."""
        return "operator" if writer == OPERATOR else self.writers[writer].name
