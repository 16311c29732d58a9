"""Whether a request may be carried out: judged whole, on the state of one moment, changing nothing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from gatewayd.core.definition import OPERATOR, Value, Variable, Writer
from gatewayd.core.image import ProcessImage
from gatewayd.core.limits import window, within
from gatewayd.core.ownership import MOVES, Act, LockTable, Move, Standing
from gatewayd.core.refusal import PRECEDENCE, Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.core.supervision import patience


@dataclass(frozen=True, slots=True)
class Change:
    """One variable of a write request."""

    variable: int
    value: Value
    implied: bool = False
    """A bit that is written only because its whole register is. Its writer means it if it owns it, or could take it as
    its only possible owner. Any other is let pass unwritten if it is unchanged, and stands in the way if it is not: the
    writer may have read the word before somebody else changed that bit."""


def contradiction(changes: Iterable[Change]) -> Refusal | None:
    """The first variable that a request gives two values.

    For links that can put a variable into one request twice; the judgement of the others need not look for it.
    """
    values: dict[int, Value] = {}
    for change in changes:
        if values.setdefault(change.variable, change.value) != change.value:
            return Refusal(Reason.CONTRADICTED, change.variable)
    return None


def value_for(changes: Iterable[Change], variable: int | None) -> Value | None:
    """What a request gives the variable; None: nothing."""
    return next((change.value for change in changes if change.variable == variable), None)


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

    def __init__(
        self,
        variables: Sequence[Variable],
        writers: Sequence[Writer],
        ownership: LockTable,
        image: ProcessImage,
    ) -> None:
        self._variables = tuple(variables)
        self._writers = tuple(writers)
        self._ownership = ownership
        self._image = image
        self._locks = tuple(variable.lock for variable in variables)
        self._windows = tuple(map(window, variables))
        self._sole = tuple(len(lock.owners) == 1 for lock in ownership.locks)

    def judge(self, requester: Requester, changes: Sequence[Change], *, adopted: bool) -> Verdict:
        """The verdict on all changes together; `adopted`: the robot is there and its inputs were taken over.

        If several changes stand in the way, `PRECEDENCE` says which refusal is reported. A peer that no writer
        is declared for may write nothing. Of a writer that is not trusted, or that asked too long ago, nothing is
        applied, not even what would change nothing.
        """
        writer, trusted = requester.writer, requester.trusted
        if writer is not None and adopted and trusted and not requester.waited:
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
        verdict.refusal = _graver(verdict.refusal, self._partial_takeover(writer, verdict))
        first = changes[0].variable if changes else None
        if not trusted:
            verdict.refusal = _graver(verdict.refusal, Refusal(Reason.HEARTBEAT_LOST, first))
        if self.is_late(requester, verdict.moves):
            verdict.refusal = _graver(verdict.refusal, Refusal(Reason.WAITED, first))
        return verdict

    def judge_lock(self, requester: Requester, variable: int, act: Act) -> Move | Refusal:
        """What a request or a release of the lock that guards `variable` would do. A release is never too late."""
        writer, lock = requester.writer, self._locks[variable]
        if writer is None or lock is None:
            return Refusal(Reason.NOT_WRITABLE, variable)
        move = self._ownership.decide(lock, writer, act)
        if move is Move.REFUSE_NEVER:
            return Refusal(Reason.NOT_WRITABLE, variable)
        if not requester.trusted:
            return Refusal(Reason.HEARTBEAT_LOST, variable)
        if act is Act.REQUEST and self.is_late(requester, (lock,) if move <= Move.TAKE_OVER else ()):
            return Refusal(Reason.WAITED, variable)
        if move is Move.REFUSE_HELD:
            return Refusal(Reason.HELD, variable, self._ownership.owners[lock])
        return move

    def is_late(self, requester: Requester, locks: Iterable[int] = ()) -> bool:
        """Whether the request waited for longer than its writer may be silent, or the leases of these locks last."""
        writer, waited = requester.writer, requester.waited
        if not waited or writer is None:
            return False
        declared = self._ownership.locks
        return waited > patience(self._writers[writer], (declared[lock].lease for lock in locks))

    def _usual(self, writer: int, changes: Sequence[Change]) -> Verdict | None:
        """The usual request: its writer owns all of it, and nothing stands in the way. None: it has to be judged.

        What `_judge` would come to as well, change by change, in a quarter of the time.
        """
        locks, windows, variables = self._locks, self._windows, self._variables
        owners, available = self._ownership.owners, self._image.available
        verdict = Verdict()
        values, moves = verdict.values, verdict.moves
        for change in changes:
            index = change.variable
            lock = locks[index]
            if lock is None or owners[lock] != writer or not available[index]:
                return None
            value = change.value
            low, high = windows[index]
            if not low <= value <= high:
                allowed = within(variables[index], value)
                if allowed is None:
                    return None
                value = allowed
            values.append((index, value))
            moves[lock] = Move.RENEW
        return verdict

    def _judge(self, writer: int, change: Change, verdict: Verdict, *, adopted: bool) -> Refusal | None:
        index = change.variable
        variable = self._variables[index]
        lock = variable.lock
        standing = Standing.EXCLUDED if lock is None else self._ownership.standing(lock, writer)
        meant = not change.implied or self._means_implied(lock, standing)
        unchanged = change.implied and change.value == self._image.values[index]
        if unchanged and not meant:
            return None
        if lock is None or standing is Standing.EXCLUDED:
            return Refusal(Reason.NOT_WRITABLE, index)
        value = within(variable, change.value)
        if value is None:
            return Refusal(Reason.OUT_OF_LIMITS, index)
        if standing is Standing.OWNER:
            verdict.moves[lock] = Move.RENEW
        if not adopted:
            return Refusal(Reason.ROBOT_LOST, index)
        if not self._image.available[index]:
            return None if unchanged else Refusal(Reason.CLAIMED_ELSEWHERE, index)
        if standing is Standing.LOWER:
            return Refusal(Reason.HELD, index, self._ownership.owners[lock])
        if not meant:
            return Refusal(Reason.NOT_MEANT, index)
        verdict.moves[lock] = MOVES[standing, Act.WRITE]
        verdict.values.append((index, value))
        return None

    def _means_implied(self, lock: int | None, standing: Standing) -> bool:
        if standing is Standing.OWNER:
            return True
        return standing is Standing.FREE and lock is not None and self._sole[lock]

    def _partial_takeover(self, writer: int | None, verdict: Verdict) -> Refusal | None:
        """Why a takeover may not be, if a group is to be taken over whole and it is not.

        The local operator may: what is not forced falls back.
        """
        if writer == OPERATOR:
            return None
        for lock, move in verdict.moves.items():
            declared = self._ownership.locks[lock]
            if move is not Move.TAKE_OVER or not declared.whole:
                continue
            written = [index for index, _value in verdict.values if index in declared.members]
            if len(set(written)) < len(declared.members):
                return Refusal(Reason.PARTIAL_TAKEOVER, written[0])
        return None


def _graver(first: Refusal | None, other: Refusal | None) -> Refusal | None:
    """Which of two refusals is reported; of equal ones the first."""
    if first is None or other is None:
        return first or other
    return other if PRECEDENCE[other.reason] < PRECEDENCE[first.reason] else first
