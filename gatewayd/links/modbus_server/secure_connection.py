"""One connection of a peer by TLS (Modbus/TCP Security): the same requests and answers, in records of OpenSSL's.

The engine is `ssl.SSLObject`, as in asyncio's own transports, but fed here: so the sockets are polled with all others,
declared writers first, every refusal has its reason (asyncio drops what a failed handshake had to say), and handshakes
get no more of the loop's time than `Handshakes` gives them.
"""

from __future__ import annotations

import os
import ssl
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Protocol, cast

from gatewayd.links.modbus_server.connection import PeerAdmission, PeerConnection
from gatewayd.links.modbus_server.credentials import PeerCredentials
from gatewayd.links.modbus_server.peers import PeerEventKind
from gatewayd.links.modbus_server.polling import ReadPoller
from gatewayd.links.modbus_server.role import RoleError, role_of
from gatewayd.links.modbus_server.trust import Trust, reason_of
from gatewayd.machine.x509 import CertificateError, parse

_SCRATCH = memoryview(bytearray(4096))
"""What was read of a socket and not yet handed to OpenSSL; empty between two calls, so one is enough."""
_PIECE = _SCRATCH[:512]
"""What is decrypted at once, a usual request and more. A client may send key updates (TLS 1.3) instead, 27 bytes each,
and OpenSSL carries out all it has in one call."""
MAX_EMPTY = 32 * 1024
"""Bytes without any of a request in them. A record of the greatest length, as yet incomplete, has half as many."""
_NO_TLS = {"WRONG_VERSION_NUMBER", "HTTP_REQUEST", "HTTPS_PROXY_REQUEST", "PACKET_LENGTH_TOO_LONG"}
_UNVERIFIED = {"PEER_DID_NOT_RETURN_A_CERTIFICATE", "CERTIFICATE_VERIFY_FAILED", "EXCESSIVE_MESSAGE_SIZE"}
_REMEDIES = {
    "PEER_DID_NOT_RETURN_A_CERTIFICATE": "the client shows no certificate",
    "UNSUPPORTED_PROTOCOL": "the client speaks no TLS 1.2 or later",
    "VERSION_TOO_LOW": "the client speaks no TLS 1.2 or later",
    "NO_SHARED_CIPHER": "no cipher suite in common, or none for this kind of key",
    "TLSV1_ALERT_UNKNOWN_CA": "the client does not know the authority of this gateway's certificate",
    "SSLV3_ALERT_BAD_CERTIFICATE": "the client does not accept this gateway's certificate",
    "SSLV3_ALERT_CERTIFICATE_UNKNOWN": "the client does not accept this gateway's certificate",
    "SSLV3_ALERT_CERTIFICATE_EXPIRED": "to the client this gateway's certificate has expired: compare the clocks",
}


class SecureAdmission(PeerAdmission, Protocol):
    """Decides who is served, before a handshake and after it."""

    @property
    def trust(self) -> Trust:
        """By which files a client is let in now."""

    def arrived(self, connection: SecurePeerConnection) -> None:
        """A peer has connected. Its handshake begins unless this call aborts the connection."""

    def ready(self, connection: SecurePeerConnection) -> None:
        """Its handshake can go on; `step` is to be called."""

    def refused(self, connection: SecurePeerConnection, kind: PeerEventKind, reason: str) -> None:
        """Its handshake has failed."""


class SecurePeerConnection(PeerConnection):
    """See the module."""

    admission: SecureAdmission

    def __init__(self, admission: SecureAdmission, poller: ReadPoller) -> None:
        super().__init__(admission, poller)
        self.read = self._read_decrypted
        self.trust = admission.trust
        """By which it is let in, or was."""
        self._incoming, self._outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        self._tls = self.trust.context.wrap_bio(self._incoming, self._outgoing, server_side=True)
        self.handshaking = True
        self._more = False
        """Whether OpenSSL has something that was read from the socket already."""
        self._partial = False
        """Whether it may have the beginning of a record."""
        self._empty = 0
        """Bytes that came since there was anything of a request in them."""
        self._emptied = True
        """Whether the socket had less than was asked of it."""

    def _accepted(self) -> None:
        self.admission.arrived(self)

    # -- the handshake ---------------------------------------------------------------------------------------------

    def readable(self) -> bool:
        """See PeerConnection."""
        if not self.handshaking:
            return super().readable() or (self._more and not self.wire.is_closing())
        try:
            count = os.readv(self.descriptor, (_SCRATCH,))
        except (BlockingIOError, InterruptedError):
            return False
        except OSError as error:
            self.fail(PeerEventKind.UNSECURED, str(error))
            return False
        if not count:
            self.fail(PeerEventKind.UNSECURED, "closed by the peer")
            return False
        self._incoming.write(_SCRATCH[:count])
        # What more it sends waits in the socket until this was looked at.
        self.poller.remove(self.descriptor)
        self.admission.ready(self)
        return False

    def step(self) -> None:
        """Go on with the handshake, by what was read."""
        if self.wire.is_closing():
            return
        try:
            self._tls.do_handshake()
        except ssl.SSLWantReadError:
            self._flush()
            self._watch_again()
        except ssl.SSLError as error:
            self._flush()  # the alert
            kind = PeerEventKind.UNVERIFIED if error.reason in _UNVERIFIED else PeerEventKind.UNSECURED
            text = _REMEDIES.get(error.reason or "") or reason_of(error)
            if error.reason in _NO_TLS:
                text = "what it sends is no TLS: the port without TLS is another one"
            self.fail(kind, text)
        else:
            self._flush()
            self._finished()

    def _finished(self) -> None:
        """The certificate was accepted by OpenSSL, now or, of a resumed session, before (R-42)."""
        shown = self._tls.getpeercert(binary_form=True)
        try:
            certificate = parse(shown or b"")
            role = role_of(certificate)
        except (CertificateError, RoleError) as error:
            self.fail(PeerEventKind.UNVERIFIED, str(error))
            return
        if certificate.not_after < time.time():
            # OpenSSL looks at the time in a full handshake only.
            self.fail(PeerEventKind.UNVERIFIED, "certificate has expired")
            return
        self.handshaking = False
        # Before it is admitted: a request that came with the last of the handshake may have waited through a gap.
        self._more = self._incoming.pending > 0
        self.credentials = PeerCredentials(
            role, certificate.subject, certificate.serial, certificate.issuer_name, certificate.not_after
        )
        self.admission.connected(self)
        if not self.wire.is_closing():
            self._watch_again()

    def fail(self, kind: PeerEventKind, reason: str) -> None:
        """End the handshake; an alert has been sent by now, if there is one."""
        self.admission.refused(self, kind, reason)
        self.reason = reason
        self.poller.remove(self.descriptor)
        if self.wire.get_write_buffer_size():
            # It takes nothing of what it was sent, and would keep the socket open for as long as it likes.
            self.wire.abort()
        # Not at once: a reset would overtake the alert, which says more.
        self.wire.close()

    def _watch_again(self) -> None:
        self.poller.remove(self.descriptor)
        if self.stalled_since is None:
            self._watch()

    # -- records ---------------------------------------------------------------------------------------------------

    def _has_more(self) -> bool:
        return self._more or super()._has_more()

    def _read_decrypted(self, descriptor: int, space: Sequence[memoryview]) -> int:
        """In place of `os.readv`. Raises BlockingIOError where there is no whole record."""
        if not self._more:
            count = os.readv(descriptor, (_PIECE,))
            if not count:
                return 0
            self._empty += count
            self._emptied = count < len(_PIECE)
            self._incoming.write(_PIECE[:count])
        try:
            # With a buffer to read into it is a count that is returned, which its declaration does not say.
            count = cast("int", self._tls.read(len(space[0]), space[0]))
        except ssl.SSLWantReadError:
            self._more, self._partial = False, True
            self._flush()
            if self._empty > MAX_EMPTY:
                raise ConnectionError("TLS: it sends records without requests") from None
            raise BlockingIOError from None
        except ssl.SSLZeroReturnError:
            return 0
        except ssl.SSLError as error:
            self._flush()
            raise ConnectionError(f"TLS: {reason_of(error)}") from error
        self._more, self._partial = self._tls.pending() > 0 or self._incoming.pending > 0, False
        self._empty = 0
        return count

    def _send(self, answers: bytes) -> None:
        try:
            self._tls.write(answers)
        except ssl.SSLError as error:
            self.abort(f"TLS: {reason_of(error)}")
            return
        super()._send(self._outgoing.read())

    def _flush(self) -> None:
        """Send what OpenSSL has to say by itself."""
        if self._outgoing.pending:
            super()._send(self._outgoing.read())

    def _unread(self) -> bool:
        return self._more or self._partial or super()._unread()

    def _is_empty(self, count: int, asked: int) -> bool:
        return super()._is_empty(count, asked) and self._emptied and not self._more

    def drop(self, reason: str) -> None:
        """See PeerConnection; TLS says that nothing follows."""
        if not self.handshaking and not self.wire.is_closing():
            with suppress(ssl.SSLError):
                self._tls.unwrap()
            self.wire.write(self._outgoing.read())
        super().drop(reason)
