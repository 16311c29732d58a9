"""Devices asked by hand (`gatewayd devices`): the part that a kind of link has in it.

A running link is asked by `Link.ask`, on the connection that it has. Where no gateway runs, the module that the kind's
declaration names (`LinkKind.access`) has an `ACCESS` that opens a connection of its own, and that finds out who answers
on a line. Nothing is written but by a request with a value, and never where a variable is mapped.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gatewayd.core.definition import CellDefinition
    from gatewayd.links.examination import RunningCell
    from gatewayd.mapping.plan import LinkPlan

PlainNumber = bool | int | float | str


class AccessProblem(Enum):
    """Why a device was not asked, or did not do it. The values are for programs."""

    BAD_PLACE = "bad_place"
    """No place of such a device, or no value for it: nothing was sent."""
    MAPPED = "mapped"
    """A variable is mapped there, whose value is not for the operator to write past its owner."""
    NO_ANSWER = "no_answer"
    REFUSED = "refused"
    """The device refuses."""
    TAKEN = "taken"
    """A running gateway has the line."""
    UNUSABLE = "unusable"
    """The line cannot be used at all."""


class AccessError(Exception):
    """A device was not asked, or did not do it; the text says why and what to do."""

    def __init__(self, problem: AccessProblem, text: str) -> None:
        super().__init__(text)
        self.problem = problem


@dataclass(frozen=True, slots=True)
class PlaceRequest:
    """What is read from a device or written to it, as somebody has typed it."""

    place: str
    """`holding:100..103`, `coil:0`, `0x6004`, `0x1018:1`."""
    type: str = ""
    """How its number is made: `int32`; empty: as it comes."""
    order: str = ""
    """Of the bytes of a number in several registers: `CDAB`; empty: as the device has them."""
    value: str | None = None
    """To be written; None: the place is read."""


@dataclass(frozen=True, slots=True)
class PlaceValue:
    """One value of a device."""

    place: str
    """`holding 100`, `6004h:00`."""
    value: PlainNumber
    raw: str
    """The bytes as the device has sent them, in hexadecimal digits; empty of a bit."""


@dataclass(frozen=True, slots=True)
class PlaceAnswer:
    """What was read, or was there before and is there now."""

    place: str
    """As `PlaceValue`, of all of it: `holding 100..103`."""
    values: tuple[PlaceValue, ...]
    former: tuple[PlaceValue, ...] = ()
    """Of a write: what stood there before; empty: it could not be read."""


@dataclass(frozen=True, slots=True)
class ScanOrder:
    """What somebody wants to know of a line."""

    line: str
    """`192.0.2.30:502`, `/dev/ttyUSB0`, `can0`."""
    first: int | None = None
    last: int | None = None
    """Numbers that are asked, both included; None: all that there can be."""
    timeout: float | None = None
    """Seconds for each answer; None: as is usual for the line."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """How the line is set up: `baudrate`, `parity`, `stop_bits`, `framing`, `interface`, `bitrate`, where given."""


@dataclass(frozen=True, slots=True)
class FoundDevice:
    """Who answers on a line."""

    number: int
    """Unit, or node-ID."""
    text: str
    """What it says of itself, in one piece; empty where it says nothing."""
    fields: Mapping[str, object] = field(default_factory=dict)
    """The same for programs."""


class Scan:
    """Asks one number after the other who is there. It only reads."""

    line: str
    """In words: `/dev/ttyUSB0 115200 8N1`."""
    asked: str
    """What is asked, in words: `holding register 0, and the identification`."""
    noun: str
    """What the numbers are: `unit`, `node`."""
    numbers: range
    longest: float
    """Seconds that it takes at most, where nobody answers."""

    def refusal(self, running: Sequence[RunningCell]) -> str:
        """Why it must not be done while these cells are served on this machine; empty: it may."""
        return ""

    def remarks(self, running: Sequence[RunningCell]) -> Sequence[str]:
        """What the user has to know before a scan."""
        return ()

    def run(self) -> AsyncIterator[FoundDevice | int]:
        """How many numbers were asked so far, again and again, and who was found. Raises AccessError."""
        raise NotImplementedError


class DeviceAccess:
    """Talks to devices of one kind of link where no gateway does."""

    settings: Sequence[str] = ()
    """Those of `ScanOrder.settings` that its lines have."""

    def takes(self, order: ScanOrder) -> bool:
        """Whether the line, as it is written, is one of its own."""
        return True

    def scan(self, order: ScanOrder) -> Scan:
        """How the line is scanned. Raises AccessError where it is none."""
        raise NotImplementedError

    def refusal(self, plan: LinkPlan, running: Sequence[RunningCell]) -> str:
        """Why the device must not be asked directly while these cells are served; empty: it may."""
        return ""

    async def ask(self, plan: LinkPlan, cell: CellDefinition, request: PlaceRequest) -> PlaceAnswer:
        """Read or write a place of the device, on a connection for this purpose. Raises AccessError."""
        raise NotImplementedError
