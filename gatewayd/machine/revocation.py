"""Certificate revocation lists (RFC 5280, 5.1) as PEM: which certificates they withdraw, and until when they are valid.

Pure. Whether a list is genuine is OpenSSL's to judge.
"""

from __future__ import annotations

import binascii
import re
from dataclasses import dataclass

from gatewayd.machine.der import (
    GENERALIZED_TIME,
    INTEGER,
    SEQUENCE,
    UTC_TIME,
    DerError,
    elements,
    only,
)
from gatewayd.machine.x509 import CertificateError, time_of

_PEM = re.compile(rb"-----BEGIN X509 CRL-----([A-Za-z0-9+/=\s]*)-----END X509 CRL-----")
_TIMES = (UTC_TIME, GENERALIZED_TIME)


@dataclass(frozen=True, slots=True)
class RevocationList:
    """One list of one authority."""

    issuer_name: bytes
    """DER."""
    next_update: float | None
    """Seconds since 1970; None: it does not say."""
    serials: frozenset[int]


def lists_from_pem(text: bytes) -> tuple[RevocationList, ...]:
    """The lists of a PEM file, in their order. Raises CertificateError; also where there is none."""
    blocks = _PEM.findall(text)
    if not blocks:
        raise CertificateError("no PEM revocation list (-----BEGIN X509 CRL-----) in it")
    try:
        return tuple(
            _parse(binascii.a2b_base64(b"".join(block.split()), strict_mode=True)) for block in blocks
        )
    except (DerError, binascii.Error) as error:
        raise CertificateError(f"not a revocation list: {error}") from error


def _parse(der: bytes) -> RevocationList:
    signed = next(elements(only(der).expect(SEQUENCE).content), None)
    if signed is None:
        raise DerError("nothing in it")
    parts = list(signed.expect(SEQUENCE))
    if parts and parts[0].tag == INTEGER:
        del parts[0]  # the version
    tags = [part.tag for part in parts]
    if tags[:2] != [SEQUENCE, SEQUENCE] or len(parts) < 3 or tags[2] not in _TIMES:
        raise DerError("parts are missing")
    dated = len(parts) > 3 and tags[3] in _TIMES
    entries = parts[4 if dated else 3 :]
    serials = frozenset[int]()
    if entries and entries[0].tag == SEQUENCE:
        firsts = (next(iter(entry.expect(SEQUENCE)), None) for entry in entries[0])
        serials = frozenset(
            int.from_bytes(first.expect(INTEGER).content, "big", signed=True)
            for first in firsts
            if first is not None
        )
    return RevocationList(parts[1].whole, time_of(parts[3]) if dated else None, serials)
