"""Whether a write request may be applied: judged whole, on the state of one moment, changing nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from gatewayd.core.definition import Value, Variable
from gatewayd.core.image import ProcessImage
from gatewayd.core.limits import has_no_limits, within
from gatewayd.core.ownership import MOVES, Act, LockTable, Move, Standing
from gatewayd.core.refusal import PRECEDENCE, Reason, Refusal
from gatewayd.core.requester import Requester

__all__ = ["Admission", "Change", "Verdict"]


@dataclass(frozen=True, slots=True)
class Change:
    """One variable of a write request."""

    variable: int
    value: Value
    implied: bool = False
    """A bit that is written only because its whole register is. Where somebody else holds its lock, or the writer may
    never have it, an unchanged bit is let pass unwritten; a changed one is judged like any other."""


@dataclass(slots=True)
class Verdict:
    """What a request would do. With a refusal only the renewals among the moves may be carried out."""

    refusal: Refusal | None = None
    values: list[tuple[int, Value]] = field(default_factory=list)
    """Variable and value, clamped where the mapping says so."""
    moves: dict[int, Move] = field(default_factory=dict)
    """Lock and what becomes of it."""


class Admission:
    """Judges requests against the definition, the owners and the image."""

    __slots__ = ("_image", "_locks", "_ownership", "_unlimited", "_variables")

    def __init__(self, variables: Sequence[Variable], ownership: LockTable, image: ProcessImage) -> None:
        self._variables = tuple(variables)
        self._ownership = ownership
        self._image = image
        self._locks = tuple(variable.lock for variable in variables)
        self._unlimited = tuple(has_no_limits(variable) for variable in variables)

    def judge(self, requester: Requester, changes: Sequence[Change], *, adopted: bool) -> Verdict:
        """The verdict on all changes together; `adopted`: the robot is there and its inputs were taken over.

        If several changes stand in the way, `PRECEDENCE` says which refusal is told. A peer that no writer
        is declared for may write nothing. Of a writer that is not trusted nothing is applied, not even what would
        change nothing.
        """
        writer, trusted = requester.writer, requester.trusted
        if writer is not None and adopted and trusted:
            usual = self._usual(writer, changes)
            if usual is not None:
                return usual
        verdict = Verdict()
        for change in changes:
            refusal = (
                Refusal(Reason.NOT_WRITABLE, change.variable)
                if writer is None
                else self._judge(writer, change, verdict, adopted=adopted)
            )
            verdict.refusal = _graver(verdict.refusal, refusal)
        if not trusted:
            first = changes[0].variable if changes else None
            verdict.refusal = _graver(verdict.refusal, Refusal(Reason.HEARTBEAT_LOST, first))
        return verdict

    def _usual(self, writer: int, changes: Sequence[Change]) -> Verdict | None:
        """The usual request: its writer owns all of it, and nothing stands in the way. None: it has to be judged.

        What `_judge` would come to as well, change by change, in a quarter of the time.
        """
        locks, unlimited, variables = self._locks, self._unlimited, self._variables
        owners, available = self._ownership.owners, self._image.available
        verdict = Verdict()
        values, moves = verdict.values, verdict.moves
        for change in changes:
            index = change.variable
            lock = locks[index]
            if lock is None or owners[lock] != writer or not available[index]:
                return None
            value = change.value if unlimited[index] else within(variables[index], change.value)
            if value is None:
                return None
            values.append((index, value))
            moves[lock] = Move.RENEW
        return verdict

    def _judge(self, writer: int, change: Change, verdict: Verdict, *, adopted: bool) -> Refusal | None:
        index = change.variable
        variable = self._variables[index]
        lock = variable.lock
        standing = Standing.STRANGER if lock is None else self._ownership.standing(lock, writer)
        owned = standing is Standing.OWNER
        takeable = owned or standing is Standing.FREE
        unchanged = change.implied and change.value == self._image.values[index]
        if unchanged and not takeable:
            return None
        if lock is None or (not takeable and standing is Standing.STRANGER):
            return Refusal(Reason.NOT_WRITABLE, index)
        value = within(variable, change.value)
        if value is None:
            return Refusal(Reason.OUT_OF_LIMITS, index)
        if owned:
            verdict.moves[lock] = Move.RENEW
        if not adopted:
            return Refusal(Reason.ROBOT_LOST, index)
        if not self._image.available[index]:
            return None if unchanged else Refusal(Reason.CLAIMED_ELSEWHERE, index)
        if standing is Standing.LOWER:
            return Refusal(Reason.HELD, index, self._ownership.owners[lock])
        if not owned:
            verdict.moves[lock] = MOVES[standing, Act.WRITE]
        verdict.values.append((index, value))
        return None


def _graver(told: Refusal | None, other: Refusal | None) -> Refusal | None:
    """Which of two refusals is told; of equal ones the first."""
    if told is None or other is None:
        return told or other
    return other if PRECEDENCE[other.reason] < PRECEDENCE[told.reason] else told
