"""Comparing what packages read back of the inputs with what was sent.

A value is in flight for a round trip: until then the controller rightly holds what was sent before. The round trip is
measured, from the handshake on; a lag of the line adds to it. Pure, with time as a parameter.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

from gatewayd.core.definition import Value
from gatewayd.links.robot.transfer import InputTransfer, Slots

VERIFY_AFTER = 0.5
"""Seconds at least for which a difference has to last."""
_ROUND_TRIPS = 2
"""Round trips for which a value may be in flight: one that is measured may be quicker than the next."""
_MAX_SENDS = 1024
"""Values of one field that are remembered; where more are in flight a field is not judged."""
_FADING = 0.1
"""Share that a quicker round trip has in the measured one."""
_MAX_ROUND_TRIP = 10.0


@dataclass(frozen=True, slots=True)
class _Sent:
    values: Sequence[Value]
    at: float
    is_sent: bool
    """False: adopted, or followed."""


@dataclass(frozen=True, slots=True)
class Package:
    """A package to compare, and what is known of the inputs when it comes."""

    flat: Sequence[Value]
    given_at: Sequence[float]
    """When each variable was given in this session; minus infinity: it was not."""
    differing: Collection[int]
    """Variables that are known to differ."""
    lag: float
    """Seconds by which the package is late."""
    now: float


@dataclass(slots=True)
class Finding:
    """What the comparison of one recipe came to."""

    differ: dict[int, str] = field(default_factory=dict)
    """Given variables that have read back otherwise for too long, in words."""
    agree: set[int] = field(default_factory=set)
    """Variables that read back as they were sent."""
    follow: dict[int, Value] = field(default_factory=dict)
    """What the controller holds in variables that nobody gave."""
    sent: dict[str, list[Value]] = field(default_factory=dict)
    """By field: what counts as sent, so that the controller's own values are not overwritten by others' writes."""
    is_settled: bool = True
    """Whether everything read back as it was sent."""


class Echo:
    """A recipe that packages read back whole and in its own order: one comparison can stand for all its fields."""

    __slots__ = ("_sends", "place", "shown")

    def __init__(self, place: slice) -> None:
        self.place = place
        """Where packages have it."""
        self.shown: Sequence[Value] | None = None
        """What it read back last; None: not known, or something that was not sent."""
        self._sends: deque[_Sent] = deque(maxlen=_MAX_SENDS)

    def note(self, values: Sequence[Value], now: float, *, is_sent: bool) -> None:
        """The recipe was sent, or is known to hold this."""
        self._sends.append(_Sent(values, now, is_sent))

    def settled(self, values: Sequence[Value], now: float) -> None:
        """Everything reads back as it was sent: what is to be expected from now on if nothing is sent."""
        if not self._sends:
            self.note(values, now, is_sent=False)

    def forget(self) -> None:
        """The controller's own values are in it, which were not sent: earlier packages are no measure any more."""
        self._sends.clear()
        self.shown = None

    def find(self, held: Sequence[Value], since: float) -> _Sent | None:
        """The package that brought the controller these values, if it may hold them rightly."""
        recent = _since(self._sends, since)
        return next((sent for sent in reversed(recent or ()) if sent.values == held), None)


class ReadBack:
    """The read-backs of one session. `slots` are those of the output recipe, without what it reads as another type."""

    def __init__(self, slots: Slots, round_trip: float) -> None:
        self.round_trip = round_trip
        """Seconds from a send to its read-back, as measured; the longest of late."""
        self._slots = slots
        self._history: dict[str, deque[_Sent]] = {}
        self._shown: dict[str, Sequence[Value] | None] = {}
        """What each field read back last; None: something that was not sent."""
        self._since: dict[int, float] = {}
        """Since when a given variable reads back otherwise."""

    def note(self, name: str, values: Sequence[Value], now: float, *, is_sent: bool) -> None:
        """A field was sent with other values than before, or is known to hold these."""
        self._history.setdefault(name, deque(maxlen=_MAX_SENDS)).append(_Sent(values, now, is_sent))

    def forget_variables(self) -> None:
        """The variables are others from now on."""
        self._since.clear()

    def is_echoed(self, echo: Echo, package: Package) -> bool:
        """Whether a recipe, all of it given, reads back as it was sent a moment ago: then no field is to be judged."""
        if self._since or package.differing:
            return False
        held = package.flat[echo.place]
        sent = echo.find(held, package.now - self._window(package))
        if sent is None:
            return False
        if held != echo.shown:
            if sent.is_sent and echo.shown is not None:
                self._took(package.now - sent.at)
            echo.shown = held
        return True

    def compare(
        self, transfer: InputTransfer, sent: Sequence[Value], package: Package, echo: Echo | None = None
    ) -> Finding:
        """Judge the fields of a recipe by a package."""
        if echo is not None and echo.shown is not None:
            self._shown |= {name: echo.shown[place] for name, place in transfer.slots.items()}
        finding = self._compare(transfer, sent, package)
        if echo is not None:
            if finding.sent:
                echo.forget()
            elif finding.is_settled:
                echo.settled(sent, package.now)
            is_ours = all(self._shown.get(name) is not None for name in transfer.slots)
            echo.shown = package.flat[echo.place] if is_ours else None
        return finding

    def _compare(self, transfer: InputTransfer, sent: Sequence[Value], package: Package) -> Finding:
        finding = Finding()
        is_calm = not self._since and not package.differing
        for name, wanted in transfer.slots.items():
            place = self._slots.get(name)
            if place is None:
                continue
            held = package.flat[place]
            if held == sent[wanted] == self._shown.get(name) and is_calm:
                continue  # the usual field, in a tenth of the time
            self._measure(name, held, package.now)
            if same(held, sent[wanted]):
                for part in transfer.parts[name]:
                    self._since.pop(part.variable, None)
                    if part.variable in package.differing:
                        finding.agree.add(part.variable)
            else:
                finding.is_settled = False
                self._judge_field(transfer, name, sent[wanted], package, finding)
        return finding

    def _judge_field(
        self,
        transfer: InputTransfer,
        name: str,
        sent: Sequence[Value],
        package: Package,
        finding: Finding,
    ) -> None:
        held = package.flat[self._slots[name]]
        window = self._window(package)
        recent = self._recent(name, package.now - window)
        parts = transfer.parts[name]
        if recent is None:
            return
        # The newest are the likely ones.
        is_in_flight = any(same(held, earlier.values) for earlier in reversed(recent))
        present = list(sent)
        for part in parts:
            index, value = part.variable, part.of(held)
            if package.given_at[index] == -math.inf:
                # Nothing of ours is under way: what is read back is what the controller has made of it since.
                if not same((value,), (part.of(sent),)):
                    finding.follow[index] = value
                    part.put(present, value)
            elif is_in_flight:
                self._since.pop(index, None)
            elif any(same((value,), (part.of(earlier.values),)) for earlier in recent):
                self._since.pop(index, None)
                if index in package.differing and same((value,), (part.of(sent),)):
                    finding.agree.add(index)
            elif package.now - self._since.setdefault(index, package.now) >= window:
                finding.differ[index] = f"{name}: sent {_text(sent)}, the controller holds {_text(held)}"
        self._free(transfer, name, held, present)
        if not same(present, sent):
            finding.sent[name] = present
            self.note(name, present, package.now, is_sent=False)

    def _window(self, package: Package) -> float:
        """Seconds for which what was sent before may still be read back."""
        return max(VERIFY_AFTER, _ROUND_TRIPS * self.round_trip) + package.lag

    @staticmethod
    def _free(transfer: InputTransfer, name: str, held: Sequence[Value], present: list[Value]) -> None:
        """Bits and elements that no variable carries follow the controller."""
        if same(transfer.free(name, held), transfer.free(name, present)):
            return
        own = present.copy()
        present[:] = held
        for part in transfer.parts[name]:
            part.put(present, part.of(own))

    def _recent(self, name: str, since: float) -> deque[_Sent] | None:
        """What the controller may rightly hold: the last value sent before `since`, and all after it."""
        return _since(self._history.get(name, deque()), since)

    def _measure(self, name: str, held: Sequence[Value], now: float) -> None:
        """A field reads back something else than before: how long ago was it sent?"""
        shown = self._shown.get(name, ())
        if shown is not None and same(held, shown):
            return
        sent = next((s for s in reversed(self._history.get(name, ())) if same(held, s.values)), None)
        self._shown[name] = held if sent is not None else None
        if sent is None or not sent.is_sent or not shown:
            return
        self._took(now - sent.at)

    def _took(self, took: float) -> None:
        """A round trip of so many seconds."""
        if took <= _MAX_ROUND_TRIP:
            self.round_trip = max(took, self.round_trip + _FADING * (took - self.round_trip))


def _since(history: deque[_Sent], since: float) -> deque[_Sent] | None:
    """The last of what was sent before `since`, and all after it; None: not all of that is remembered."""
    while len(history) > 1 and history[1].at <= since:
        history.popleft()
    if len(history) == _MAX_SENDS and history[0].at > since:
        return None
    return history


def same(left: Sequence[Value], right: Sequence[Value]) -> bool:
    """Equal, where NaN equals NaN."""
    return left == right or (
        len(left) == len(right)
        and all(
            a == b or (a != a and b != b)  # noqa: PLR0124
            for a, b in zip(left, right, strict=True)
        )
    )


def _text(values: Sequence[Value]) -> str:
    return " ".join(f"{value:g}" if isinstance(value, float) else str(value) for value in values)
