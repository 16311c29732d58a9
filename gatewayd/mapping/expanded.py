"""A document, expanded: concrete variables and locks, and each link's side of the cell, with their places in the file.

`gatewayd.mapping.expand` makes it. What cannot be expanded is kept in it: rules make findings of that, and `compile`
takes only a cell without.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeVar

from gatewayd.core.definition import Direction, ValueKind
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.model import Group, VariableSpec


@dataclass(frozen=True, slots=True, kw_only=True)
class Defined:
    """One value of the robot that a line of the file names."""

    target: str
    """What it is in the robot, in full: `input_bit_register_5`, `actual_TCP_pose[0]`, `runtime_state`."""
    direction: Direction
    field: str
    """The field that carries it."""
    type: str
    """The robot's word for its type."""
    kind: ValueKind
    low: int | None
    """Least value of the robot's type; None for bits and reals."""
    high: int | None
    bit: int | None
    element: int | None
    usual: tuple[float, float] | None = None
    """Values that it takes in truth, where that is much less than its type holds."""
    valid_running: bool = False
    """Whether it is good only while the robot program runs."""
    grows: bool = False
    """It grows for ever."""
    moves: bool = False
    """Writing it moves the robot, whatever the variable is called."""
    via: str = ""
    """Name of the link that carries it, where the robot's packages do not; an input is a command then."""
    counterpart: str = ""
    """What lies on the other side: the input to write for an output, the output that reports for an input; or empty."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpandedVariable(Defined):
    """One variable after expansion."""

    index: int
    """Position in `ExpandedCell.variables`; the number that people see is one more."""
    name: str
    part: Part[VariableSpec]
    """The line it comes from."""
    member: int | None
    """Index within the family of its line (`recipe[3]`: 3); None for a single variable."""
    lock: int | None
    """Index into `ExpandedCell.locks`; None for outputs and where the group does not exist."""

    @property
    def spec(self) -> VariableSpec:
        """The line it comes from, typed."""
        return self.part.spec

    @property
    def range(self) -> tuple[float, float] | None:
        """What a number can be: its limits, what is known of it, or its type; None for bits and unknown reals."""
        if self.low is None or self.high is None:
            return (self.spec.limits or self.usual) if self.kind is ValueKind.FLOAT else None
        return self.spec.limits or self.usual or (self.low, self.high)

    @property
    def position(self) -> Position:
        """Place of the variable's name."""
        return self.part.key

    def at(self, *path: str | int) -> Position:
        """Place of a value of its line."""
        return self.part.at(*path)


@dataclass(frozen=True, slots=True)
class ExpandedLock:
    """What is owned together: one input variable or one group."""

    name: str
    members: tuple[int, ...]
    """Indices of variables."""
    owners: tuple[str, ...]
    """Writers by priority, `any` resolved; unknown names are left out."""
    is_any: bool
    takeover: bool
    lease: float | None
    whole: bool
    group: Part[Group] | None
    position: Position
    """Place of the owner, or of what declares the lock."""


@dataclass(frozen=True, slots=True)
class CellSettings:
    """What the kind of link that defines the variables says of the whole cell."""

    stale_after: float
    """Seconds without fresh values after which outputs are stale."""
    clear_on_connect: bool
    adopt_for: float | None
    rate: float
    """How often per second the robot reports and takes values, at most."""


class UndefinedError(Exception):
    """A line names nothing that the robot has; what exactly is for the kind of link to say that defines variables."""


@dataclass(frozen=True, slots=True)
class Unresolved:
    """A line of which no variable could be made."""

    part: Part[VariableSpec]
    error: UndefinedError


class ExpandedLink:
    """One link's side of a cell, laid out: a frozen dataclass of the link's own."""

    __slots__ = ()

    @property
    def is_complete(self) -> bool:
        """Whether everything in it could be laid out."""
        return True


_Link = TypeVar("_Link", bound=ExpandedLink)


@dataclass(frozen=True, slots=True)
class ExpandedCell:
    """A document, expanded."""

    document: Document
    variables: tuple[ExpandedVariable, ...]
    locks: tuple[ExpandedLock, ...]
    """By first variable."""
    unresolved: tuple[Unresolved, ...]
    settings: CellSettings
    links: Mapping[str, ExpandedLink] = field(default_factory=dict)
    """By key of the kind."""

    def link(self, kind: type[_Link]) -> _Link | None:
        """The side of the link of that type; None where the cell has none."""
        return next((link for link in self.links.values() if isinstance(link, kind)), None)

    @property
    def is_complete(self) -> bool:
        """Whether everything in it could be expanded."""
        return not self.unresolved and all(link.is_complete for link in self.links.values())
