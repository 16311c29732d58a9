"""One gateway of two: its role, what moves it, and when it asks for the claim. Pure: what is seen comes in.

How often it asks is all that the other gateway's word changes: every 50 ms while that one does not serve the cell,
twice a second while it says that it does. A gateway that only seems to be alive costs half a second, no more.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from gatewayd.links.contract import Claim, Duty
from gatewayd.links.standby.roles import MOVES, RoleSignal, StandbyRole
from gatewayd.links.standby.sight import GONE_AFTER, Sight

FAST = 0.05
"""Seconds between two attempts while the other gateway does not serve the cell."""
SLOW = 0.5
"""Seconds between two attempts while it does, or while nothing has come of quick ones for long."""
FAST_FOR = 15.0
"""Seconds of quick attempts: a controller that drops a silent client does so within about ten."""
JITTER = 0.5
"""Share by which a pause is longer at most, so that two gateways never keep in step."""
BACK_OFF = 0.2
"""Seconds to wait after a part of the inputs had to be given back."""
ADDRESS_WITHIN = 3.0
"""Seconds within which the address has to follow the claim."""
LEAVE_FOR = 5.0
"""Seconds for which a gateway that has left does not ask, unless the other serves the cell before."""
LOST_FOR = 0.5
"""Seconds without a session, while the other gateway has one, after which it is left to that."""
READY_AFTER = 1.5
"""Seconds after the start before which the address may not come: keepalived's check for a live process looks once a
second."""
TAKEN_FOR = 1.0
"""Seconds for which inputs are in use and no other gateway is seen: it may be our own former connection."""

_ACTIVE = frozenset({StandbyRole.TAKING_ADDRESS, StandbyRole.ACTIVE, StandbyRole.RECOVERING})


@dataclass(frozen=True, slots=True)
class RoleChange:
    """A change of role."""

    former: StandbyRole
    role: StandbyRole
    why: str


class StandbyStation:
    """The state machine of one cell's gateway. `jitter` gives numbers from 0 to 1."""

    def __init__(
        self, sight: Sight, jitter: Callable[[], float], *, has_address: bool, served_last: bool = False
    ) -> None:
        self.role = StandbyRole.STANDING_BY
        self.since = -math.inf
        """When the role began."""
        self.takeovers = 0
        """Times that the cell came to be served here."""
        self.why = ""
        """Why the role is as it is; empty: it has always been."""
        self.served_last = served_last
        """Whether no other gateway was seen to serve the cell since this one did. To be kept across restarts: it may go
        on beside another mapping, which the other gateway may not."""
        self.sight = sight
        self.has_address = has_address
        self.claim = Claim.NO_SESSION
        self.unaddressed = False
        """Whether the last claim had to be given back because the address did not come."""
        self._jitter = jitter
        self._next_try = -math.inf
        self._fast_since = -math.inf
        self._was_fast = True
        self._lost_at = math.inf
        self._taken_at = math.inf
        self._leave = False
        self._began_at = math.inf
        self._expected_at = -math.inf
        """Since when the address is expected, where it became another one."""

    def hand_over(self, now: float) -> str:
        """Leave the cell to the other gateway with the next look; why that cannot be, or empty."""
        why = self.obstacle(now)
        self._leave = not why
        return why

    def obstacle(self, now: float) -> str:
        """Why the cell cannot be handed over now, in words; empty: it can."""
        if self.role is not StandbyRole.ACTIVE:
            return f"this gateway is {self.role.words}; hand over at the one that serves the cell"
        if not self.sight.alive(now):
            return "the other gateway is not heard"
        if self.sight.differs:
            return "the mapping of the other gateway differs"
        if self.sight.ready(now):
            return ""
        if not self.sight.connected(now):
            return "the other gateway is not ready: it does not reach the robot"
        return (
            "the other gateway is not ready: it has just started, or did not get the address (see its status)"
        )

    def ready(self, now: float) -> bool:
        """Whether it would take over at once, address included as far as that is known."""
        if self.has_address and (self.unaddressed or now - self._began_at < READY_AFTER):
            return False
        return self.role is StandbyRole.STANDING_BY and self.claim not in {Claim.NO_SESSION, Claim.PARTIAL}

    def expect_address(self, now: float, *, has_address: bool) -> None:
        """There is a virtual address from now on, or none; it has the usual time to come."""
        self.has_address, self._expected_at = has_address, now

    def look(self, claim: Claim, address: bool | None, now: float) -> RoleChange | None:
        """Take in how things are; `address`: whether the virtual address is here, None: not known.

        Returns the change of role that followed, if one did.
        """
        if self.since == -math.inf:
            # The other gateway is to be heard first, if it is there: its mapping may differ.
            self.since = self._began_at = now
            self._next_try = now + GONE_AFTER
        self._note(claim, now)
        held = address if self.has_address else True
        self.served_last = self.sight.role(now) not in _ACTIVE and self.served_last
        signal = self._signal(claim, held, now)
        if signal is None or (self.role, signal) not in MOVES:
            return None
        return self._move(signal, now)

    def duty(self, now: float) -> Duty:
        """What the cell has to do, in the role that `look` came to."""
        return Duty(
            serve=self.role.serves,
            ask=self._asks(now),
            withdraw=self._withdraws(now),
            why=self._words(now),
        )

    # -- inside --------------------------------------------------------------------------------------------------

    def _note(self, claim: Claim, now: float) -> None:
        self.claim = claim
        self._lost_at = min(self._lost_at, now) if claim is Claim.NO_SESSION else math.inf
        if claim is not Claim.ASKED:
            in_use = claim in {Claim.REFUSED, Claim.PARTIAL}
            self._taken_at = min(self._taken_at, now) if in_use else math.inf

    def _signal(self, claim: Claim, address: bool | None, now: float) -> RoleSignal | None:
        """What moves the present role now."""
        look = {
            StandbyRole.STANDING_BY: self._standing_by,
            StandbyRole.MISMATCHED: self._mismatched,
            StandbyRole.TAKING_ADDRESS: self._taking_address,
            StandbyRole.ACTIVE: self._active,
            StandbyRole.RECOVERING: self._recovering,
            StandbyRole.LEAVING: self._leaving,
        }[self.role]
        return look(claim, address, now)

    def _standing_by(self, claim: Claim, _address: bool | None, _now: float) -> RoleSignal | None:
        if self.sight.differs and not self.served_last:
            return RoleSignal.DIFFERS
        return RoleSignal.CLAIMED if claim is Claim.HELD else None

    def _mismatched(self, _claim: Claim, _address: bool | None, _now: float) -> RoleSignal | None:
        return None if self.sight.differs else RoleSignal.AGREES

    def _taking_address(self, claim: Claim, address: bool | None, now: float) -> RoleSignal | None:
        if claim is not Claim.HELD:
            return RoleSignal.SESSION_LOST
        if address:
            return RoleSignal.ADDRESS_HELD
        return RoleSignal.NO_ADDRESS if now - self.since >= ADDRESS_WITHIN else None

    def _active(self, claim: Claim, address: bool | None, now: float) -> RoleSignal | None:
        if address is False and now - self._expected_at >= ADDRESS_WITHIN:
            return RoleSignal.ADDRESS_LOST
        if self._leave:
            return RoleSignal.ASKED_TO_LEAVE
        return None if claim is Claim.HELD else RoleSignal.SESSION_LOST

    def _recovering(self, claim: Claim, address: bool | None, now: float) -> RoleSignal | None:
        if address is False:
            return RoleSignal.ADDRESS_LOST
        if claim is Claim.HELD:
            return RoleSignal.CLAIMED
        if self.sight.role(now) in _ACTIVE or now - self._taken_at >= TAKEN_FOR:
            return RoleSignal.TAKEN
        if now - self._lost_at >= LOST_FOR and self.sight.connected(now) and not self.sight.differs:
            return RoleSignal.OTHER_CONNECTED
        return None

    def _leaving(self, _claim: Claim, _address: bool | None, now: float) -> RoleSignal | None:
        if self.sight.role(now) in _ACTIVE:
            return RoleSignal.OTHER_ACTIVE
        return RoleSignal.TIME_UP if now - self.since >= LEAVE_FOR else None

    def _move(self, signal: RoleSignal, now: float) -> RoleChange:
        former, self.role = self.role, MOVES[self.role, signal]
        if self.role is StandbyRole.TAKING_ADDRESS and not self.has_address:
            self.role = StandbyRole.ACTIVE
        self.since, self.why, self._leave = now, signal.value, False
        self.takeovers += self.role is StandbyRole.ACTIVE and former is not StandbyRole.RECOVERING
        self.served_last = self.served_last or self.role is StandbyRole.ACTIVE
        if signal in {RoleSignal.NO_ADDRESS, RoleSignal.ADDRESS_HELD}:
            self.unaddressed = signal is RoleSignal.NO_ADDRESS
        if self.role is StandbyRole.STANDING_BY:
            self._next_try, self._was_fast = now, False
        return RoleChange(former, self.role, signal.value)

    def _asks(self, now: float) -> bool:
        """Whether to ask for the claim now; each time that it is so counts as an attempt."""
        if self.role not in {StandbyRole.STANDING_BY, StandbyRole.RECOVERING}:
            return False
        if self.claim not in {Claim.UNASKED, Claim.REFUSED}:
            return False
        pause = self._pause(now)
        if now < self._next_try:
            return False
        self._next_try = now + pause * (1 + JITTER * self._jitter())
        return True

    def _pause(self, now: float) -> float:
        """Seconds between two attempts; a change to quick ones takes effect at once."""
        is_fast = self.role is StandbyRole.RECOVERING or self.sight.role(now) not in _ACTIVE
        if is_fast and not self._was_fast:
            self._fast_since = now
            self._next_try = min(self._next_try, now)
        self._was_fast = is_fast
        return FAST if is_fast and now - self._fast_since < FAST_FOR else SLOW

    def _withdraws(self, now: float) -> bool:
        """Whether to give back what is claimed."""
        if self.role.has_claim:
            return self.role is StandbyRole.RECOVERING and self.claim is Claim.PARTIAL
        if self.claim is Claim.PARTIAL:
            self._next_try = now + BACK_OFF * (1 + self._jitter())
            return True
        return self.role in {StandbyRole.LEAVING, StandbyRole.MISMATCHED} and self.claim in {
            Claim.HELD,
            Claim.ASKED,
        }

    def _words(self, now: float) -> str:
        """Why the cell is not served here; empty: it is."""
        if self.role.serves:
            return ""
        if self.role is StandbyRole.STANDING_BY:
            other = "serves the cell" if self.sight.role(now) in _ACTIVE else "does not serve the cell"
            heard = (
                f"the other gateway {other}" if self.sight.alive(now) else "the other gateway is not heard"
            )
            return f"this gateway stands by: {heard}"
        return (
            f"this gateway is {self.role.words}: {self.why}"
            if self.why
            else f"this gateway is {self.role.words}"
        )
