"""The inputs that the controller gave us: what it was last given, what is due, and whether it reads back so.

A slot that was neither read nor given in this session is never sent: what a recipe holds is known field by field, and a
recipe of which something is not known waits until it is given. Pure: flat tuples in and out, time as a parameter.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Container, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from gatewayd.core.definition import Value, Variable
from gatewayd.links.robot.companions import CYCLES, DOMAINS, STAGE, Actuation, Driven, Key, Stage
from gatewayd.links.robot.readback import Echo, Finding, Package, ReadBack, same
from gatewayd.links.robot.transfer import InputTransfer, Slots
from gatewayd.rtde.claims import WATCHDOG_KEY, InputRecipe
from gatewayd.rtde.session import Session

SEND_AGAIN = 1.0
"""Seconds between two attempts to give the controller what it does not hold."""
LIVED_ON = 1.0
"""Seconds for which the session has to live after a fallback was sent that cannot be read back."""


@dataclass(slots=True, eq=False)
class _Recipe:
    """A claimed and adopted input recipe, and what the controller was last given by it."""

    accepted: InputRecipe
    transfer: InputTransfer
    actuation: Actuation
    sent: tuple[Value, ...]
    sent_at: float
    unknown: set[str]
    """Fields that were neither read nor given in this session."""
    echo: Echo | None
    """Set where packages read the whole recipe back in its own order."""
    is_settled: bool = True
    """Whether everything read back as it was sent, when it was last compared."""

    def values_of(self, name: str) -> Sequence[Value]:
        return self.sent[self.transfer.slots[name]]

    def is_given(self, given_at: Sequence[float]) -> bool:
        """Whether all of it was given in this session."""
        return min((given_at[index] for index in self.transfer.members), default=-math.inf) > -math.inf

    def last_given(self, given_at: Sequence[float]) -> float:
        return max((given_at[index] for index in self.transfer.members), default=-math.inf)

    def is_complete(self, last_given: float, given_at: Sequence[float]) -> bool:
        """Whether what is not known of the recipe was given, or does not act (masked values)."""
        return last_given > -math.inf and (bool(self.actuation) or not self.open_members(given_at))

    def open_members(self, given_at: Sequence[float]) -> list[int]:
        """Variables of unknown fields that nobody has given."""
        parts = (part for name in self.unknown for part in self.transfer.parts[name])
        return [part.variable for part in parts if given_at[part.variable] == -math.inf]


@dataclass(frozen=True, slots=True)
class Due:
    """A package to send."""

    recipe: InputRecipe
    values: tuple[Value, ...]


class ClaimedInputs:
    """The input recipes of one session, whose output recipe reads inputs back.

    `driven` is what the process remembers of masked outputs; `cycle` the controller's, in seconds.
    """

    def __init__(
        self,
        variables: Sequence[Variable] = (),
        session: Session | None = None,
        driven: Driven | None = None,
        cycle: float = 0.0,
    ) -> None:
        self._variables = variables
        self._slots: Slots = {}
        self._driven = driven if driven is not None else Driven()
        self._stages: dict[Key, Stage] = {}
        self._stage = max(STAGE, CYCLES * cycle)
        self._recipes: list[_Recipe] = []
        self._carriers: dict[int, _Recipe] = {}
        self._known: set[str] = set()
        self._seen: Sequence[Value] | None = None
        """The newest package."""
        self._cleared: dict[int, float] = {}
        """Since when nothing is left to be sent of a fallback."""
        round_trip = 0.0
        if session is not None:
            slots, round_trip = session.outputs.slots, session.round_trip
            self._slots = {name: slot for name, slot in slots.items() if name not in session.unread}
        self._read_back = ReadBack(self._slots, round_trip)

    # -- taking over ---------------------------------------------------------------------------------------------

    def adopt(
        self, session: Session, flat: Sequence[Value], now: float, without: Container[int] = ()
    ) -> dict[int, Value]:
        """Take over the session's recipes, `without` some variables, and what its inputs hold.

        Returns the values of variables that were not known before. What is known of a field goes on: it was read or
        given, and what is due of it stays due.
        """
        earlier = {name: recipe for recipe in self._recipes for name in recipe.transfer.slots}
        known = {name: earlier[name].values_of(name) for name in earlier.keys() & self._known}
        read = self._read(session, flat)
        adopted: dict[int, Value] = {}
        recipes: list[_Recipe] = []
        for key, accepted in session.inputs.items():
            if key == WATCHDOG_KEY:
                continue
            layout = accepted.recipe
            new = {name: read[name] for name in layout.names if name in read and name not in known}
            held = new | {name: known[name] for name in layout.names if name in known}
            recipe = self._recipe(accepted, without)
            recipe.transfer.rebase(held)
            recipe.unknown = set(layout.names) - held.keys()
            recipe.sent = tuple(recipe.transfer.base)
            if not recipe.unknown:
                recipe.sent_at = min(
                    (earlier[name].sent_at for name in layout.names if name in earlier), default=now
                )
            for name, values in new.items():
                self._read_back.note(name, values, now, is_sent=False)
            self._known |= held.keys()
            adopted |= recipe.transfer.adopted(new)
            recipes.append(recipe)
        self._take(recipes)
        self.look(flat)
        return adopted

    def rebind(self, variables: Sequence[Variable], without: Container[int] = ()) -> dict[int, Value]:
        """Carry these variables from now on, `without` some, by the same recipes; nothing is sent by it.

        Returns what the controller was last given for each of them, as far as that is known.
        """
        self._variables = variables
        self._read_back.forget_variables()
        self._cleared.clear()
        held: dict[int, Value] = {}
        recipes: list[_Recipe] = []
        for former in self._recipes:
            recipe = self._recipe(former.accepted, without)
            recipe.transfer.rebase({name: former.values_of(name) for name in former.transfer.slots})
            recipe.sent, recipe.sent_at, recipe.unknown = former.sent, former.sent_at, former.unknown
            recipe.actuation.domains = former.actuation.domains
            if not recipe.actuation:
                held |= recipe.transfer.adopted(former.transfer.slots.keys() - former.unknown)
            recipes.append(recipe)
        self._take(recipes)
        return held

    def _recipe(self, accepted: InputRecipe, without: Container[int]) -> _Recipe:
        layout = accepted.recipe
        transfer = InputTransfer(self._variables, layout.names, layout.slots, without)
        actuation = Actuation(self._variables, transfer, self._driven, self._stages)
        return _Recipe(accepted, transfer, actuation, (), -math.inf, set(), self._echo(layout.names))

    def _take(self, recipes: list[_Recipe]) -> None:
        self._recipes = recipes
        self._carriers = {index: recipe for recipe in recipes for index in recipe.transfer.members}

    def _read(self, session: Session, flat: Sequence[Value]) -> dict[str, Sequence[Value]]:
        """What is known to stand in the controller, by field: the package is newer than what was read before it."""
        names = [name for accepted in session.inputs.values() for name in accepted.recipe.names]
        shown = {name: flat[self._slots[name]] for name in names if name in self._slots}
        return {**session.held, **shown}

    def _echo(self, names: Sequence[str]) -> Echo | None:
        slots = [self._slots[name] for name in names if name in self._slots]
        if len(slots) < len(names) or any(
            slot.stop != following.start for slot, following in pairwise(slots)
        ):
            return None
        return Echo(slice(slots[0].start, slots[-1].stop))

    # -- sending -------------------------------------------------------------------------------------------------

    def incomplete(self, given_at: Sequence[float]) -> list[int]:
        """Variables that go out with one that was given, though nobody knows what the controller holds of them."""
        found: list[int] = []
        for recipe in self._recipes:
            if recipe.actuation:
                found += recipe.actuation.undecided(given_at)
            elif recipe.unknown and recipe.last_given(given_at) > -math.inf:
                found += recipe.open_members(given_at)
        return found

    def due(
        self,
        values: Sequence[Value],
        given_at: Sequence[float],
        differing: Collection[int],
        now: float,
    ) -> Iterator[Due]:
        """Every recipe of which something was given or has changed since it was sent, or is to be sent again."""
        for recipe in self._recipes:
            last = recipe.last_given(given_at)
            if recipe.unknown and not recipe.is_complete(last, given_at):
                continue
            flat = self._compose(recipe, values, given_at)
            differs = differing and any(index in differing for index in recipe.transfer.members)
            again = differs and now - recipe.sent_at >= SEND_AGAIN
            if again or last > recipe.sent_at or flat != recipe.sent:
                yield Due(recipe.accepted, flat)

    def sent(self, due: Due, now: float) -> list[str]:
        """Take down that a package was sent. Returns registers that are known by it and can join the others."""
        recipe = next(recipe for recipe in self._recipes if recipe.accepted is due.recipe)
        former, recipe.sent, recipe.sent_at = recipe.sent, due.values, now
        for name, slot in recipe.transfer.slots.items():
            if due.values[slot] != former[slot] or name in recipe.unknown:
                self._read_back.note(name, due.values[slot], now, is_sent=True)
                recipe.is_settled = False
        if recipe.echo is not None:
            recipe.echo.note(due.values, now, is_sent=True)
        recipe.actuation.sent(due.values, now + self._stage)
        alone = [name for name in recipe.unknown if name == due.recipe.key]
        self._known |= recipe.unknown
        recipe.unknown.clear()
        return alone

    def _compose(
        self, recipe: _Recipe, values: Sequence[Value], given_at: Sequence[float]
    ) -> tuple[Value, ...]:
        if recipe.actuation:
            return recipe.actuation.compose(recipe.transfer, values, given_at)
        return recipe.transfer.gather(values)

    # -- releases ------------------------------------------------------------------------------------------------

    def release(self, releases: Iterable[tuple[int, Value]]) -> None:
        """Variables were given these fallbacks: have them act, whatever their masks say."""
        for index, value in releases:
            self._cleared.pop(index, None)
            recipe = self._carriers.get(index)
            if recipe is not None:
                recipe.actuation.release(index, value)

    @property
    def stage_end(self) -> float | None:
        """When masks are to take their own values again; None while no fallback was sent with its mask set."""
        ends = [stage.until for stage in self._stages.values() if stage.until is not None]
        return min(ends, default=None)

    @property
    def is_releasing(self) -> bool:
        """Whether fallbacks go out with their masks set, or are to."""
        return bool(self._stages)

    def end_stages(self, now: float) -> None:
        """Let masks take their own values where it is time."""
        for key, stage in tuple(self._stages.items()):
            if stage.until is not None and stage.until <= now:
                del self._stages[key]

    def delivered(
        self, flat: Sequence[Value] | None, under_way: Iterable[int], values: Sequence[Value], now: float
    ) -> list[int]:
        """The variables whose fallbacks have reached the controller; `flat`: a package, None: one that is not new."""
        return [index for index in under_way if self._has_arrived(index, flat, values[index], now)]

    def _has_arrived(self, index: int, flat: Sequence[Value] | None, value: Value, now: float) -> bool:
        recipe = self._carriers.get(index)
        if recipe is None:
            return False
        name = self._variables[index].field
        part = next(part for part in recipe.transfer.parts[name] if part.variable == index)
        is_sent = same((part.of(recipe.values_of(name)),), (value,)) and name not in recipe.unknown
        if not is_sent or recipe.actuation.is_releasing(index):
            self._cleared.pop(index, None)
            return False
        since = now - self._cleared.setdefault(index, now)
        if name in self._slots:
            if flat is None or since < self._read_back.round_trip:
                return False
            arrived = same((part.of(flat[self._slots[name]]),), (value,))
        else:
            arrived = since >= LIVED_ON
        if arrived:
            del self._cleared[index]
            recipe.actuation.delivered(index)
        return arrived

    # -- reading back --------------------------------------------------------------------------------------------

    def look(self, flat: Sequence[Value]) -> None:
        """Take from a package what decides how inputs act, and keep what it reads back."""
        self._seen = flat
        slot = self._slots.get(DOMAINS)
        if slot is not None:
            for recipe in self._recipes:
                recipe.actuation.domains = int(flat[slot.start])

    def held(self, index: int) -> Value | None:
        """What the newest package reads back of a variable; None where packages do not show it."""
        recipe, name = self._carriers.get(index), self._variables[index].field
        if recipe is None or self._seen is None or name not in self._slots:
            return None
        part = next(part for part in recipe.transfer.parts[name] if part.variable == index)
        return part.of(self._seen[self._slots[name]])

    def compare(self, package: Package) -> Finding:
        """What a package reads back otherwise than it was sent."""
        result = Finding()
        for recipe in self._recipes:
            echo = recipe.echo
            if echo is not None:
                if recipe.is_settled and package.flat[echo.place] == recipe.sent:
                    continue
                if recipe.is_given(package.given_at) and self._read_back.is_echoed(echo, package):
                    recipe.is_settled = echo.shown == recipe.sent
                    continue
            found = self._read_back.compare(recipe.transfer, recipe.sent, package, echo)
            recipe.is_settled = found.is_settled
            if found.sent:
                recipe.transfer.rebase(found.sent)
                sent = list(recipe.sent)
                for name, values in found.sent.items():
                    sent[recipe.transfer.slots[name]] = values
                recipe.sent = tuple(sent)
            result.differ |= found.differ
            result.agree |= found.agree
            result.follow |= found.follow
        return result
