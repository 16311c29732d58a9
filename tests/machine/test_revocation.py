from __future__ import annotations

import base64

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.machine.revocation import RevocationList, lists_from_pem
from gatewayd.machine.x509 import CertificateError
from tests.links.modbus_server.test_role import tlv

ALGORITHM = tlv(0x30, tlv(0x06, b"\x2a"))
ISSUER, TIME = tlv(0x30), tlv(0x17, b"260101000000Z")
ENTRIES = tlv(0x30, tlv(0x30, tlv(0x02, b"\x02"), TIME), tlv(0x30, tlv(0x02, b"\x00\x91"), TIME, tlv(0x30)))


def listed(*parts: bytes) -> bytes:
    return tlv(0x30, tlv(0x30, *parts), ALGORITHM, tlv(0x03, b"\x00"))


def pem(der: bytes) -> bytes:
    return b"-----BEGIN X509 CRL-----\n" + base64.b64encode(der) + b"\n-----END X509 CRL-----\n"


def read(der: bytes) -> tuple[RevocationList, ...]:
    return lists_from_pem(pem(der))


def test_whom_it_withdraws_and_until_when_it_is_valid() -> None:
    (found,) = read(listed(tlv(0x02, b"\x01"), ALGORITHM, ISSUER, TIME, TIME, ENTRIES))
    assert (found.issuer_name, found.next_update, found.serials) == (
        ISSUER,
        1767225600.0,
        frozenset({2, 0x91}),
    )


def test_one_that_withdraws_nobody_and_says_no_time() -> None:
    for parts in ((ALGORITHM, ISSUER, TIME), (ALGORITHM, ISSUER, TIME, tlv(0xA0, tlv(0x30)))):
        (found,) = read(listed(*parts))
        assert (found.next_update, found.serials) == (None, frozenset())


def test_a_file_without_a_list_or_with_one_that_is_no_base64() -> None:
    for text in (b"", pem(b"\0").replace(b"AA==", b"AAE")):
        with pytest.raises(CertificateError):
            lists_from_pem(text)


@pytest.mark.parametrize("parts", [(), (ALGORITHM,), (ALGORITHM, ISSUER), (ALGORITHM, TIME, TIME)])
def test_what_is_no_list(parts: tuple[bytes, ...]) -> None:
    with pytest.raises(CertificateError):
        read(listed(*parts))


GOOD = listed(tlv(0x02, b"\x01"), ALGORITHM, ISSUER, TIME, TIME, ENTRIES)


@given(st.integers(0, len(GOOD) - 1), st.integers(0, 255), st.integers(0, len(GOOD)))
def test_a_list_with_a_wrong_byte_or_cut_off(position: int, byte: int, end: int) -> None:
    data = bytearray(GOOD)
    data[position] = byte
    for hostile in (bytes(data), GOOD[:end]):
        try:
            lists_from_pem(pem(hostile))
        except CertificateError:
            continue
