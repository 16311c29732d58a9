"""What a program can read of a robot without waiting: what was agreed, how it goes, what came last."""

from __future__ import annotations

from collections.abc import Mapping

from gatewayd.rtde.api.errors import ConnectionLostError
from gatewayd.rtde.api.feed import IN_SESSION, ConnectionState, RobotFeed
from gatewayd.rtde.api.sample import Sample
from gatewayd.rtde.claims import InputRecipe
from gatewayd.rtde.client import RtdeClient
from gatewayd.rtde.fields import Series
from gatewayd.rtde.loss import Loss
from gatewayd.rtde.messages import ControllerVersion, TextMessage
from gatewayd.rtde.pace import Statistics
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.session import Session, Unavailable


class RobotInformation:
    """Properties only; from any thread."""

    def __init__(self, feed: RobotFeed, client: RtdeClient) -> None:
        self._feed = feed
        self._client = client

    @property
    def latest(self) -> Sample | None:
        """The newest sample of the present session; None while there is none."""
        return self._feed.latest

    @property
    def host(self) -> str:
        """As given."""
        return self._client.settings.host

    @property
    def port(self) -> int:
        """As given."""
        return self._client.settings.port

    @property
    def address(self) -> str:
        """Host and port for reading."""
        return self._client.settings.address

    @property
    def own_address(self) -> tuple[str, int] | None:
        """Our end of the connection, address and port; None without one."""
        return self._client.own_address

    @property
    def peer_address(self) -> tuple[str, int] | None:
        """The controller's end; None without a connection."""
        return self._client.peer_address

    @property
    def state(self) -> ConnectionState:
        """How far the connection is."""
        return self._feed.state

    @property
    def connected(self) -> bool:
        """Whether there is a session, running or paused."""
        return self._feed.state in IN_SESSION

    @property
    def session(self) -> Session | None:
        """All that is agreed; None without a session."""
        return self._feed.session

    @property
    def version(self) -> ControllerVersion:
        """The controller's software (guide, RTDE_GET_URCONTROL_VERSION).

        This and what follows, down to `unavailable`: ConnectionLostError without a session.
        """
        return self._session().controller

    @property
    def series(self) -> Series | None:
        """CB3, e-Series or PolyScope X, by the software; None for one that is not known."""
        return self._session().series

    @property
    def protocol(self) -> int:
        """RTDE protocol version spoken (guide, RTDE_REQUEST_PROTOCOL_VERSION)."""
        return self._session().protocol

    @property
    def max_frequency(self) -> float:
        """Packages that the controller can send per second; protocol version 1 has 125."""
        return self._session().max_frequency

    @property
    def frequency(self) -> float:
        """Packages per second: what was asked for, at the controller's own rate divided by a whole number."""
        return 1 / self._session().period

    @property
    def measured_frequency(self) -> float:
        """Packages per second, measured in the last full second; 0 before."""
        return self.statistics.frequency

    @property
    def outputs(self) -> Recipe:
        """The wanted outputs that the controller has, with types and slots: the layout of `Sample.values`."""
        self._session()
        assert self._feed.layout is not None
        return self._feed.layout.outputs

    @property
    def outputs_id(self) -> int | None:
        """Recipe id of the outputs; None in protocol version 1."""
        return self._session().outputs_id

    @property
    def inputs(self) -> Mapping[str, InputRecipe]:
        """The accepted input recipes by name, with ids, fields and types; a refused field is in none."""
        return self._session().inputs

    @property
    def unavailable(self) -> tuple[Unavailable, ...]:
        """The wanted fields that the controller does not give, with its word and who may be behind it."""
        return self._feed.unavailable(self._session())

    @property
    def statistics(self) -> Statistics:
        """Counters over all sessions: packages, skipped, late, pauses, writes."""
        return self._client.statistics

    @property
    def overflowed(self) -> int:
        """Samples that `async for` over this robot has lost, as it was too slow."""
        return self._feed.main.overflowed

    @property
    def last_text(self) -> TextMessage | None:
        """The last text of the controller, also of an earlier session."""
        return self._feed.last_text

    @property
    def last_loss(self) -> Loss | None:
        """Why the last session, or attempt at one, ended."""
        return self._feed.last_loss

    def _session(self) -> Session:
        session = self._feed.session
        if session is None:
            reason = self._feed.last_loss
            message = "not connected" + (f": {reason.text}" if reason is not None else "")
            raise ConnectionLostError(message, reason)
        return session
