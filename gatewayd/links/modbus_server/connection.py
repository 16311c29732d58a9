"""One connection of a peer: from its acceptance by asyncio to its end.

asyncio owns the socket's life: it accepts, keeps answers that the peer does not take yet, and closes. It does not read.
Telling a protocol of a few bytes costs it more than answering them costs us, so the listener's `ReadPoller` watches
all sockets, and each one is read straight into the buffer of its `ModbusSession`.
"""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Protocol, cast

from gatewayd.core.requester import new_connection
from gatewayd.links.contract import Passage, Tap
from gatewayd.links.modbus_server.credentials import PeerCredentials
from gatewayd.links.modbus_server.peers import Address, Place, address_of
from gatewayd.links.modbus_server.polling import ReadPoller
from gatewayd.links.modbus_server.session import ModbusSession, UnitAccess
from gatewayd.links.modbus_server.sockets import has_unread, seconds_since_established, set_options
from gatewayd.links.modbus_server.waiting import WaitedInput
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.modbus.frames import UNIT, whole_frames
from gatewayd.report.format import address as address_text

if TYPE_CHECKING:
    from gatewayd.links.modbus_server.trust import Trust

_log = logging.getLogger("gatewayd.modbus")


class PeerAdmission(Protocol):
    """Decides who is served, and hears of the end of everybody who is."""

    def connected(self, connection: PeerConnection) -> None:
        """A peer has connected. It is served unless this call aborts the connection."""

    def disconnected(self, connection: PeerConnection) -> None:
        """A connection has ended, admitted or not."""


class PeerConnection(asyncio.BufferedProtocol):
    """The requests of one peer in, the answers out.

    `get_buffer` stays undefined on purpose: if asyncio ever read, in spite of being paused, it would fail the
    connection instead of losing requests.
    """

    wire: asyncio.Transport

    def __init__(self, admission: PeerAdmission, poller: ReadPoller) -> None:
        self.admission = admission
        self.poller = poller
        self.session = ModbusSession()
        self.receive: Callable[[int, float], bytes] = self.session.received
        """What takes the bytes that came in; another function while they may have waited, or while somebody traces."""
        self.read: Callable[[int, Sequence[memoryview]], int] = os.readv
        """What reads the socket; with TLS another function."""
        self._tap: Tap | None = None
        self.waiting: WaitedInput | None = None
        self.number = new_connection()
        self.peer = ""
        self.address: Address | None = None
        self.accesses: dict[int, UnitAccess] = {}
        self.credentials: PeerCredentials | None = None
        """What it has shown of itself, with TLS."""
        self.trust: Trust | None = None
        """The files by which it was let in, with TLS."""
        self.places: frozenset[Place] = frozenset()
        """Places of declared writers that it fills."""
        self.last_request = 0.0
        """When the last whole request came in; bytes that make none keep no connection open."""
        self.stalled_since: float | None = None
        self.established = 0.0
        """When the kernel had the connection; it may have waited for its acceptance."""
        self.reason = "closed by the peer"
        self.descriptor = -1

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """See asyncio; called once, after the connection was accepted."""
        self.wire = cast("asyncio.Transport", transport)
        # Answers that the peer does not take stop its requests at once, so at most one turn's answers ever wait.
        self.wire.set_write_buffer_limits(high=0)
        peer = self.wire.get_extra_info("peername")
        if not peer:
            self.wire.abort()
            return
        self.peer = address_text(peer[0], peer[1])
        self.address = address_of(peer[0])
        sock = self.wire.get_extra_info("socket")
        self.descriptor = sock.fileno()
        set_options(sock)
        now = clock.now()
        self.last_request, self.established = now, now - seconds_since_established(sock)
        self._accepted()
        # asyncio begins to read after this call, in the same turn of the loop. Later versions skip that if reading is
        # paused by now; that of Python 3.11.2 (Debian 12) begins regardless. All of them obey a pause in the next turn,
        # and calls made here come before the sockets of that turn.
        asyncio.get_running_loop().call_soon(self._begin)

    def _accepted(self) -> None:
        self.admission.connected(self)

    def _begin(self) -> None:
        """Have the poller read in asyncio's place."""
        if not self.wire.is_closing():
            self.wire.pause_reading()
            self._watch()

    def _watch(self) -> None:
        preferred = bool(self.places)
        self.poller.add(self.descriptor, self.readable, preferred=preferred, again=self._has_more())

    def _has_more(self) -> bool:
        """Whether there is something to serve that the poller does not see."""
        return self.session.pending

    def fill(self, places: frozenset[Place]) -> None:
        """Fill these places of declared writers, whose requests come first."""
        self.places = places
        self.poller.prefer(self.descriptor, preferred=bool(places))

    def readable(self) -> bool:
        """The socket has something to read, or requests that were read are pending: the hot path.

        Returns whether any are pending after it.
        """
        session = self.session
        count = 0
        if not session.pending:
            try:
                count = self.read(self.descriptor, session.buffer.space)
            except OSError as error:
                if not isinstance(error, (BlockingIOError, InterruptedError)):
                    self.abort(str(error))
                return False
            if not count:
                self.drop("closed by the peer")
                return False
        # Only now: until the bytes were read they may have waited, and others of this turn were served before.
        now = clock.judged_now()
        try:
            answers = self.receive(count, now)
        except Exception:  # noqa: BLE001 - a defect of ours costs this connection, not the others
            received = bytes(session.buffer.data[: session.buffer.end + count]).hex(" ")
            _log.exception("a request could not be answered", extra=fields(peer=self.peer, received=received))
            self.abort("internal error")
            return False
        if answers:
            self.last_request = now
            self._send(answers)
        if session.broken:
            self.drop(f"not Modbus TCP: {session.broken}")
        return session.pending

    def _send(self, answers: bytes) -> None:
        """What the socket does not take at once is asyncio's to keep; no more requests are served until it has gone."""
        try:
            sent = os.write(self.descriptor, answers)
        except (BlockingIOError, InterruptedError):
            sent = 0
        except OSError as error:
            self.abort(str(error))
            return
        if sent < len(answers):
            self.wire.write(answers[sent:])

    def forget(self, unit: int) -> None:
        """It may do nothing with this unit any more."""
        self.accesses = {number: access for number, access in self.accesses.items() if number != unit}
        self.session.serve(self.accesses)

    def stood_still(self, since: float, until: float) -> None:
        """Nothing was read for this time: it is no silence of the peer, and what is in the socket may be that old."""
        length = until - since
        self.last_request += length
        if self.stalled_since is not None:
            self.stalled_since += length
        self.wait(since, until)

    def wait(self, since: float, until: float) -> None:
        """What is in the socket may have waited from `since` to `until`."""
        self.waiting = WaitedInput(since, until, unread=self._unread(), former=self.waiting)
        self._receive_by(self._receive_late)

    def _unread(self) -> bool:
        """Whether anything of the peer's is waiting, in the socket or as a part of a request."""
        return bool(self.session.buffer.end) or has_unread(self.descriptor)

    def _is_empty(self, count: int, asked: int) -> bool:
        """Whether nothing is waiting any more, after a read of so many bytes."""
        return count < asked and not self.session.buffer.end

    def trace(self, tap: Tap | None) -> None:
        """Hand `tap` every frame from now on; None: no more."""
        if tap is not self._tap:
            self._tap = tap
            self._receive_by(self.session.received if self.waiting is None else self._receive_late)

    def _receive_by(self, receive: Callable[[int, float], bytes]) -> None:
        self.receive = receive if self._tap is None else partial(self._receive_traced, receive, self._tap)

    def _receive_traced(
        self, receive: Callable[[int, float], bytes], tap: Tap, count: int, now: float
    ) -> bytes:
        """In place of `receive`: requests and answers pass the tap as well."""
        session, buffer = self.session, self.session.buffer
        stream = bytes(buffer.data[: buffer.end + count])
        answers = receive(count, now)
        # What stays in the buffer is no whole request, or one of a later turn; what is no Modbus is shown as it is.
        taken = stream if session.broken else stream[: len(stream) - buffer.end]
        self._pass(taken, tap, now, outgoing=False)
        self._pass(answers, tap, clock.now(), outgoing=True)
        return answers

    def _pass(self, stream: bytes, tap: Tap, now: float, *, outgoing: bool) -> None:
        own = self.wire.get_extra_info("sockname")
        for frame in whole_frames(stream):
            cell = self.session.cell_of(frame[UNIT]) if len(frame) > UNIT else None
            tap(Passage(now, frame, outgoing, self.peer, address_text(own[0], own[1]), cell))

    def _receive_late(self, count: int, now: float) -> bytes:
        """In place of `session.received`, until all that waited was read."""
        session, waiting = self.session, self.waiting
        waited = waiting.seconds(now) if waiting is not None else 0.0
        if waiting is None or not waited:
            self.waiting = None
            self._receive_by(session.received)
            return session.received(count, now)
        asked = len(session.buffer.space[0])
        answers = session.received_late(count, now, waited)
        if self._is_empty(count, asked):
            waiting.drained()
        return answers

    def pause_writing(self) -> None:
        """See asyncio; the peer does not read its answers: take no more requests."""
        self.stalled_since = clock.now()
        self.poller.remove(self.descriptor)

    def resume_writing(self) -> None:
        """See asyncio; the peer has caught up."""
        self.stalled_since = None
        if not self.wire.is_closing():
            self._watch()

    def drop(self, reason: str) -> None:
        """Close the connection after what was answered already."""
        self.reason = reason
        self.poller.remove(self.descriptor)
        self.wire.close()

    def abort(self, reason: str) -> None:
        """Close the connection at once."""
        self.reason = reason
        self.poller.remove(self.descriptor)
        self.wire.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """See asyncio; called after the connection has ended, from either side."""
        if exc is not None:
            self.reason = str(exc)
        self.poller.remove(self.descriptor)
        self.admission.disconnected(self)
