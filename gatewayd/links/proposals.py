"""What a kind of link proposes for a mapping from the data sheet of a device: the contract for `gatewayd import`."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class RemarkKind(Enum):
    """How bad it is."""

    ERROR = "error"
    """Something cannot be carried over."""
    DOUBT = "doubt"
    """Something was understood in one of several ways, or the data sheet does not say it."""
    NOTE = "note"
    """Nothing to do, but worth knowing."""


@dataclass(frozen=True, slots=True)
class SheetRemark:
    """What the user of a proposal has to know."""

    line: int
    """Of the data sheet, from 1."""
    kind: RemarkKind
    text: str
    hint: str = ""


@dataclass(frozen=True, slots=True)
class SheetSettings:
    """What no data sheet says."""

    cell: str
    host: str
    """Of the robot's controller."""
    device: str
    """Its name in the mapping."""
    bus: str
    node: int
    path: str
    """Of the data sheet, as the mapping names it."""


@dataclass(frozen=True, slots=True)
class SheetProposal:
    """A mapping file."""

    text: str
    """Empty where there is nothing to propose."""
    remarks: tuple[SheetRemark, ...]
    """In the order of the data sheet."""
    variables: int


class SheetReader:
    """Reads data sheets of one kind of devices."""

    def propose(self, data: bytes, settings: SheetSettings) -> SheetProposal:
        """A mapping with the device and its variables; what cannot be carried over is left out, and an error. Total.

        `data`: the content of the file, whatever it is.
        """
        raise NotImplementedError
