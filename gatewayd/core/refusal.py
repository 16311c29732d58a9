"""Why a request was refused. Links translate a reason into their protocol's own code; none is ever silent."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Reason(IntEnum):
    """The numbers stand in the status block: never renumber, only append."""

    NO_SUCH_ADDRESS = 1
    """Nothing is mapped there."""
    NOT_WRITABLE = 2
    """This writer may never write it."""
    HELD = 3
    """Another writer owns it now."""
    OUT_OF_LIMITS = 4
    """The value is outside the declared limits or the robot's type."""
    PARTIAL_VALUE = 5
    """The request covers a part of a value."""
    ROBOT_LOST = 6
    """The robot is not connected, or its inputs were not yet adopted."""
    CLAIMED_ELSEWHERE = 7
    """The controller gave the register to another client, or does not have it."""
    HEARTBEAT_LOST = 8
    """The writer promised a heartbeat, and it stays away."""
    PARTIAL_TAKEOVER = 9
    """The request would take a group over from its owner and write only a part of it."""
    WAITED = 10
    """The request waited while the gateway stood still, for longer than its writer may be silent."""
    NOT_MEANT = 11
    """It would change a bit that only shares a register with what the writer owns."""
    CONTRADICTED = 12
    """The request gives a variable two values."""
    NOT_IN_ROLE = 13
    """The role of the peer has no right to it."""

    @property
    def text(self) -> str:
        """The reason in words, for logs and tables."""
        return _TEXTS[self]

    @property
    def renews(self) -> bool:
        """Whether the owner keeps its lease: only the robot's absence stood in the way.

        Any other refusal renews nothing, so that an owner whose requests are refused falls back to its declared state
        instead of leaving its last accepted values in force.
        """
        return self is Reason.ROBOT_LOST


_TEXTS = {
    Reason.NO_SUCH_ADDRESS: "no variable at this address",
    Reason.NOT_WRITABLE: "never writable by this writer",
    Reason.HELD: "held by another owner",
    Reason.OUT_OF_LIMITS: "value out of limits",
    Reason.PARTIAL_VALUE: "only a part of a value was written",
    Reason.ROBOT_LOST: "robot not connected",
    Reason.CLAIMED_ELSEWHERE: "register claimed elsewhere",
    Reason.HEARTBEAT_LOST: "its heartbeat is missing",
    Reason.PARTIAL_TAKEOVER: "the group is taken over whole or not at all",
    Reason.WAITED: "it waited while the gateway stood still",
    Reason.NOT_MEANT: "bit or byte of a shared register that the writer does not own",
    Reason.CONTRADICTED: "one request gave it two values",
    Reason.NOT_IN_ROLE: "its role has no right to it",
}

PRECEDENCE = {
    Reason.NO_SUCH_ADDRESS: 0,
    Reason.NOT_IN_ROLE: 1,
    Reason.NOT_WRITABLE: 2,
    Reason.PARTIAL_VALUE: 3,
    Reason.CONTRADICTED: 4,
    Reason.OUT_OF_LIMITS: 5,
    Reason.HEARTBEAT_LOST: 6,
    Reason.WAITED: 7,
    Reason.ROBOT_LOST: 8,
    Reason.CLAIMED_ELSEWHERE: 9,
    Reason.PARTIAL_TAKEOVER: 10,
    Reason.HELD: 11,
    Reason.NOT_MEANT: 12,
}
"""Which reason is reported when several apply: what can never work first, what may pass soon last. A lost heartbeat
stands before the robot's absence, which leaves an owner its lease: who is not heard keeps nothing alive."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """A request that was refused whole."""

    reason: Reason
    variable: int | None = None
    """Index of the first variable that stood in the way."""
    holder: int | None = None
    """Index of the writer that owns it, for `Reason.HELD`."""
    request: str = ""
    """What was asked for, in words of the link, where no variable tells it: `wrote holding 101`."""
    hint: str = ""
    """What could have been meant, in words of the link: `nearest: part_done 100`."""
