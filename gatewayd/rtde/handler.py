"""What the user of an RTDE client gets to know."""

from __future__ import annotations

from typing import Protocol

from gatewayd.rtde.loss import Loss
from gatewayd.rtde.messages import TextMessage
from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.session import Session
from gatewayd.rtde.strange import StrangePackage


class ConnectionObserver:
    """What else happens to the connections of a client, for all that want to know; does nothing by itself.

    Called as `ClientHandler` is. Addresses are as the socket has them: host and port first.
    """

    def connected(self, own: tuple[str, int] | None, peer: tuple[str, int] | None) -> None:
        """A connection is open; the set-up begins."""

    def changed(self, session: Session) -> None:
        """Other recipes have been set up on the same connection."""

    def paused(self) -> None:
        """The controller has paused the output."""

    def resumed(self) -> None:
        """It sends again."""


class ClientHandler(Protocol):
    """What the user of a client gets to know, by synchronous calls from the event loop. They must not block.

    An exception from one of them ends the client: `RtdeClient.run` raises it.
    """

    def session_started(self, session: Session) -> None:
        """The set-up is complete; values follow."""

    def values(self, values: tuple[Scalar, ...], now: float) -> None:
        """A package, flat in the order of `Session.outputs`, received at `now` (the loop's time)."""

    def earlier(self, values: tuple[Scalar, ...], now: float) -> bool:
        """A package that was received together with newer ones, which follow in their order; the last as `values`.

        It has waited since its timestamp. Whether it was taken; what is not counts as overtaken.
        """

    def inputs_changed(self, session: Session) -> None:
        """The input recipes have changed: inputs that were in use have been claimed, or registers have joined.

        Those of former session objects can still be sent.
        """

    def session_lost(self, loss: Loss) -> None:
        """A session has ended, or an attempt at one has failed. The client goes on by itself."""

    def text(self, message: TextMessage) -> None:
        """The controller has sent a text."""

    def strange(self, package: StrangePackage) -> None:
        """A package could not be taken as it came; the first of its oddity and type that the client has met."""

    def probed(self, delay: float) -> None:
        """A probe was answered `delay` seconds after it was sent; infinity: it was not, within the handshake's time."""
