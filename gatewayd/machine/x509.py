"""X.509 certificates (RFC 5280) as PEM or DER: whose, until when, by whom, and with which extensions.

Pure: time is a parameter. Nothing is verified here, that is OpenSSL's. This is for saying what a certificate is, and
for reading what it says of its holder.
"""

from __future__ import annotations

import binascii
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise

from gatewayd.machine.der import (
    GENERALIZED_TIME,
    INTEGER,
    OCTET_STRING,
    SEQUENCE,
    SET,
    UTC_TIME,
    DerError,
    Element,
    identifier,
    only,
)

DAY = 86400.0
WARN_BEFORE = 21 * DAY
"""Seconds before its end at which a certificate is reported; of a short-lived one, a quarter of its life."""
MAX_CERTIFICATES = 16
"""In one file."""

_PEM = re.compile(rb"-----BEGIN CERTIFICATE-----([A-Za-z0-9+/=\s]*)-----END CERTIFICATE-----")
_VERSION, _EXTENSIONS = 0xA0, 0xA3
_TIMES = {UTC_TIME: "%y%m%d%H%M%SZ", GENERALIZED_TIME: "%Y%m%d%H%M%SZ"}
_ATTRIBUTES = {"2.5.4.3": "CN", "2.5.4.10": "O", "2.5.4.11": "OU", "2.5.4.6": "C", "2.5.4.5": "serialNumber"}
"""Those of a name that are shown."""


class CertificateError(ValueError):
    """A certificate or key that cannot be used; the text says which and why."""


@dataclass(frozen=True, slots=True)
class Extension:
    """One extension (RFC 5280, 4.1): its identifier in dotted decimals, and the DER within its octet string."""

    identifier: str
    critical: bool
    value: bytes


@dataclass(frozen=True, slots=True)
class Certificate:
    """What one certificate says. Times are seconds since 1970."""

    subject: str
    """`CN=gateway, O=Plant`."""
    subject_name: bytes
    """The same as DER, for comparisons."""
    issuer_name: bytes
    not_before: float
    not_after: float
    extensions: tuple[Extension, ...] = ()
    """In their order; one identifier may be there several times, which RFC 5280 forbids and the reader may judge."""
    serial: int = 0

    def of(self, wanted: str) -> list[Extension]:
        """The extensions with this identifier."""
        return [extension for extension in self.extensions if extension.identifier == wanted]

    def trouble(self, wall: float) -> str:
        """Why it should be replaced at this time; empty while it need not be."""
        if wall < self.not_before:
            return f"is not valid before {_day(self.not_before)}: look at the clock of this machine"
        if wall >= self.not_after:
            return f"expired on {_day(self.not_after)}"
        left = self.not_after - wall
        if left >= min(WARN_BEFORE, (self.not_after - self.not_before) / 4):
            return ""
        rest = f"{left / DAY:.0f} days" if left >= 2 * DAY else f"{left / 3600:.0f} h"
        return f"expires in {rest}, on {_day(self.not_after)}"


def parse(der: bytes) -> Certificate:
    """One certificate, as `ssl.SSLSocket.getpeercert(True)` has it. Raises CertificateError."""
    try:
        return _parse(der)
    except DerError as error:
        raise CertificateError(f"not an X.509 certificate: {error}") from error


def from_pem(text: bytes) -> tuple[Certificate, ...]:
    """The certificates of a PEM file, in their order. Raises CertificateError; also where there is none."""
    return tuple(map(parse, ders_from_pem(text)))


def ders_from_pem(text: bytes) -> tuple[bytes, ...]:
    """The same as they are, as DER. Raises CertificateError."""
    blocks = _PEM.findall(text)
    if not blocks:
        raise CertificateError("no PEM certificate (-----BEGIN CERTIFICATE-----) in it")
    if len(blocks) > MAX_CERTIFICATES:
        raise CertificateError(f"{len(blocks)} certificates, more than {MAX_CERTIFICATES}")
    try:
        return tuple(binascii.a2b_base64(b"".join(block.split()), strict_mode=True) for block in blocks)
    except binascii.Error as error:
        raise CertificateError(f"a certificate is not base64: {error}") from error


def chain_fault(chain: Sequence[Certificate]) -> str:
    """What is wrong with the order of a server's certificates: each has to be issued by the next. Empty: nothing."""
    for number, (certificate, issuer) in enumerate(pairwise(chain), 1):
        if certificate.issuer_name != issuer.subject_name:
            return (
                f"certificate {number} ({certificate.subject}) was not issued by certificate {number + 1} "
                f"({issuer.subject}): the server's own comes first, then its issuer's, and so on"
            )
    return ""


def _parse(der: bytes) -> Certificate:
    signed, *_signature = only(der).expect(SEQUENCE)
    parts = list(signed.expect(SEQUENCE))
    if parts and parts[0].tag == _VERSION:
        del parts[0]
    if len(parts) < 6:
        raise DerError("parts are missing")
    serial, _algorithm, issuer, validity, subject, _key, *optional = parts
    times = list(validity.expect(SEQUENCE))
    if len(times) != 2:
        raise DerError("a validity without two times")
    extensions = [part for part in optional if part.tag == _EXTENSIONS]
    return Certificate(
        _name(subject),
        subject.whole,
        issuer.whole,
        time_of(times[0]),
        time_of(times[1]),
        tuple(map(_extension, only(extensions[0].content).expect(SEQUENCE))) if extensions else (),
        int.from_bytes(serial.expect(INTEGER).content, "big", signed=True),
    )


def _name(name: Element) -> str:
    """A distinguished name (RFC 5280, 4.1.2.4), of it what people look for."""
    shown: list[str] = []
    for part in name.expect(SEQUENCE):
        for attribute in part.expect(SET):
            parts = list(attribute.expect(SEQUENCE))
            if len(parts) != 2:
                raise DerError("an attribute without a value")
            title = _ATTRIBUTES.get(identifier(parts[0]))
            if title is not None:
                shown.append(f"{title}={parts[1].content.decode(errors='replace')}")
    return ", ".join(shown) or "without a name"


def time_of(element: Element) -> float:
    """UTCTime or GeneralizedTime (RFC 5280, 4.1.2.5): UTC, with seconds."""
    form = _TIMES.get(element.tag)
    if form is None:
        raise DerError("a time of another type")
    try:
        found = datetime.strptime(element.content.decode("ascii"), form).replace(tzinfo=UTC)
        if element.tag == UTC_TIME:
            # RFC 5280, 4.1.2.5.1: 50 and more is 19xx. strptime changes at 69.
            found = found.replace(year=found.year - 100 if found.year >= 2050 else found.year)
        return found.timestamp()
    except (UnicodeDecodeError, ValueError) as error:
        raise DerError("not a time") from error


def _extension(element: Element) -> Extension:
    parts = list(element.expect(SEQUENCE))
    if not 2 <= len(parts) <= 3:
        raise DerError("an extension without identifier or value")
    critical = len(parts) == 3 and parts[1].content != b"\x00"
    return Extension(identifier(parts[0]), critical, parts[-1].expect(OCTET_STRING).content)


def _day(wall: float) -> str:
    return datetime.fromtimestamp(wall, UTC).strftime("%Y-%m-%d %H:%M UTC")
