"""One robot cell: the only place where values, owners, freshness and fallbacks meet.

Links call it; it calls its `listeners` after values or qualities changed. Every method that needs the time takes it
(`now`, seconds of the monotonic clock), so that nothing here waits, sleeps or reads a clock.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from gatewayd.core.definition import CellDefinition, Direction, FallbackKind, Value, Variable
from gatewayd.core.events import Event, EventKind, EventRing
from gatewayd.core.freshness import Freshness, Source
from gatewayd.core.health import Health
from gatewayd.core.image import ProcessImage, Quality
from gatewayd.core.limits import within
from gatewayd.core.ownership import Act, LockTable, Move, Standing
from gatewayd.core.refusal import PRECEDENCE, Reason, Refusal
from gatewayd.core.supervision import WriterTable

__all__ = ["HEARTBEAT_PERIOD", "REFUSAL_INTERVAL", "Cell", "Change", "LastRefusal"]

HEARTBEAT_PERIOD = 0.1
"""Seconds between two counts of the heartbeat."""
REFUSAL_INTERVAL = 10.0
"""Seconds in which equal refusals are counted instead of told again: a refused PLC may retry a hundred times a second."""


@dataclass(frozen=True, slots=True)
class Change:
    """One variable of a write request."""

    variable: int
    value: Value
    implied: bool = False
    """A bit that is written only because its whole register is. It is written if the writer may have its lock without
    a takeover; otherwise it must carry its present value, or the request is refused."""


@dataclass(frozen=True, slots=True)
class LastRefusal:
    """What the status block tells of the last refusal."""

    refusal: Refusal
    writer: int | None
    time: float


class Cell:
    """State of one robot cell."""

    def __init__(self, definition: CellDefinition) -> None:
        self.definition = definition
        self.image = ProcessImage(definition.variables)
        self.ownership = LockTable(definition.locks)
        self.writers = WriterTable(definition.writers)
        self.freshness = Freshness(definition.stale_after)
        self.events = EventRing()
        self.health = Health()
        self.listeners: list[Callable[[Direction], None]] = []
        self.last_refusal: LastRefusal | None = None
        self.unreadable: frozenset[int] = frozenset()
        """Outputs whose policy is `exception` and whose value is not good now."""
        self._outputs = _indices(definition.variables, Direction.OUTPUT)
        self._inputs = _indices(definition.variables, Direction.INPUT)
        self._available = [True] * len(definition.variables)
        self._adopted = False
        self._due_fallbacks: set[int] = set()
        self._refusals: dict[tuple[int | None, int | None, Reason], tuple[float, int]] = {}
        self._next_heartbeat: float | None = None
        self._update_unreadable()

    @property
    def accepts_writes(self) -> bool:
        """Whether the robot is connected and its inputs were adopted."""
        return self._adopted

    # -- fieldbus side -------------------------------------------------------------------------------------------

    def write(self, writer: int | None, changes: Sequence[Change], now: float) -> Refusal | None:
        """Apply all changes, or none and return why not. A writer of None is a peer that no writer was declared for."""
        self._release_expired(now)
        accepted: list[tuple[int, Value]] = []
        moves: dict[int, Move] = {}
        refusal: Refusal | None = None
        for change in changes:
            refused = self._judge(writer, change, accepted, moves)
            if refused is not None and (
                refusal is None or PRECEDENCE[refused.reason] < PRECEDENCE[refusal.reason]
            ):
                refusal = refused
        if refusal is not None:
            if writer is not None and refusal.reason.of_the_robot:
                self._renew(writer, moves, now)
            self.refuse(writer, refusal, now, _value_for(changes, refusal.variable))
            return refusal
        if writer is not None:
            self._move(writer, moves, now)
        self._set_inputs(accepted, now)
        self.health.writes_accepted += 1
        return None

    def refuse(self, writer: int | None, refusal: Refusal, now: float, value: Value | None = None) -> None:
        """Count and record a refusal; equal ones are told once per `REFUSAL_INTERVAL`."""
        self.health.writes_refused += 1
        self.last_refusal = LastRefusal(refusal, writer, now)
        key = (writer, refusal.variable, refusal.reason)
        told, repeats = self._refusals.get(key, (-REFUSAL_INTERVAL, 0))
        if now - told < REFUSAL_INTERVAL:
            self._refusals[key] = (told, repeats + 1)
            return
        self._refusals[key] = (now, 0)
        variable = refusal.variable
        self.events.append(
            Event(
                now,
                EventKind.REFUSED,
                variable=variable,
                lock=self.definition.variables[variable].lock if variable is not None else None,
                writer=writer,
                other=refusal.holder,
                reason=refusal.reason,
                old=self.image.values[variable] if variable is not None else None,
                new=value,
                repeats=repeats,
            )
        )

    def request(self, writer: int | None, variable: int, now: float) -> Refusal | None:
        """Take the lock that guards `variable` (and with it its whole group) without writing a value."""
        return self._act(writer, variable, Act.REQUEST, now)

    def release(self, writer: int | None, variable: int, now: float) -> Refusal | None:
        """Give the lock that guards `variable` back; its release fallback applies."""
        return self._act(writer, variable, Act.RELEASE, now)

    def release_all(self, writer: int, now: float, detail: str = "released by its owner") -> None:
        """Give every lock of `writer` back."""
        self._free(self.ownership.held_by(writer), now, detail)

    def writer_connected(self, writer: int, now: float, detail: str = "") -> None:
        """One more connection of the writer."""
        if self.writers.connected(writer, now):
            self.events.append(Event(now, EventKind.WRITER_CONNECTED, writer=writer, detail=detail))

    def writer_seen(self, writer: int, now: float) -> None:
        """Any request of the writer feeds its supervision, a read as well."""
        if self.writers.seen(writer, now):
            self.events.append(Event(now, EventKind.WRITER_CONNECTED, writer=writer, detail="heard again"))

    def writer_disconnected(self, writer: int, now: float, reason: str) -> None:
        """One connection less; with the last one the writer is lost and its locks are released."""
        if self.writers.disconnected(writer):
            self._writer_lost(writer, now, reason)

    # -- robot side ----------------------------------------------------------------------------------------------

    def robot_connected(self, now: float, detail: str = "") -> None:
        """A session with the controller has begun; nothing is written before `adopt`."""
        self.freshness.connected()
        self.health.sessions += 1
        self.events.append(Event(now, EventKind.ROBOT_CONNECTED, detail=detail))

    def robot_lost(self, reason: str, now: float) -> None:
        """The session has ended: outputs and inputs are stale until the next one."""
        if self.freshness.state is Source.LOST:
            return
        was_fresh = self.freshness.state is Source.FRESH
        self.freshness.lost()
        self._adopted = False
        self.health.frequency = 0.0
        self.events.append(Event(now, EventKind.ROBOT_LOST, detail=reason))
        self._set_quality(self._inputs, Quality.STALE)
        if was_fresh:
            self._go_stale()
        self._notify(Direction.INPUT)

    def package_arrived(self, timestamp: float | None, now: float) -> bool:
        """Whether the package tells anything new. If so, the link copies its values and calls `outputs_written`."""
        self.health.packages += 1
        was_fresh = self.freshness.state is Source.FRESH
        news = self.freshness.package(timestamp, now)
        if news and not was_fresh:
            self._go_fresh(now)
        return news

    def outputs_written(self, now: float) -> None:
        """The link has copied a package's values into the image."""
        self.image.output_time = now
        self._notify(Direction.OUTPUT)

    def adopt(self, values: Mapping[int, Value], now: float) -> None:
        """Take over what the controller's inputs hold, then apply the fallbacks that fell due meanwhile.

        Called once per session, and again for registers that became available later.
        """
        first = not self._adopted
        self._adopted = True
        for index, value in values.items():
            self.image.values[index] = value
            self.image.times[index] = now
        self._refresh_quality()
        if first:
            self.events.append(Event(now, EventKind.INPUTS_ADOPTED, detail=f"{len(values)} variables"))
        due = {index for index in values if index in self._due_fallbacks or self._wants_fallback(index)}
        self._due_fallbacks -= due
        self._fall_back(sorted(due), now)
        self._notify(Direction.INPUT)

    def set_availability(self, variables: Iterable[int], available: bool, reason: str, now: float) -> None:
        """The controller gave or refused the register (or field) behind these variables."""
        changed = [index for index in variables if self._available[index] != available]
        if not changed:
            return
        kind = EventKind.AVAILABLE if available else EventKind.UNAVAILABLE
        for index in changed:
            self._available[index] = available
            self.events.append(Event(now, kind, variable=index, detail=reason))
            if not available:
                self._show_unavailable(index)
        self._refresh_quality()
        self._notify(Direction.INPUT)
        self._notify(Direction.OUTPUT)

    def is_available(self, variable: int) -> bool:
        """Whether the controller has the variable's field, and gave it to us if it is an input."""
        return self._available[variable]

    # -- time ----------------------------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """Notice what only time brings: ended leases, silent writers, a silent or frozen robot."""
        self._release_expired(now)
        for writer in self.writers.silent(now):
            self.writers.lose(writer)
            self._writer_lost(writer, now, f"no request for {self.definition.writers[writer].timeout:g} s")
        was_fresh = self.freshness.state is Source.FRESH
        self.freshness.tick(now)
        if was_fresh and self.freshness.state is not Source.FRESH:
            self.events.append(Event(now, EventKind.STALE, detail=self.freshness.state.name.lower()))
            self._go_stale()
        self._beat(now)

    # -- inside --------------------------------------------------------------------------------------------------

    def _judge(
        self, writer: int | None, change: Change, accepted: list[tuple[int, Value]], moves: dict[int, Move]
    ) -> Refusal | None:
        index = change.variable
        variable = self.definition.variables[index]
        lock = variable.lock
        if writer is None or lock is None:
            standing = Standing.STRANGER
        else:
            standing = self.ownership.standing(lock, writer)
        unchanged = change.implied and change.value == self.image.values[index]
        if unchanged and standing not in (Standing.FREE, Standing.OWNER):
            return None
        if writer is None or lock is None or standing is Standing.STRANGER:
            return Refusal(Reason.NOT_WRITABLE, index)
        value = within(variable, change.value)
        if value is None:
            return Refusal(Reason.OUT_OF_LIMITS, index)
        if standing is Standing.OWNER:
            moves[lock] = Move.RENEW
        if not self._adopted:
            return Refusal(Reason.ROBOT_LOST, index)
        if not self._available[index]:
            return None if unchanged else Refusal(Reason.CLAIMED_ELSEWHERE, index)
        if standing is Standing.LOWER:
            return Refusal(Reason.HELD, index, self.ownership.owners[lock])
        moves[lock] = self.ownership.decide(lock, writer, Act.WRITE)
        accepted.append((index, value))
        return None

    def _act(self, writer: int | None, variable: int, act: Act, now: float) -> Refusal | None:
        self._release_expired(now)
        lock = self.definition.variables[variable].lock
        if writer is None or lock is None:
            refusal = Refusal(Reason.NOT_WRITABLE, variable)
        else:
            move = self.ownership.decide(lock, writer, act)
            if move is Move.RELEASE:
                self._free([lock], now, "released by its owner")
            elif move < Move.REFUSE_HELD:
                self._move(writer, {lock: move}, now)
            if move < Move.REFUSE_HELD:
                return None
            held = move is Move.REFUSE_HELD
            refusal = Refusal(
                Reason.HELD if held else Reason.NOT_WRITABLE,
                variable,
                self.ownership.owners[lock] if held else None,
            )
        self.refuse(writer, refusal, now)
        return refusal

    def _move(self, writer: int, moves: Mapping[int, Move], now: float) -> None:
        for lock, move in moves.items():
            former = self.ownership.owners[lock]
            self.ownership.apply(lock, writer, move, now)
            if move is Move.ACQUIRE:
                self.events.append(Event(now, EventKind.ACQUIRED, lock=lock, writer=writer))
            elif move is Move.TAKE_OVER:
                self.events.append(Event(now, EventKind.TAKEN_OVER, lock=lock, writer=writer, other=former))

    def _renew(self, writer: int, moves: Mapping[int, Move], now: float) -> None:
        for lock, move in moves.items():
            if move is Move.RENEW:
                self.ownership.apply(lock, writer, move, now)

    def _release_expired(self, now: float) -> None:
        expired = self.ownership.expired(now)
        if expired:
            self._free(expired, now, "lease ended")

    def _free(self, locks: Sequence[int], now: float, detail: str) -> None:
        for lock in locks:
            owner = self.ownership.free(lock)
            self.events.append(Event(now, EventKind.RELEASED, lock=lock, writer=owner, detail=detail))
        self._fall_back([index for lock in locks for index in self.ownership.locks[lock].members], now)
        if locks:
            self._notify(Direction.INPUT)

    def _writer_lost(self, writer: int, now: float, reason: str) -> None:
        self.events.append(Event(now, EventKind.WRITER_LOST, writer=writer, detail=reason))
        self._free(self.ownership.held_by(writer), now, f"owner lost: {reason}")

    def _wants_fallback(self, index: int) -> bool:
        lock = self.definition.variables[index].lock
        return self.definition.clear_on_connect and lock is not None and self.ownership.owners[lock] is None

    def _fall_back(self, variables: Sequence[int], now: float) -> None:
        for index in variables:
            if not (self._adopted and self._available[index]):
                self._due_fallbacks.add(index)
                continue
            variable = self.definition.variables[index]
            old = self.image.values[index]
            new = variable.on_release.apply(old, variable.kind)
            if new != old:
                self.image.values[index] = new
                self.image.times[index] = now
                self.events.append(Event(now, EventKind.FALLBACK, variable=index, old=old, new=new))

    def _set_inputs(self, accepted: Iterable[tuple[int, Value]], now: float) -> None:
        image = self.image
        for index, value in accepted:
            image.values[index] = value
            image.times[index] = now
        self._notify(Direction.INPUT)

    def _go_fresh(self, now: float) -> None:
        self.events.append(Event(now, EventKind.FRESH))
        self._refresh_quality()

    def _go_stale(self) -> None:
        for index in self._outputs:
            if self.image.quality[index] is Quality.GOOD:
                variable = self.definition.variables[index]
                self.image.values[index] = variable.on_stale.apply(self.image.values[index], variable.kind)
        self._set_quality(self._outputs, Quality.STALE)
        self._update_unreadable()
        self._notify(Direction.OUTPUT)

    def _show_unavailable(self, index: int) -> None:
        self.image.quality[index] = Quality.UNAVAILABLE
        variable = self.definition.variables[index]
        if variable.direction is Direction.OUTPUT:
            self.image.values[index] = variable.on_stale.apply(self.image.values[index], variable.kind)

    def _set_quality(self, variables: Iterable[int], quality: Quality) -> None:
        for index in variables:
            if self.image.quality[index] is Quality.NEVER and quality is Quality.STALE:
                continue
            self.image.quality[index] = quality if self._available[index] else Quality.UNAVAILABLE

    def _refresh_quality(self) -> None:
        if self._adopted:
            self._set_quality(self._inputs, Quality.GOOD)
        if self.freshness.state is Source.FRESH:
            self._set_quality(self._outputs, Quality.GOOD)
        self._update_unreadable()

    def _update_unreadable(self) -> None:
        self.unreadable = frozenset(
            index
            for index in self._outputs
            if self.definition.variables[index].on_stale.kind is FallbackKind.EXCEPTION
            and self.image.quality[index] is not Quality.GOOD
        )

    def _beat(self, now: float) -> None:
        if self._next_heartbeat is None:
            self.health.started = now
            self._next_heartbeat = now
        if now >= self._next_heartbeat:
            self.health.heartbeat += 1
            self._next_heartbeat = max(self._next_heartbeat + HEARTBEAT_PERIOD, now)

    def _notify(self, direction: Direction) -> None:
        for listener in self.listeners:
            listener(direction)


def _indices(variables: Sequence[Variable], direction: Direction) -> tuple[int, ...]:
    return tuple(index for index, variable in enumerate(variables) if variable.direction is direction)


def _value_for(changes: Sequence[Change], variable: int | None) -> Value | None:
    return next((change.value for change in changes if change.variable == variable), None)
