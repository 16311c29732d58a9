"""A short visit to a controller: connect, agree on recipes, listen for a moment, leave. Nothing is ever written.

For commands that want to know what a controller offers. It goes there by the client of the daemon, so what it meets is
what the daemon would meet.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from dataclasses import dataclass, field, replace

from gatewayd.rtde.catalogue import is_long
from gatewayd.rtde.client import RtdeClient
from gatewayd.rtde.loss import Loss, LossReason
from gatewayd.rtde.messages import TextMessage
from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.session import TIMESTAMP, ClientSettings, Session
from gatewayd.rtde.strange import StrangePackage

_LIMIT = 20.0
"""Seconds that everything but the listening may take together."""
_FIRST_DATA = 3.0
"""Seconds without a package after which a visitor does not wait any longer."""
_ATTEMPTS = 3
_REMEMBERED = 8
"""Texts and strange packages that are kept, the newest."""
_OF_LISTS = frozenset({LossReason.UNANSWERED, LossReason.CLOSED, LossReason.FAILED})
"""How an attempt may end because the controller takes no long list: the next one uses short ones."""


@dataclass(frozen=True, slots=True)
class Visit:
    """What was met."""

    session: Session | None
    """What was agreed; None: there was no session."""
    loss: Loss | None
    """Why there was none, or why it ended early; None: the visit went as it should."""
    texts: tuple[TextMessage, ...] = ()
    """The last that the controller sent."""
    strange: tuple[StrangePackage, ...] = ()
    """The last packages that could not be taken as they came."""
    packages: int = 0
    """Data packages that came while listening."""
    span: float = 0.0
    """Seconds from the first of them to the last."""
    advance: float = 0.0
    """Seconds by which the controller's timestamp went on meanwhile."""

    @property
    def rate(self) -> float | None:
        """Packages per second; None if too few came to say."""
        return (self.packages - 1) / self.span if self.packages > 1 and self.span > 0 else None


async def visit(settings: ClientSettings, listen: float = 0.0) -> Visit:
    """Go there once, and listen for so many seconds from the first package on; 0: the output is not started.

    Inputs of the settings are claimed, and given back by leaving. It takes a bounded time whatever it meets.
    """
    wanted = replace(settings, first_data_timeout=_FIRST_DATA, running=listen > 0)
    visitor = _Visitor(wanted, listen)
    client = asyncio.create_task(RtdeClient(wanted, visitor).run())
    try:
        async with asyncio.timeout(_LIMIT + listen):
            await asyncio.wait((client, visitor.done), return_when=asyncio.FIRST_COMPLETED)
    except TimeoutError:
        awaited = "data" if visitor.session is not None else "the set-up to be complete"
        text = f"{wanted.address}: waited {_LIMIT + listen:g} s in vain for {awaited}"
        visitor.loss = visitor.loss or Loss(LossReason.UNANSWERED, text)
    finally:
        client.cancel()
        await asyncio.wait((client,))
    if not client.cancelled() and (error := client.exception()) is not None:
        raise error
    return visitor.result()


@dataclass(eq=False)
class _Visitor:
    """The handler of the client: notes everything, answers nothing."""

    settings: ClientSettings
    listen: float
    session: Session | None = None
    loss: Loss | None = None
    done: asyncio.Future[None] = field(default_factory=lambda: asyncio.get_running_loop().create_future())
    texts: deque[TextMessage] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))
    oddities: deque[StrangePackage] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))
    arrivals: list[float] = field(default_factory=list)
    stamps: list[float] = field(default_factory=list)

    def result(self) -> Visit:
        arrivals, stamps = self.arrivals, self.stamps
        return Visit(
            self.session,
            self.loss,
            tuple(self.texts),
            tuple(self.oddities),
            len(arrivals),
            arrivals[-1] - arrivals[0] if arrivals else 0.0,
            stamps[-1] - stamps[0] if stamps else 0.0,
        )

    def session_started(self, session: Session) -> None:
        self.session = session
        if not self.listen:
            self._end()

    def values(self, values: tuple[Scalar, ...], now: float) -> None:
        if not self.arrivals:
            asyncio.get_running_loop().call_later(self.listen, self._end)
        self._note(values, now)

    def earlier(self, values: tuple[Scalar, ...], now: float) -> bool:
        self._note(values, now)
        return True

    def inputs_changed(self, session: Session) -> None:
        self.session = session

    def session_lost(self, loss: Loss) -> None:
        if self.done.done():
            return
        again = not loss.started and loss.reason in _OF_LISTS and loss.attempts < _ATTEMPTS
        if again and (is_long(self.settings.wanted_outputs()) or is_long(self.settings.wanted_inputs())):
            return
        self.loss = loss
        self._end()

    def text(self, message: TextMessage) -> None:
        self.texts.append(message)

    def strange(self, package: StrangePackage) -> None:
        self.oddities.append(package)

    def probed(self, delay: float) -> None:
        """Nobody probes."""

    def _note(self, values: tuple[Scalar, ...], now: float) -> None:
        self.arrivals.append(now)
        assert self.session is not None
        place = self.session.outputs.slots.get(TIMESTAMP)
        if place is not None:
            self.stamps.append(float(values[place.start]))

    def _end(self) -> None:
        with contextlib.suppress(asyncio.InvalidStateError):
            self.done.set_result(None)
