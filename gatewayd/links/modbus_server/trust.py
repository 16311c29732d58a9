"""By what a secured listener and its clients know each other: the files of the mapping as an `ssl.SSLContext`.

TLS is OpenSSL's. What is said here is which of it may be used (Modbus/TCP Security): TLS 1.2 or later (R-01, R-32,
R-34), a certificate from both sides (R-02, R-06), cipher suites with forward secrecy and authentication only, among
them TLS_ECDHE_RSA_WITH_AES_128_GCM_SHA256 (R-14) and none without encryption (R-67), no renegotiation.
"""

from __future__ import annotations

import ssl
import stat
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NoReturn, TypeVar

from gatewayd.links.modbus_server.credentials import PeerCredentials
from gatewayd.links.modbus_server.plan import TrustFiles
from gatewayd.machine.certificates import signature_of
from gatewayd.machine.revocation import RevocationList, lists_from_pem
from gatewayd.machine.x509 import Certificate, CertificateError, ders_from_pem, from_pem, parse

CIPHERS = "ECDHE+AESGCM:ECDHE+CHACHA20:!aNULL:!eNULL"
"""Of TLS 1.2; those of TLS 1.3 are all of this kind."""
_FOREIGN = "its authority is not in `clients`"
_CAUSES = {
    3: "`revoked` has no list of its authority",
    12: "`revoked` has a list that is out of date",
    18: _FOREIGN,
    19: _FOREIGN,
    20: _FOREIGN,
    21: _FOREIGN,
}
"""Codes of OpenSSL's verification (x509_vfy.h), and what they mean here."""
_MISFITS = {"KEY_VALUES_MISMATCH", "KEY_TYPE_MISMATCH", "NO_CERTIFICATE_ASSIGNED"}
_Parsed = TypeVar("_Parsed")
MAX_FILE = 32 * 1024 * 1024
"""Bytes of one file."""
MAX_SESSIONS = 256
"""Sessions that OpenSSL keeps of clients with TLS 1.2 and without tickets, each with the client's certificates: 10 KiB
and more. Its own bound is 20480, which would be hundreds of megabytes, and `ssl` has no way to another one."""


class TrustError(OSError):
    """A file cannot be used; the message names it."""

    def __init__(self, key: str, path: str, text: str, remedy: str = "") -> None:
        super().__init__(f"modbus: tls: {key}: {path} {text}" + (f"; {remedy}" if remedy else ""))
        self.key = key
        """In the mapping."""
        self.text = text
        """What is wrong, after its path."""
        self.remedy = remedy or "docs/howto/secure-modbus.md shows how the files are made"


@dataclass(frozen=True, slots=True)
class FileFacts:
    """What the files say, whether or not they can be used together."""

    chain: tuple[Certificate, ...] = ()
    """The listener's own certificate, then those between it and the authority."""
    clients: tuple[Certificate, ...] = ()
    lists: tuple[RevocationList, ...] = ()
    exposed: bool = False
    """The key can be read by others than its owner and its group."""
    authorities: tuple[bytes, ...] = ()
    """DER of `clients`."""

    @property
    def expiries(self) -> Mapping[str, float]:
        """Key of the file in the mapping -> when the first thing in it expires, in seconds since 1970."""
        return {
            key: min(times)
            for key, times in (
                ("certificate", [one.not_after for one in self.chain]),
                ("clients", [one.not_after for one in self.clients]),
                ("revoked", [one.next_update for one in self.lists if one.next_update is not None]),
            )
            if times
        }

    @property
    def revoked(self) -> frozenset[tuple[bytes, int]]:
        """Name of the authority (DER) and serial number of everything that is on a list."""
        return frozenset((one.issuer_name, serial) for one in self.lists for serial in one.serials)

    def revokes(self, shown: PeerCredentials) -> bool:
        """Whether a client's own certificate is on the list of its authority: others use the same numbers."""
        own = [one for one in self.lists if one.issuer_name == shown.issuer]
        # OpenSSL takes names for the same that are spelled otherwise; then nobody knows which list it was.
        return any(shown.serial in one.serials for one in own or self.lists)

    def ended_between(self, former: float, now: float) -> bool:
        """Whether anything that lets clients in has expired within this time."""
        times = [one.not_after for one in self.clients]
        times += [one.next_update for one in self.lists if one.next_update is not None]
        return any(former < at <= now for at in times)

    @property
    def is_whole_chain(self) -> bool:
        """Whether each certificate is issued by the next one, and the last by itself (R-46)."""
        links = zip(self.chain, (*self.chain[1:], *self.chain[-1:]), strict=True)
        return all(one.issuer_name == issuer.subject_name for one, issuer in links)


@dataclass(frozen=True, slots=True)
class Trust:
    """Files that were read together, ready for use."""

    files: TrustFiles
    facts: FileFacts
    stamps: tuple[object, ...]
    """By which a later look knows whether a file is another one."""
    context: ssl.SSLContext = field(compare=False)
    read_at: float
    """Seconds since 1970."""

    def is_used_up(self, now: float) -> bool:
        """Whether the files have to be read again although they are the same.

        OpenSSL resumes a session without a look at lists and authorities, and that these have expired meanwhile would
        not be seen; a new context knows no sessions.
        """
        sessions = self.context.session_stats()["number"]
        return sessions > MAX_SESSIONS or self.facts.ended_between(self.read_at, now)


def load(files: TrustFiles, now: float) -> Trust:
    """Read all of the files. Raises TrustError for the first thing because of which nobody could be served.

    `now`: seconds since 1970. Reads disks: call it in a thread of its own.
    """
    stamps = stamps_of(files)
    facts = look(files)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.verify_mode = ssl.CERT_REQUIRED
    context.options |= ssl.OP_NO_RENEGOTIATION | ssl.OP_NO_COMPRESSION | ssl.OP_CIPHER_SERVER_PREFERENCE
    context.set_ciphers(CIPHERS)
    try:
        context.load_cert_chain(files.certificate, files.key, partial(_no_password, files.key))
    except ssl.SSLError as error:
        if error.reason in _MISFITS:
            _fail(
                "key",
                files.key,
                f"does not fit the certificate {files.certificate}",
                "take the key it was made with",
            )
        _fail("key", files.key, f"cannot be used with {files.certificate}: {reason_of(error)}")
    except TrustError:
        raise
    except OSError as error:
        _fail("key", files.key, _plain(error))
    try:
        context.load_verify_locations(cadata=b"".join(facts.authorities))
    except ssl.SSLError as error:
        _fail("clients", files.clients, f"cannot be used: {reason_of(error)}")
    if files.revoked is not None:
        _load_lists(context, files.revoked)
        # Of every authority in a client's chain a list is asked for: one without a list is not let in.
        context.verify_flags |= ssl.VERIFY_CRL_CHECK_CHAIN
    return Trust(files, facts, stamps, context, now)


def look(files: TrustFiles) -> FileFacts:
    """What the files say. Raises TrustError for one that cannot be read."""
    chain = _read("certificate", files.certificate, from_pem)
    authorities = _read("clients", files.clients, _with_certificates)
    return FileFacts(
        chain,
        tuple(certificate for _der, certificate in authorities),
        () if files.revoked is None else _read("revoked", files.revoked, lists_from_pem),
        is_exposed(files.key),
        tuple(der for der, _certificate in authorities),
    )


def is_exposed(key: str) -> bool:
    """Whether everybody on this machine can read the key. A group is how a service is given one (`ssl-cert`)."""
    try:
        return bool(Path(key).stat().st_mode & stat.S_IROTH)
    except OSError:
        return False


def stamps_of(files: TrustFiles) -> tuple[object, ...]:
    """Something that is another thing when one of the files is: of a missing one None."""
    return tuple(signature_of(Path(path)) for path in _paths(files).values())


def paths_of(files: TrustFiles) -> Mapping[str, str]:
    """Key in the mapping -> path."""
    return _paths(files)


def ended_by(former: Trust, trust: Trust, shown: PeerCredentials) -> str:
    """Why a client that was let in by other files has to end its connection; empty: it need not.

    What it showed is not at hand any more, so where something was withdrawn that it may have been let in by, it has to
    show it anew.
    """
    if trust.facts.revokes(shown):
        return "its certificate was revoked"
    if not set(former.facts.authorities) <= set(trust.facts.authorities):
        return "an authority of clients was withdrawn"
    by = {issuer for issuer, _serial in trust.facts.revoked - former.facts.revoked}
    if by and _may_be_above(shown.issuer, by, trust.facts.clients):
        return "a certificate was revoked that may be in its chain"
    return ""


def _may_be_above(name: bytes, by: Collection[bytes], known: Collection[Certificate]) -> bool:
    """Whether one that these authorities issued may stand between a client and the last of its authorities."""
    names, seen = {name}, set[bytes]()
    while names:
        name = names.pop()
        seen.add(name)
        above = {one.issuer_name for one in known if one.subject_name == name}
        if not above:
            return True  # the client sent it, and it is not at hand any more
        above.discard(name)
        if not above.isdisjoint(by):
            return True
        names |= above - seen
    return False


def reason_of(error: ssl.SSLError) -> str:
    """What OpenSSL says, in small letters."""
    if isinstance(error, ssl.SSLCertVerificationError):
        cause = _CAUSES.get(error.verify_code)
        return error.verify_message + (f": {cause}" if cause else "")
    return (error.reason or str(error)).replace("_", " ").lower()


def _no_password(key: str) -> NoReturn:
    _fail("key", key, "is encrypted, and nobody is there to give its password", "store it without one")


def _paths(files: TrustFiles) -> dict[str, str]:
    paths = {"certificate": files.certificate, "key": files.key, "clients": files.clients}
    return paths if files.revoked is None else {**paths, "revoked": files.revoked}


def _load_lists(context: ssl.SSLContext, path: str) -> None:
    before = context.cert_store_stats()["x509"]
    try:
        context.load_verify_locations(path)
    except ssl.SSLError as error:
        _fail("revoked", path, f"cannot be used: {reason_of(error)}")
    except OSError as error:
        _fail("revoked", path, _plain(error))
    # Lists are signed, so they are fetched over any network; an authority among them would let its clients in.
    if context.cert_store_stats()["x509"] != before:
        _fail(
            "revoked",
            path,
            "has a certificate among its lists",
            "lists alone belong there; authorities into `clients`",
        )


def _with_certificates(text: bytes) -> tuple[tuple[bytes, Certificate], ...]:
    return tuple((der, parse(der)) for der in ders_from_pem(text))


def _plain(error: OSError) -> str:
    return f"cannot be read: {(error.strerror or str(error)).lower()}"


def _read(key: str, path: str, parse: Callable[[bytes], _Parsed]) -> _Parsed:
    try:
        with Path(path).open("rb") as file:
            text = file.read(MAX_FILE + 1)
        if len(text) > MAX_FILE:
            _fail(key, path, f"has more than {MAX_FILE} bytes")
        return parse(text)
    except TrustError:
        raise
    except OSError as error:
        _fail(key, path, _plain(error))
    except CertificateError as error:
        _fail(key, path, f"cannot be used: {error}")


def _fail(key: str, path: str, text: str, remedy: str = "") -> NoReturn:
    raise TrustError(key, path, text, remedy)
