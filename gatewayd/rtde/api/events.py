"""What happens to a robot, as values. `str` of each is a line for people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from gatewayd.report.format import counted
from gatewayd.rtde.loss import Loss
from gatewayd.rtde.messages import TextLevel
from gatewayd.rtde.session import Session, Unavailable

Address: TypeAlias = tuple[str, int]
"""Host and port."""


@dataclass(frozen=True, slots=True)
class ConnectedEvent:
    """The TCP connection is open; the set-up begins."""

    own_address: Address | None
    peer_address: Address | None

    def __str__(self) -> str:
        return f"connected to {_shown(self.peer_address)} from {_shown(self.own_address)}"


@dataclass(frozen=True, slots=True)
class SetUpEvent:
    """Version, recipes and rate are agreed, at the start of a session or by `Robot.set_up`."""

    session: Session

    def __str__(self) -> str:
        session = self.session
        outputs, inputs = counted(len(session.outputs.names), "output"), len(session.inputs)
        return (
            f"set up: software {session.controller}, protocol {session.protocol}, {outputs}, "
            f"{counted(inputs, 'input recipe')}, {1 / session.period:g} Hz"
        )


@dataclass(frozen=True, slots=True)
class StartedEvent:
    """The output runs, for the first time in a session or after a pause."""

    def __str__(self) -> str:
        return "started"


@dataclass(frozen=True, slots=True)
class PausedEvent:
    """The output is paused."""

    def __str__(self) -> str:
        return "paused"


@dataclass(frozen=True, slots=True)
class LostEvent:
    """A session has ended."""

    loss: Loss
    final: bool
    """No new connection is tried by itself."""

    def __str__(self) -> str:
        return f"lost: {self.loss.text}{_next(self.loss, final=self.final)}"


@dataclass(frozen=True, slots=True)
class AttemptFailedEvent:
    """An attempt at a session has failed."""

    loss: Loss
    final: bool
    """No further one is made by itself."""

    def __str__(self) -> str:
        return f"{self.loss.text}{_next(self.loss, final=self.final)}"


@dataclass(frozen=True, slots=True)
class TextEvent:
    """The controller has sent a text (guide, RTDE_TEXT_MESSAGE)."""

    message: str
    source: str
    """Empty in protocol version 1."""
    level: int
    """A `TextLevel`, or whatever else the controller sent."""

    def __str__(self) -> str:
        level = TextLevel(self.level).name.lower() if self.level in set(TextLevel) else f"level {self.level}"
        return f"{level}{f' of {self.source}' if self.source else ''}: {self.message}"


@dataclass(frozen=True, slots=True)
class ErrorEvent:
    """Something that ends no session: a package that could not be taken as it came."""

    text: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class RefusedEvent:
    """Wanted fields that the controller does not give, at a set-up or when that has changed."""

    fields: tuple[Unavailable, ...]

    def __str__(self) -> str:
        return "not available: " + "; ".join(
            f"{each.field} ({each.word}, {each.hint})" for each in self.fields
        )


@dataclass(frozen=True, slots=True)
class OverflowEvent:
    """A stream was not read fast enough: its oldest samples are gone. Sent at the first, and when reading goes on."""

    lost: int
    """Since the reader fell behind."""
    total: int
    """Of this stream."""

    def __str__(self) -> str:
        return f"{counted(self.lost, 'sample')} lost, as they were not read in time ({self.total} in all)"


RobotEvent: TypeAlias = (
    ConnectedEvent
    | SetUpEvent
    | StartedEvent
    | PausedEvent
    | LostEvent
    | AttemptFailedEvent
    | TextEvent
    | ErrorEvent
    | RefusedEvent
    | OverflowEvent
)
"""Any of them."""


def _shown(address: Address | None) -> str:
    return "an unknown address" if address is None else f"{address[0]}:{address[1]}"


def _next(loss: Loss, *, final: bool) -> str:
    return "; given up" if final else f"; next attempt in {loss.retry_in:g} s"
