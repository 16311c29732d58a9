"""The object dictionary of the running node (CiA 301, 7.4): what an SDO client reads and writes.

Services bring their own objects; the dictionary checks what is common to all of them (existence, access, length,
range) and leaves the rest to an entry's own `check`, `source` and `sink`. All bytes are little-endian as on the bus.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from enum import Enum, IntEnum

from gatewayd.canopen.datatypes import CanType


class AbortCode(IntEnum):
    """SDO abort codes (CiA 301, 7.2.4.3.17)."""

    TOGGLE = 0x0503_0000
    TIMED_OUT = 0x0504_0000
    UNKNOWN_COMMAND = 0x0504_0001
    BLOCK_SIZE = 0x0504_0002
    SEQUENCE_NUMBER = 0x0504_0003
    CRC = 0x0504_0004
    OUT_OF_MEMORY = 0x0504_0005
    UNSUPPORTED_ACCESS = 0x0601_0000
    WRITE_ONLY = 0x0601_0001
    READ_ONLY = 0x0601_0002
    NO_OBJECT = 0x0602_0000
    NOT_MAPPABLE = 0x0604_0041
    PDO_LENGTH = 0x0604_0042
    PARAMETER_INCOMPATIBLE = 0x0604_0043
    INTERNALLY_INCOMPATIBLE = 0x0604_0047
    HARDWARE = 0x0606_0000
    LENGTH = 0x0607_0010
    TOO_LONG = 0x0607_0012
    TOO_SHORT = 0x0607_0013
    NO_SUBINDEX = 0x0609_0011
    INVALID_VALUE = 0x0609_0030
    VALUE_TOO_HIGH = 0x0609_0031
    VALUE_TOO_LOW = 0x0609_0032
    MAXIMUM_BELOW_MINIMUM = 0x0609_0036
    NO_RESOURCE = 0x060A_0023
    GENERAL = 0x0800_0000
    CANNOT_STORE = 0x0800_0020
    LOCAL_CONTROL = 0x0800_0021
    DEVICE_STATE = 0x0800_0022
    NO_DICTIONARY = 0x0800_0023
    NO_DATA = 0x0800_0024


class Abort(Exception):
    """Ends an SDO transfer; `code` goes to the client."""

    def __init__(self, code: AbortCode, *, recorded: bool = False) -> None:
        super().__init__(f"{code:#010x} {code.name}")
        self.code = code
        self.recorded = recorded
        """The object that refuses has recorded it already: `aborted` of the server is not called."""


class Pending:
    """A download that was taken and is not done yet: its client is answered when it is."""

    __slots__ = ("code", "done")

    def __init__(self) -> None:
        self.done = False
        self.code: AbortCode | None = None
        """Why it has failed, once it is done; None: it has not."""

    def finish(self, code: AbortCode | None = None) -> None:
        """It is done, or has failed."""
        self.done, self.code = True, code


class Access(Enum):
    """Who may do what by SDO; the value is the EDS spelling (CiA 306)."""

    RO = "ro"
    WO = "wo"
    RW = "rw"
    CONST = "const"
    RWW = "rww"
    """Read and write, mappable into an RPDO."""

    @property
    def readable(self) -> bool:
        """Whether an SDO upload is allowed."""
        return self is not Access.WO

    @property
    def writable(self) -> bool:
        """Whether an SDO download is allowed."""
        return self not in (Access.RO, Access.CONST)


class Pdo(Enum):
    """Into which PDOs an entry may be mapped."""

    NONE = "none"
    TRANSMIT = "transmit"
    RECEIVE = "receive"


class ObjectCode(IntEnum):
    """CiA 301, 7.4.3."""

    VAR = 7
    ARRAY = 8
    RECORD = 9


@dataclass(slots=True, eq=False)
class Entry:
    """One sub-index."""

    subindex: int
    name: str
    type: CanType
    access: Access
    default: bytes = b""
    """Value after power-on and after a restore of defaults."""
    low: float | None = None
    high: float | None = None
    pdo: Pdo = Pdo.NONE
    plus_node: bool = False
    """The default contains the node-ID: `$NODEID+...` in the EDS."""
    stored: bool = False
    """Kept by 1010h "save parameters"."""
    check: Callable[[bytes], None] | None = None
    """Called before a new value is stored; raises Abort to refuse it."""
    changed: Callable[[], None] | None = None
    """Called after a new value was stored."""
    source: Callable[[], bytes] | None = None
    """Makes the value when it is read, in place of `value`."""
    sink: Callable[[bytes], Pending | None] | None = None
    """Takes a written value in place of `value`, now or later; raises Abort to refuse it."""
    value: bytes = field(default=b"", init=False)

    def __post_init__(self) -> None:
        self.value = self.default

    @classmethod
    def parameter(
        cls,
        subindex: int,
        name: str,
        kind: CanType,
        default: int,
        *,
        plus_node: bool = False,
        check: Callable[[bytes], None] | None = None,
        changed: Callable[[], None] | None = None,
    ) -> Entry:
        """One that a client may write and have stored."""
        entry = cls(subindex, name, kind, Access.RW, kind.pack(default), plus_node=plus_node, stored=True)
        entry.check, entry.changed = check, changed
        return entry

    @classmethod
    def constant(cls, subindex: int, name: str, number: int, *, plus_node: bool = False) -> Entry:
        """An UNSIGNED32 that no client can write."""
        u32 = CanType.UNSIGNED32
        return cls(subindex, name, u32, Access.RO, u32.pack(number), plus_node=plus_node)

    @property
    def is_volatile(self) -> bool:
        """Whether it shows what is at the moment, and so has no default."""
        return self.source is not None

    @property
    def number(self) -> int:
        """The stored value as an unsigned integer."""
        return int.from_bytes(self.value, "little")

    def read(self) -> bytes:
        """The value as it is now."""
        return self.source() if self.source is not None else self.value

    def write(self, data: bytes) -> Pending | None:
        """Check a value and store it, or hand it to the sink. Raises Abort."""
        size = self.type.size
        if size is not None:
            if len(data) != size:
                raise Abort(AbortCode.TOO_LONG if len(data) > size else AbortCode.TOO_SHORT)
            self._check_range(data)
        if self.sink is not None:
            return self.sink(data)
        if self.check is not None:
            self.check(data)
        self.value = data
        if self.changed is not None:
            self.changed()
        return None

    def _check_range(self, data: bytes) -> None:
        if self.type is CanType.BOOLEAN and data[0] > 1:
            raise Abort(AbortCode.VALUE_TOO_HIGH)
        if self.low is None and self.high is None:
            return
        value = self.type.unpack(data)
        if self.high is not None and value > self.high:
            raise Abort(AbortCode.VALUE_TOO_HIGH)
        if self.low is not None and value < self.low:
            raise Abort(AbortCode.VALUE_TOO_LOW)


@dataclass(frozen=True, slots=True)
class Object:
    """One index."""

    index: int
    name: str
    code: ObjectCode
    entries: tuple[Entry, ...]
    """By sub-index, ascending; for arrays and records the first one is sub-index 0, the highest sub-index."""


class Dictionary:
    """All objects of a node by index and sub-index. `permit` is asked before each write; raises Abort to refuse it."""

    def __init__(self, objects: Iterable[Object], permit: Callable[[int], None] | None = None) -> None:
        self._permit = permit
        self._objects = {item.index: item for item in sorted(objects, key=lambda item: item.index)}
        self._entries = {item.index << 8 | entry.subindex: entry for item in self for entry in item.entries}

    def __iter__(self) -> Iterator[Object]:
        return iter(self._objects.values())

    def entry(self, index: int, subindex: int) -> Entry:
        """The entry. Raises Abort if there is none."""
        found = self._entries.get(index << 8 | subindex)
        if found is None:
            raise Abort(AbortCode.NO_SUBINDEX if index in self._objects else AbortCode.NO_OBJECT)
        return found

    def resume(self, former: Dictionary) -> None:
        """Take over every value that a client may have written.

        Where the defaults of an object are others now, it keeps these unless a client has changed the former ones.
        """
        for item in former:
            present = self._objects.get(item.index)
            if present is None:
                continue
            own = {entry.subindex: entry for entry in present.entries}
            entries = [
                entry
                for entry in item.entries
                if entry.access.writable and entry.sink is None and entry.subindex in own
            ]
            if all(entry.default == own[entry.subindex].default for entry in entries) or any(
                entry.value != entry.default for entry in entries
            ):
                for entry in entries:
                    own[entry.subindex].value = entry.value

    def read(self, index: int, subindex: int) -> bytes:
        """What an SDO upload returns. Raises Abort."""
        entry = self.entry(index, subindex)
        if not entry.access.readable:
            raise Abort(AbortCode.WRITE_ONLY)
        return entry.read()

    def write(self, index: int, subindex: int, data: bytes) -> Pending | None:
        """What an SDO download does; what it returns is answered when it is done. Raises Abort."""
        entry = self.entry(index, subindex)
        if not entry.access.writable:
            raise Abort(AbortCode.READ_ONLY)
        if self._permit is not None:
            self._permit(index)
        return entry.write(data)


def variable(index: int, entry: Entry) -> Object:
    """An object with sub-index 0 alone."""
    return Object(index, entry.name, ObjectCode.VAR, (entry,))


def array(index: int, name: str, entries: Iterable[Entry]) -> Object:
    """An array: `entries` from sub-index 1 on, all of one type."""
    return _composite(index, name, ObjectCode.ARRAY, tuple(entries))


def record(index: int, name: str, entries: Iterable[Entry]) -> Object:
    """A record: `entries` from sub-index 1 on."""
    return _composite(index, name, ObjectCode.RECORD, tuple(entries))


def _composite(index: int, name: str, code: ObjectCode, entries: tuple[Entry, ...]) -> Object:
    highest = bytes([entries[-1].subindex if entries else 0])
    head = Entry(0, "Highest sub-index supported", CanType.UNSIGNED8, Access.CONST, highest)
    return Object(index, name, code, entries if entries and entries[0].subindex == 0 else (head, *entries))
