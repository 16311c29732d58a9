"""What a role may do with one unit, and how a unit refuses it the rest (Modbus/TCP Security, R-31: exception 01).

A peer that connects without TLS has no role, and these rights do not concern it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from gatewayd.core import status_layout
from gatewayd.core.admission import Change
from gatewayd.core.definition import Value
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.links.modbus_server.plan import ModbusPlan, RoleRights
from gatewayd.links.modbus_server.usual import Meaning
from gatewayd.modbus.areas import Area
from gatewayd.modbus.describe import Span, reading


class Rights:
    """The rights of one role, by the variables and addresses of one unit."""

    def __init__(self, plan: ModbusPlan, granted: RoleRights) -> None:
        self.granted = granted
        self.reads_all = granted.readable is None
        self.writes_all = granted.writable is None
        self.anything = granted.readable != () or granted.writes
        """Without this every request is refused, whatever it asks for."""
        readable = None if granted.readable is None else frozenset(granted.readable)
        self._writable = frozenset(granted.writable or ())
        self._places = plan.placements
        self._hidden: dict[Area, frozenset[int]] = {
            area: frozenset(
                address
                for place in plan.placements
                if place.area is area and readable is not None and place.variable not in readable
                for address in place.addresses
            )
            for area in Area
        }

    @property
    def limited(self) -> bool:
        """Whether there is anything that it may not do."""
        return not (self.reads_all and self.writes_all)

    def serves(self, pdu: bytes) -> bool:
        """Whether it may ask that, as far as this shows without looking at what it would write."""
        if not self.anything:
            return False
        span = reading(pdu)
        return span is None or self.reads_all or self._may_read(span)

    def _may_read(self, span: Span) -> bool:
        """Everything in the span but what is not mapped at all. The status block is for all that may read anything."""
        if self.granted.readable == ():
            return False
        return self._hidden[span.area].isdisjoint(range(span.first, span.first + span.quantity))

    def denied(
        self, changes: Sequence[Change] | Refusal, values: Sequence[Value], span: Span | None
    ) -> Refusal | None:
        """Why it may not write that: one of the variables is not its to write. `changes`: or why nobody may.

        `span`: the addresses it would write.

        One that only shares a register, and stays as it is, stands in nobody's way.
        """
        if self.writes_all:
            return None
        if isinstance(changes, Refusal):
            # The role is judged first: of what is not its own, a peer learns neither where it lies nor its limits.
            foreign = self._foreign(span)
            known = bool(self._writable) and foreign is None
            return (
                None
                if known
                else Refusal(Reason.NOT_IN_ROLE, changes.variable if foreign is None else foreign)
            )
        if not self._writable:
            return Refusal(Reason.NOT_IN_ROLE, changes[0].variable if changes else None)
        for change in changes:
            unchanged = change.implied and change.value == values[change.variable]
            if change.variable not in self._writable and not unchanged:
                return Refusal(Reason.NOT_IN_ROLE, change.variable)
        return None

    def _foreign(self, span: Span | None) -> int | None:
        """The first variable in the span that shares its address with none that is its to write."""
        if span is None:
            return None
        found: dict[int, list[int]] = {}
        for place in self._places:
            if place.area is span.area:
                for address in place.addresses:
                    if 0 <= address - span.first < span.quantity:
                        found.setdefault(address, []).append(place.variable)
        return next((its[0] for _at, its in sorted(found.items()) if self._writable.isdisjoint(its)), None)

    def denies_status(self, first: int, words: Iterable[int]) -> bool:
        """Whether it may not write these words of the status block: the numbers there are those of variables."""
        if self.writes_all:
            return False
        locks = (status_layout.REQUEST, status_layout.RELEASE)
        named = [word - 1 for offset, word in enumerate(words, first) if offset in locks]
        known = [index for index in named if 0 <= index < status_layout.RELEASE_ALL - 1]
        return not self._writable or any(index not in self._writable for index in known)

    def usual(self, meaning: Callable[[int, int], Meaning | None]) -> Callable[[int, int], Meaning | None]:
        """The same for the writes of the role that are worked out once: none where anything is not its own to write."""

        def limited(address: int, count: int) -> Meaning | None:
            found = meaning(address, count)
            own = found is not None and (self.writes_all or self._writable.issuperset(found.variables))
            return found if own else None

        return limited
