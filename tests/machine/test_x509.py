from __future__ import annotations

import re
import ssl
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.machine.x509 import (
    DAY,
    MAX_CERTIFICATES,
    WARN_BEFORE,
    Certificate,
    CertificateError,
    chain_fault,
    from_pem,
    parse,
)
from tests.machine.authority import OPENSSL, Authority

needs_openssl = pytest.mark.skipif(OPENSSL is None, reason="openssl is not installed")

BASIC_CONSTRAINTS = "2.5.29.19"
ALTERNATIVE_NAMES = "2.5.29.17"


@needs_openssl
def test_a_certificate_says_what_openssl_says(tmp_path: Path) -> None:
    authority = Authority(tmp_path)
    path, _key = authority.issue(
        "gateway", "subjectAltName=DNS:gateway.example", "basicConstraints=critical,CA:false"
    )
    own, *more = from_pem(path.read_bytes())
    (issuer,) = from_pem(authority.certificate.read_bytes())
    assert more == []
    # CPython's own reader, for its tests; the public functions read only what was verified.
    expected = ssl._ssl._test_decode_cert(str(path))  # type: ignore[attr-defined]
    assert own.not_before == ssl.cert_time_to_seconds(expected["notBefore"])
    assert own.not_after == ssl.cert_time_to_seconds(expected["notAfter"])
    assert own.subject == "O=Plant, CN=gateway"
    assert (issuer.subject, own.issuer_name) == ("CN=authority", issuer.subject_name)
    (names,) = own.of(ALTERNATIVE_NAMES)
    assert b"gateway.example" in names.value
    assert not names.critical
    assert [found.critical for found in own.of(BASIC_CONSTRAINTS)] == [True]
    assert own.of("1.2.3") == []


@needs_openssl
def test_the_servers_certificate_comes_first(tmp_path: Path) -> None:
    authority = Authority(tmp_path)
    (own,) = from_pem(authority.issue("gateway")[0].read_bytes())
    (issuer,) = from_pem(authority.certificate.read_bytes())
    assert chain_fault([own, issuer]) == "" == chain_fault([own]) == chain_fault([])
    assert "certificate 1 (CN=authority) was not issued by certificate 2" in chain_fault([issuer, own])


def lasting(seconds: float) -> Certificate:
    return Certificate("CN=x", b"", b"", 0.0, seconds)


@pytest.mark.parametrize(
    "certificate, wall, text",
    [
        (lasting(90 * DAY), 10 * DAY, ""),
        (lasting(90 * DAY), 90 * DAY - WARN_BEFORE, ""),
        (lasting(90 * DAY), 90 * DAY - WARN_BEFORE + 1, "expires in 21 days, on 1970-04-01 00:00 UTC"),
        (lasting(90 * DAY), 89 * DAY, "expires in 24 h, on 1970-04-01 00:00 UTC"),
        (lasting(DAY), DAY / 2, ""),
        (lasting(DAY), 0.8 * DAY, "expires in 5 h, on 1970-01-02 00:00 UTC"),
        (lasting(DAY), DAY, "expired on 1970-01-02 00:00 UTC"),
        (lasting(DAY), -1.0, "is not valid before 1970-01-01 00:00 UTC: look at the clock of this machine"),
    ],
)
def test_it_is_reported_while_there_is_time(certificate: Certificate, wall: float, text: str) -> None:
    assert certificate.trouble(wall) == text


@pytest.mark.parametrize(
    "text, reason",
    [
        (b"", "no PEM certificate"),
        (b"-----BEGIN X509 CRL-----", "no PEM certificate"),
        (b"-----BEGIN CERTIFICATE-----A-----END CERTIFICATE-----", "not base64"),
        (b"-----BEGIN CERTIFICATE-----AAAA-----END CERTIFICATE-----", "not an X.509 certificate"),
        (b"-----BEGIN CERTIFICATE----------END CERTIFICATE-----" * (MAX_CERTIFICATES + 1), "more than 16"),
    ],
)
def test_what_is_no_certificate_is_refused(text: bytes, reason: str) -> None:
    with pytest.raises(CertificateError, match=re.escape(reason)):
        from_pem(text)


@needs_openssl
def test_a_damaged_certificate_is_refused_or_read_and_never_more(tmp_path: Path) -> None:
    path, _key = Authority(tmp_path).issue("gateway", "subjectAltName=DNS:gateway.example")
    der = ssl.PEM_cert_to_DER_cert(path.read_text())
    for place in range(len(der)):
        for damaged in (der[:place], der[:place] + bytes([der[place] ^ 0xFF]) + der[place + 1 :]):
            try:
                parse(damaged)
            except CertificateError:
                continue


@given(st.binary(max_size=300))
def test_whatever_the_bytes_are_it_is_an_error_of_ours(data: bytes) -> None:
    with pytest.raises(CertificateError):
        parse(data)
