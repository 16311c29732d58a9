from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.links.modbus_server.role import RoleError, role_of
from gatewayd.machine.x509 import CertificateError, parse

ROLE = bytes.fromhex("0c08") + b"operator"
OTHER = bytes.fromhex("0603551d13")


def tlv(tag: int, *parts: bytes) -> bytes:
    content = b"".join(parts)
    length = len(content)
    if length < 0x80:
        return bytes((tag, length)) + content
    if length < 0x100:
        return bytes((tag, 0x81, length)) + content
    return bytes((tag, 0x82)) + length.to_bytes(2, "big") + content


def extension(
    value: bytes, oid: bytes = tlv(0x06, bytes.fromhex("2b0601040183890c862201")), *, critical: bool = False
) -> bytes:
    return tlv(0x30, oid, tlv(0x01, b"\xff") if critical else b"", tlv(0x04, value))


def certificate(*extensions: bytes, version: bool = True) -> bytes:
    """As RFC 5280 has it, with a signature of nobody."""
    name = tlv(0x30, tlv(0x31, tlv(0x30, tlv(0x06, bytes.fromhex("550403")), tlv(0x0C, b"plc-1"))))
    algorithm = tlv(0x30, tlv(0x06, b"\x2a"))
    content = tlv(
        0x30,
        tlv(0xA0, tlv(0x02, b"\x02")) if version else b"",
        tlv(0x02, b"\x00\x91"),
        algorithm,
        tlv(0x30),
        tlv(0x30, tlv(0x17, b"260101000000Z"), tlv(0x17, b"270101000000Z")),
        name,
        tlv(0x30, algorithm, tlv(0x03, b"\x00")),
        tlv(0xA3, tlv(0x30, *extensions)) if extensions else b"",
    )
    return tlv(0x30, content, algorithm, tlv(0x03, b"\x00"))


def test_r21_r22_the_role_is_one_utf8_string() -> None:
    assert role_of(parse(certificate(extension(ROLE, critical=True)))) == "operator"
    umlaut = tlv(0x0C, "Führung".encode())
    assert role_of(parse(certificate(extension(umlaut)))) == "Führung"


def test_r23_none_is_none() -> None:
    for made in (certificate(), certificate(extension(b"\x30\x00", OTHER)), certificate(version=False)):
        assert role_of(parse(made)) is None


@pytest.mark.parametrize(
    "extensions,why",
    [
        ((extension(ROLE), extension(ROLE)), "exactly one is allowed"),
        ((extension(tlv(0x13, b"operator")),), "not one UTF8String"),
        ((extension(ROLE + ROLE),), "not one UTF8String"),
        ((extension(b"operator"),), "not one UTF8String"),
        ((extension(tlv(0x0C, b"\xff\xfe")),), "not one UTF8String"),
        ((extension(tlv(0x0C)),), "the role has not 1 to 64"),
        ((extension(tlv(0x0C, b"a" * 65)),), "the role has not 1 to 64"),
        ((extension(tlv(0x0C, b"a\nb")),), "that can be shown"),
        ((extension(tlv(0x0C, "a\u202eb".encode())),), "that can be shown"),
    ],
)
def test_r65_a_role_that_cannot_be_believed_is_a_fault(extensions: tuple[bytes, ...], why: str) -> None:
    with pytest.raises(RoleError, match=why):
        role_of(parse(certificate(*extensions)))


GOOD = certificate(extension(b"\x30\x00", OTHER), extension(ROLE))


@given(st.integers(0, len(GOOD) - 1), st.integers(0, 255), st.integers(0, len(GOOD)))
def test_a_certificate_with_a_wrong_byte_or_cut_off(position: int, byte: int, end: int) -> None:
    data = bytearray(GOOD)
    data[position] = byte
    for hostile in (bytes(data), GOOD[:end]):
        try:
            role = role_of(parse(hostile))
        except (CertificateError, RoleError):
            continue
        assert role is None or 1 <= len(role) <= 64
