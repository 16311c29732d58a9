"""Commands of a broker to a cell: each writer's request, judged by the core as any other.

A message names nobody who sent it, so a writer is any client that may publish to its topic; the broker's access list
says who that is.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Value, ValueKind
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester, new_connection
from gatewayd.core.unserved import Unserved
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.loop.allowance import Allowance

MAX_BURST: Final = 100
"""Commands at once."""
MAX_RATE: Final = 100.0
"""Commands a second: what comes beyond is refused unread, so that a flood costs the fieldbus nothing."""


class CommandDesk:
    """The writers of one cell by MQTT, and what became of what they asked."""

    def __init__(self, plan: MqttPlan, cell: Cell) -> None:
        self.done = 0
        self.refused: Counter[str] = Counter()
        self._requesters: dict[str, Requester] = {}
        self._connected: set[str] = set()
        self._allowance = Allowance(MAX_BURST, MAX_RATE)
        self.bind(plan, cell)

    def bind(self, plan: MqttPlan, cell: Cell) -> None:
        """Serve the writers of this plan and cell; those of the same names go on as they are."""
        former = self._requesters
        self._cell = cell
        self._requesters = {
            known: replace(former[known], writer=writer)
            if known in former
            else Requester(writer, f"MQTT {known}", new_connection())
            for known, writer in plan.writers
        }
        self._connected &= self._requesters.keys()
        self.variables = {each.name: each.variable for each in plan.publications}

    def departing(self, plan: MqttPlan | None, after: CellDefinition) -> Mapping[Requester, str]:
        """Who would not be the same writer any more, and why."""
        staying = (
            {} if plan is None else {known: after.writers[writer].name for known, writer in plan.writers}
        )
        why = "its broker is no longer served" if plan is None else "the new mapping has another writer there"
        return {
            requester: why
            for known, requester in self._requesters.items()
            if known in self._connected and staying.get(known) != self._name(requester)
        }

    def release(self, plan: MqttPlan | None, after: CellDefinition, now: float) -> None:
        """These are lost, in the old cell."""
        for requester, why in self.departing(plan, after).items():
            self._cell.writer_disconnected(requester, now, why, at_once=True)
            self._connected -= {known for known, each in self._requesters.items() if each is requester}

    def lost(self, names: Iterable[str], reason: str, now: float) -> None:
        """These writers cannot be heard any more."""
        for known in list(names):
            if known in self._connected:
                self._connected.discard(known)
                self._cell.writer_disconnected(self._requesters[known], now, reason, at_once=True)

    def all_lost(self, reason: str, now: float) -> None:
        """Nobody can be heard any more."""
        self.lost(self._requesters, reason, now)

    # -- requests ----------------------------------------------------------------------------------------------------

    def take(self, now: float) -> bool:
        """Whether one more command is read at all."""
        return self._allowance.take(now)

    def ignore(self, known: str, reason: Unserved, request: str, now: float) -> None:
        """Count and record what is no request at all, or none that counts."""
        self.refused[reason.name.lower()] += 1
        self._cell.unserved(self._requesters[known], reason, request, now)

    def flooded(self, count: int, now: float) -> None:
        """Commands of nobody knows whom were not even read."""
        self.refused[Unserved.NOT_ALLOWED.name.lower()] += count
        for requester in self._requesters.values():
            text = "more commands than are read"
            self._cell.unserved(requester, Unserved.NOT_ALLOWED, text, now)

    def write(
        self, known: str, wanted: Mapping[str, object], waited: float, now: float
    ) -> tuple[Refusal | None, Sequence[int]]:
        """Write values by their names, all or none. Which variables were meant, as far as there are such."""
        requester = self._heard(known, waited, now)
        meant = [self.variables[name] for name in wanted if name in self.variables]
        changes: list[Change] = []
        for name, value in wanted.items():
            index = self.variables.get(name)
            found = None if index is None else self._value(index, value)
            if index is None or found is None:
                return self._refuse(requester, index, name, value, now), meant
            changes.append(Change(index, found))
        return self._counted(self._cell.write(requester, changes, now)), meant

    def locks(
        self, known: str, names: Sequence[str], waited: float, now: float, *, give_back: bool
    ) -> tuple[Refusal | None, Sequence[int]]:
        """Take the locks of these, or give them back; the first refusal ends it."""
        requester = self._heard(known, waited, now)
        meant = [self.variables[name] for name in names if name in self.variables]
        for name in names:
            index = self.variables.get(name)
            if index is None:
                return self._refuse(requester, None, name, None, now), meant
            act = self._cell.release if give_back else self._cell.request
            refusal = act(requester, index, now)
            if refusal is not None:
                return self._counted(refusal), meant
        return self._counted(None), meant

    def release_all(self, known: str, now: float) -> None:
        """Give everything back."""
        self._cell.release_all(self._heard(known, 0.0, now), now)
        self._counted(None)

    def alive(self, known: str, waited: float, now: float) -> None:
        """A sign of life."""
        self._cell.writer_seen(self._heard(known, waited, now), now)

    # -- inside ------------------------------------------------------------------------------------------------------

    def _heard(self, known: str, waited: float, now: float) -> Requester:
        requester = self._requesters[known]
        if known not in self._connected and not waited:
            self._connected.add(known)
            self._cell.writer_connected(requester, now, "heard by MQTT")
        return replace(requester, waited=waited) if waited else requester

    def _value(self, index: int, value: object) -> Value | None:
        """The value for the variable; None: it is none of its kind."""
        kind = self._cell.definition.variables[index].kind
        if kind is ValueKind.BOOL:
            return bool(value) if isinstance(value, int) and value in (0, 1) else None
        if isinstance(value, bool) or not isinstance(value, int | float):
            return None
        if isinstance(value, float) and kind is ValueKind.INT:
            return int(value) if math.isfinite(value) and value == int(value) else None
        try:
            return float(value) if kind is ValueKind.FLOAT else value
        except OverflowError:
            return None

    def _refuse(
        self, requester: Requester, index: int | None, name: str, value: object, now: float
    ) -> Refusal:
        if index is None:
            refusal = Refusal(Reason.NO_SUCH_ADDRESS, request=f"wrote {name[:80]!r}")
        else:
            kind = self._cell.definition.variables[index].kind
            refusal = Refusal(Reason.OUT_OF_LIMITS, index, hint=f"{_brief(value)} is {_NOT[kind]}")
        self._cell.refuse(requester, refusal, now)
        self._counted(refusal)
        return refusal

    def _counted(self, refusal: Refusal | None) -> Refusal | None:
        if refusal is None:
            self.done += 1
        else:
            self.refused[refusal.reason.name.lower()] += 1
        return refusal

    def _name(self, requester: Requester) -> str:
        assert requester.writer is not None
        return self._cell.definition.writers[requester.writer].name


_NOT: Final = {
    ValueKind.BOOL: "neither true nor false",
    ValueKind.INT: "no integer",
    ValueKind.FLOAT: "no number",
}


def _brief(value: object) -> str:
    return repr(value)[:40]
