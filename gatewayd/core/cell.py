"""One robot cell: the only place where values, owners, freshness and fallbacks meet.

Links call it; it calls its `listeners` after values or qualities changed. Every method that needs the time takes it
(`now`, seconds of the monotonic clock), so that nothing here waits, sleeps or reads a clock.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from gatewayd.core.admission import Admission, Change, value_for
from gatewayd.core.adoption import Adoption, AdoptionStep, adopted, named
from gatewayd.core.carried import Carried
from gatewayd.core.commands import Commands
from gatewayd.core.definition import CellDefinition, Direction, Value
from gatewayd.core.delivery import Delivery
from gatewayd.core.events import Event, EventKind, EventRing
from gatewayd.core.fallbacks import Fallbacks
from gatewayd.core.forcing import Forcing
from gatewayd.core.freshness import Freshness, Source
from gatewayd.core.health import Health
from gatewayd.core.image import ProcessImage
from gatewayd.core.lag import Lag
from gatewayd.core.locking import Locking
from gatewayd.core.match import Match
from gatewayd.core.operator import Operator
from gatewayd.core.ownership import Act, LockTable, Move
from gatewayd.core.program import is_running
from gatewayd.core.reception import Reception
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.refusal_log import LastRefusal
from gatewayd.core.refused import Refused
from gatewayd.core.requester import Requester
from gatewayd.core.supervision import WriterTable
from gatewayd.core.unserved import Unserved

NOTABLE_GAP = 0.5
"""Seconds for which the gateway stood still, from which on it is an event."""

Written = Sequence[tuple[int, Value, Value]]
"""What a write changed: variable, old and new value."""


class Cell:
    """State of one robot cell."""

    def __init__(self, definition: CellDefinition) -> None:
        self.definition = definition
        self.image = ProcessImage(definition.variables)
        self.ownership = LockTable(definition.locks)
        self.writers = WriterTable(definition.writers, definition.locks)
        self.standing_by = ""
        """Why this gateway does not serve the cell, in words: another one does; empty: it does."""
        self.freshness = Freshness(definition.stale_after)
        self.lag = Lag(definition.stale_after)
        self.events = EventRing()
        self.health = Health()
        self.forcing = Forcing(self.image)
        record = self.events.append
        self.delivery = Delivery(self.image, self.health, record)
        self.adoption = Adoption(definition.adopt_for)
        fallbacks = Fallbacks(definition, self.image, self.ownership, self.delivery, record)
        self._fallbacks = fallbacks
        self.commands = Commands(definition.variables, self.ownership)
        self.listeners: list[Callable[[Direction], None]] = []
        self.write_listeners: list[Callable[[int, Written, float], None]] = []
        """Called with every accepted write that changes something: writer, changes, time. They must not raise."""
        self._admission = Admission(definition.variables, definition.writers, self.ownership, self.image)
        inputs_changed = partial(self._notify, Direction.INPUT)
        self._locking = Locking(
            self.ownership, self.writers, record, fallbacks.apply, fallbacks.inherited, inputs_changed
        )
        self.operator = Operator(
            self.image, self.ownership, self.forcing, self._admission, self._locking, fallbacks, self.delivery,
            record, self.refuse, self._notify,
        )  # fmt: skip
        self.carried = Carried(
            self.image, self.commands, self.forcing, self.set_availability, self._adopt_late, self._notify
        )
        self._refused = Refused(self.image, self.health, record)
        outputs_changed = partial(self._notify, Direction.OUTPUT)
        self._reception = Reception(
            self.health, self.freshness, self.lag, self.image, self.forcing, record, outputs_changed
        )

    @property
    def accepts_writes(self) -> bool:
        """Whether the robot is connected and its inputs were adopted."""
        return self.delivery.ready

    @property
    def unreadable(self) -> frozenset[int]:
        """Outputs whose policy is `exception` and whose value is not good now."""
        return self.image.unreadable

    @property
    def last_refusal(self) -> LastRefusal | None:
        """The last refused request."""
        return self._refused.last

    @property
    def last_unserved(self) -> Event | None:
        """The last request that nothing here serves, reported or only counted."""
        return self._refused.last_unserved

    # -- fieldbus side -------------------------------------------------------------------------------------------

    def write(self, requester: Requester, changes: Sequence[Change], now: float) -> Refusal | None:
        """Apply all changes, or none and return why not.

        Members of a lock that is taken over and that the request does not write take their release fallback.
        """
        self.operator.release_expired(now)
        verdict = self._admission.judge(requester, changes, adopted=self.delivery.ready)
        refusal = verdict.refusal
        if refusal is None or refusal.reason is not Reason.WAITED:
            self.writer_seen(requester, now, wrote=True, owns=refusal is None)
        if refusal is not None:
            if refusal.reason.renews:
                self._locking.renew(requester, verdict.moves, now)
            self.refuse(requester, refusal, now, value_for(changes, refusal.variable))
            return refusal
        if requester.writer is not None:
            self._locking.move(requester, verdict.moves, now, verdict.values)
        changed = self._changed(verdict.values) if self.write_listeners else ()
        self.image.store_all(verdict.values, now)
        self.delivery.give(verdict.values, now)
        self.written(requester.writer, changed, now)
        self.commands.written(requester, changes, now)
        return None

    def written(self, writer: int | None, changed: Written, now: float) -> None:
        """A write was accepted and stands in the image."""
        if changed and writer is not None:
            for listener in self.write_listeners:
                listener(writer, changed, now)
        self._notify(Direction.INPUT)
        self.health.writes_accepted += 1

    def refuse(self, requester: Requester, refusal: Refusal, now: float, value: Value | None = None) -> None:
        """Count and record a refusal; equal ones are reported once in a while (`RefusalLog`)."""
        self._refused.refuse(requester, refusal, now, value)

    def unserved(self, requester: Requester, reason: Unserved, request: str, now: float) -> None:
        """Count and record a request that nothing here serves; those of one peer and reason are reported together.

        `request`: what was asked and what is here, in words of the link: `asked unit 7; units here: 1`.
        """
        self._refused.unserved(requester, reason, request, now)

    def request(self, requester: Requester, variable: int, now: float) -> Refusal | None:
        """Take the lock that guards `variable` (and with it its whole group) without writing a value.

        Taken over from another owner, all its members take their release fallback.
        """
        return self._act(requester, variable, Act.REQUEST, now)

    def release(self, requester: Requester, variable: int, now: float) -> Refusal | None:
        """Give the lock that guards `variable` back; its release fallback applies."""
        return self._act(requester, variable, Act.RELEASE, now)

    def release_all(self, requester: Requester, now: float, detail: str = "released by its owner") -> None:
        """Give every lock of the requester's writer back."""
        if requester.writer is not None:
            self._locking.free(self.ownership.held_by(requester.writer), now, detail)

    def drop_waited(self, requester: Requester, variables: Iterable[int], now: float) -> None:
        """A cyclic command was refused because it waited: what it would have renewed is released at once.

        Who is answered can ask again. What is only sent has no answer, so its sender would not know that its values
        were left as they are.
        """
        locks = (self.definition.variables[index].lock for index in variables)
        detail = "its command waited while the gateway stood still"
        self._locking.drop(requester, (lock for lock in locks if lock is not None), now, detail)

    def writer_connected(self, requester: Requester, now: float, detail: str = "") -> None:
        """One more connection of the writer."""
        writer = requester.writer
        if writer is not None and self.writers.connected(writer, now):
            self.events.append(Event(now, EventKind.WRITER_CONNECTED, writer=writer, detail=detail))

    def writer_seen(
        self, requester: Requester, now: float, *, wrote: bool = False, owns: bool = False
    ) -> None:
        """A request of a trusted writer feeds its supervision, unless it waited for too long to be a sign of life.

        A read does so too where not only writes count. `wrote`: it asks to write or for a lock, refused or not;
        `owns`: it was allowed to, so its writer is about to own something, and who owns something lives.
        """
        writer = requester.writer
        if writer is None or not requester.trusted:
            return
        if requester.waited and not owns and self._admission.is_late(requester):
            return
        if self.writers.seen(writer, now, wrote=wrote):
            self.events.append(Event(now, EventKind.WRITER_CONNECTED, writer=writer, detail="heard again"))

    def writer_disconnected(
        self, requester: Requester, now: float, reason: str, *, at_once: bool = False
    ) -> None:
        """One connection less: what follows it is released, after the writer's grace. With the last one it is lost.

        `at_once`: it is not a connection that ended, the writer itself is known to be gone. There is no grace then.
        """
        self._locking.disconnected(requester, now, reason, at_once=at_once)

    def following(self, requesters: Collection[Requester]) -> set[int]:
        """The locks that would end at once with all these connections."""
        return self._locking.following(requesters)

    def holds(self, connection: int) -> bool:
        """Whether some lock follows this connection."""
        return connection != 0 and connection in self.ownership.connections

    def stop(self, now: float, detail: str) -> None:
        """End every force and release every lock, the operator's as well; release fallbacks apply."""
        self.operator.end(self.forcing.forces, range(len(self.definition.locks)), now, detail)

    # -- robot side ----------------------------------------------------------------------------------------------

    def robot_connected(self, now: float, detail: str = "") -> None:
        """A session with the controller has begun; nothing is written before `adopt`."""
        self.robot_lost("a new session began", now)
        self.freshness.connected()
        self.health.sessions += 1
        self.events.append(Event(now, EventKind.ROBOT_CONNECTED, detail=detail))

    def robot_lost(self, reason: str, now: float) -> None:
        """The session has ended: outputs and inputs are stale until the next one."""
        if self.freshness.state is Source.LOST:
            return
        was_fresh = self.freshness.state is Source.FRESH
        self.freshness.lost()
        self.health.frequency = 0.0
        self.health.lag = 0.0
        self.program(None)
        self.events.append(Event(now, EventKind.ROBOT_LOST, detail=reason))
        self.forcing.lift()
        self.delivery.lost()
        self.commands.disarm()
        self.image.inputs_lost()
        if was_fresh:
            self._reception.lost()
        self._notify(Direction.INPUT)

    def package_arrived(self, timestamp: float | None, now: float, raw: float | None = None) -> bool:
        """Whether the package is to be shown. If so, the link copies its values and calls `outputs_written`.

        It is not if it reports nothing new, or came later than `stale_after`; `freshness` knows which. `raw` is the
        time by a clock that no time service adjusts.
        """
        return self._reception.package(timestamp, now, now if raw is None else raw)

    def program(self, state: int | None) -> None:
        """The `runtime_state` of a package, before its `outputs_written`; None: the controller does not report it."""
        self.health.program = state
        self.image.running = is_running(state)

    def outputs_written(self, now: float) -> None:
        """The link has copied a package's values into the image: they are good from now on, and as old as they are."""
        if self.freshness.state is not Source.FRESH:
            return
        self.image.outputs_stored(min(now, self.freshness.last_progress))
        self._notify(Direction.OUTPUT)

    def lag_doubtful(self, now: float) -> bool:
        """Whether to ask the controller something: packages stay late, and there may be no backlog behind it.

        At most once a second. What is asked has to be answered behind the packages that the controller had sent before.
        """
        return self._reception.doubtful(now)

    def backlog_probed(self, delay: float, now: float) -> bool:
        """The controller answered `delay` seconds after the question.

        True: so quickly that there is no backlog; its clock stood still for a while. What it sends now counts as in
        time, and the link begins one new session, so that nothing is left of what may have queued. False: no change.
        """
        return self._reception.probed(delay)

    def adopt(self, values: Mapping[int, Value], now: float) -> None:
        """Take over what the controller's inputs hold, then apply the fallbacks that are owed.

        Called once per session, and again (after `set_availability`) when registers became available later. An input
        that is not among `values`, because the controller does not say what it holds, is not good before it is given.
        """
        if self.freshness.state is Source.LOST:
            return
        first = not self.delivery.ready
        self.forcing.lift()
        if first:
            present = filter(self.image.available.__getitem__, self.commands.indices)
            values = {**values, **self.commands.at_rest(present)}
        for index, value in values.items():
            self.image.store(index, value, now)
        entered = self.delivery.adopted(values.keys())
        if first:
            detail = adopted(self.image, len(values), self.delivery.unread)
            self.events.append(Event(now, EventKind.INPUTS_ADOPTED, detail=detail))
        self._fallbacks.apply(self._fallbacks.due(entered.union(values), over=self.adoption.over), now)
        self.operator.give_forced(now)
        self._notify(Direction.INPUT)

    def _adopt_late(self, values: Mapping[int, Value], now: float) -> None:
        if self.delivery.ready:
            self.adopt(values, now)

    def fall_back(self, variables: Iterable[int], now: float) -> None:
        """Inputs take their release fallbacks; without the robot or the register they are owed."""
        self._fallbacks.apply(variables, now)
        self._notify(Direction.INPUT)

    def complete(self, variables: Iterable[int], now: float) -> None:
        """Inputs that go out with one that was written, and of which nobody knows what the robot holds, fall back."""
        self._fallbacks.complete(variables, now)
        self._notify(Direction.INPUT)

    def read_back(
        self, differ: Mapping[int, str], agree: Collection[int], follow: Mapping[int, Value], now: float
    ) -> None:
        """What the comparison of a package with what was sent came to.

        `differ`: given inputs for which the robot holds something else, in words; `agree`: inputs that read back as
        sent; `follow`: what the robot holds in inputs that nobody gave in this session.
        """
        self.forcing.lift()
        self.delivery.agree(agree)
        self.delivery.differ(differ, now)
        self.delivery.follow(follow, now)
        self._notify(Direction.INPUT)

    def set_availability(self, variables: Iterable[int], available: bool, reason: str, now: float) -> None:
        """The controller gave or refused the register (or field) behind these variables.

        What it gave is not good before `adopt` (inputs) or the next package (outputs) brings its value.
        """
        changed = [
            index for index in dict.fromkeys(variables) if self.image.available[index] is not available
        ]
        if not changed:
            return
        kind = EventKind.AVAILABLE if available else EventKind.UNAVAILABLE
        self.forcing.lift()
        for index in changed:
            if not available:
                self.delivery.leave(index)
            self.image.set_available(index, available)
            self.events.append(Event(now, kind, variable=index, detail=reason))
        self._notify(Direction.INPUT)
        self._notify(Direction.OUTPUT)

    # -- time ----------------------------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """Notice what only time brings: ended leases, silent writers, a silent or frozen robot."""
        self.operator.release_expired(now)
        self._locking.silence(now)
        self._reception.tick(now)
        self._count_adoption(now)
        self._refused.tick(now)
        self.health.beat(now)

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`; called before anything that waited is served."""
        if now - since >= NOTABLE_GAP:
            self.health.gaps += 1
            self.events.append(Event(now, EventKind.STOOD_STILL, detail=f"{now - since:.1f} s"))
        self._locking.gap(since, now)
        self.tick(now)

    # -- successor -----------------------------------------------------------------------------------------------

    def succeed(self, former: Cell, match: Match, now: float) -> None:
        """Go on where `former` stands, which must not be used for anything afterwards."""
        former.forcing.lift()
        self.image.succeed(former.image, match.values)
        self.ownership.succeed(former.ownership, match.locks, match.writers, now)
        self.writers.succeed(former.writers, match.writers, now)
        self.freshness.succeed(former.freshness)
        if match.same_robot:
            self.lag.succeed(former.lag)
            self.adoption.succeed(former.adoption)
        self.health = replace(former.health, words={}, tables={})
        self.events.succeed(former.events, match)
        self._reception.health = self.health
        self._refused.succeed(former._refused, match, self.health)
        self.forcing.succeed(former.forcing, match.values, match.locks)
        self.delivery.succeed(former.delivery, self.health, match.values, match.due)

    # -- inside --------------------------------------------------------------------------------------------------

    def _act(self, requester: Requester, variable: int, act: Act, now: float) -> Refusal | None:
        self.operator.release_expired(now)
        lock = self.definition.variables[variable].lock
        judged = self._admission.judge_lock(requester, variable, act)
        if not (isinstance(judged, Refusal) and judged.reason is Reason.WAITED):
            owns = isinstance(judged, Move) and judged <= Move.TAKE_OVER
            self.writer_seen(requester, now, wrote=True, owns=owns)
        if isinstance(judged, Refusal):
            self.refuse(requester, judged, now)
            return judged
        assert lock is not None
        if judged is Move.RELEASE:
            self._locking.free([lock], now, "released by its owner")
        elif judged is not Move.NOTHING:
            self._locking.take(requester, lock, judged, now)
        return None

    def _count_adoption(self, now: float) -> None:
        """What nobody has claimed by the end of `adopt_for` falls back."""
        step, left = self.adoption.look(now, adopted=self.delivery.ready), self.adoption.left(now)
        pending = self._fallbacks.of_nobody(self.image.inputs)
        first = next(pending, None) if left or step is AdoptionStep.END else None
        self.health.adoption = 0.0 if first is None else left
        if first is None or step is AdoptionStep.NOTHING:
            return
        if step is AdoptionStep.BEGIN:
            detail = f"in {left:g} s, without an owner by then: {named(self.image, [first, *pending])}"
            self.events.append(Event(now, EventKind.ADOPTION_ENDS, detail=detail))
        elif self.delivery.ready:
            self.fall_back([first, *pending], now)

    def _changed(self, values: Sequence[tuple[int, Value]]) -> Written:
        present = self.image.values
        return [(index, present[index], value) for index, value in values if present[index] != value]

    def _notify(self, direction: Direction) -> None:
        self.forcing.lay()
        for listener in self.listeners:
            listener(direction)
