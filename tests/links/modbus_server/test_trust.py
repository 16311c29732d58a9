"""Files of a listener with TLS: read, refused with the reason, and compared."""

from __future__ import annotations

import os
import ssl
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from gatewayd.links.modbus_server.credentials import PeerCredentials
from gatewayd.links.modbus_server.plan import TrustFiles
from gatewayd.links.modbus_server.trust import FileFacts, Trust, TrustError, ended_by, load, look, stamps_of
from gatewayd.machine.revocation import RevocationList
from gatewayd.machine.x509 import Certificate
from tests.links.modbus_server.secured import Certificates
from tests.peers.authority import OPENSSL, run

NOW = 1.8e9

pytestmark = pytest.mark.skipif(OPENSSL is None, reason="no program openssl")


def test_files_that_fit(certificates: Certificates) -> None:
    trust = load(certificates.files(), NOW)
    assert trust.facts.is_whole_chain
    assert [one.subject for one in trust.facts.chain] == ["CN=gateway", "CN=Commissioning"]
    assert trust.facts.expiries.keys() == {"certificate", "clients", "revoked"}
    assert not trust.facts.exposed
    assert load(certificates.files(revoked=False), NOW).facts.expiries.keys() == {"certificate", "clients"}


def _other_key(files: TrustFiles, certificates: Certificates, _folder: Path) -> TrustFiles:
    return replace(files, key=str(certificates.viewer.key))


def _no_key(files: TrustFiles, _certificates: Certificates, folder: Path) -> TrustFiles:
    return replace(files, key=str(folder / "nowhere.key"))


def _encrypted(files: TrustFiles, certificates: Certificates, folder: Path) -> TrustFiles:
    path = folder / "encrypted.key"
    run("pkey", "-in", certificates.gateway.key, "-aes256", "-passout", "pass:secret", "-out", path)
    return replace(files, key=str(path))


def _no_list(files: TrustFiles, _certificates: Certificates, _folder: Path) -> TrustFiles:
    return replace(files, revoked=files.clients)


def _no_certificate(files: TrustFiles, _certificates: Certificates, _folder: Path) -> TrustFiles:
    return replace(files, certificate=files.key)


def _a_folder(files: TrustFiles, _certificates: Certificates, folder: Path) -> TrustFiles:
    return replace(files, clients=str(folder))


def _broken(files: TrustFiles, _certificates: Certificates, folder: Path) -> TrustFiles:
    path = folder / "broken.crt"
    path.write_text("-----BEGIN CERTIFICATE-----\nAAEC\n-----END CERTIFICATE-----\n")
    return replace(files, clients=str(path))


@pytest.mark.parametrize(
    "change,reason",
    [
        (_other_key, r"key: \S+viewer.key does not fit the certificate \S+gateway.crt"),
        (_no_key, "key: .*nowhere.key cannot be read: no such file"),
        (_encrypted, "key: .* is encrypted, and nobody is there to give its password; store it without one"),
        (_no_list, "revoked: .* cannot be used: no PEM revocation list"),
        (_no_certificate, "certificate: .* cannot be used: no PEM certificate"),
        (_a_folder, "clients: .* cannot be read: is a directory"),
        (_broken, "clients: .* cannot be used: not an X.509 certificate"),
    ],
)
def test_what_is_wrong_is_said_with_the_file(
    certificates: Certificates,
    tmp_path: Path,
    change: Callable[[TrustFiles, Certificates, Path], TrustFiles],
    reason: str,
) -> None:
    with pytest.raises(TrustError, match=reason):
        load(change(certificates.files(), certificates, tmp_path), NOW)


def test_a_chain_that_ends_before_the_authority(certificates: Certificates) -> None:
    alone = certificates.gateway.certificate.with_suffix(".pem")
    assert not look(replace(certificates.files(), certificate=str(alone))).is_whole_chain


def test_a_key_that_everybody_can_read(certificates: Certificates, tmp_path: Path) -> None:
    copy = tmp_path / "cell.key"
    copy.write_bytes(certificates.gateway.key.read_bytes())
    for mode, exposed in ((0o640, False), (0o644, True), (0o600, False)):
        copy.chmod(mode)
        assert look(replace(certificates.files(), key=str(copy))).exposed is exposed


def test_a_file_that_is_another_one_has_another_stamp(tmp_path: Path) -> None:
    file = tmp_path / "file"
    files = TrustFiles(str(file), str(file), str(file), None)
    assert stamps_of(files) == (None, None, None)
    file.write_text("a")
    first = stamps_of(files)
    new = tmp_path / "new"
    new.write_text("b")
    new.replace(file)
    assert stamps_of(files) != first


def test_an_authority_among_the_lists_lets_nobody_in(certificates: Certificates, tmp_path: Path) -> None:
    """Lists are fetched over any network, as they are signed. OpenSSL would take a certificate from there, too."""
    lists = tmp_path / "revoked.crl"
    lists.write_bytes(
        certificates.authority.revoked.read_bytes() + certificates.other.certificate.read_bytes()
    )
    with pytest.raises(TrustError, match=r"revoked: \S+ has a certificate among its lists"):
        load(replace(certificates.files(), revoked=str(lists)), NOW)


AUTHORITIES = (
    Certificate("CN=root", b"root", b"root", 0.0, 100.0),
    Certificate("CN=middle", b"middle", b"root", 0.0, 200.0),
)
OTHERS = RevocationList(b"other", 50.0, frozenset((9,)))
"""Of another authority, which has numbers of its own."""


def trust_with(authorities: set[bytes], *serials: int) -> Trust:
    lists = (RevocationList(b"root", None, frozenset(serials)), OTHERS)
    facts = FileFacts((), AUTHORITIES, lists, authorities=tuple(authorities))
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    return Trust(TrustFiles("", "", "", None), facts, (), context, read_at=10.0)


@pytest.mark.parametrize("now,used_up", [(49.0, False), (50.0, True), (100.0, True), (5.0, False)])
def test_files_are_read_anew_when_something_in_them_expires(now: float, used_up: bool) -> None:
    """OpenSSL would go on to resume sessions."""
    assert trust_with(set()).is_used_up(now) is used_up


def test_a_list_whose_authority_is_spelled_otherwise_counts() -> None:
    """OpenSSL compares names without regard to case and spaces; then every list may be the one."""
    facts = trust_with(set()).facts
    assert not facts.revokes(PeerCredentials(None, "plc", 9, b"root", 0.0))
    assert facts.revokes(PeerCredentials(None, "plc", 9, b"ROOT", 0.0))


@pytest.mark.parametrize(
    "before,after,issuer,reason",
    [
        (trust_with({b"a"}), trust_with({b"a", b"b"}), b"root", ""),
        (trust_with({b"a"}), trust_with({b"a"}, 7), b"root", "its certificate was revoked"),
        (trust_with({b"a"}), trust_with({b"a"}, 8), b"root", ""),
        (
            trust_with({b"a"}),
            trust_with({b"a"}, 8),
            b"between",
            "a certificate was revoked that may be in its chain",
        ),
        (trust_with({b"a"}, 8), trust_with({b"a"}, 8), b"between", ""),
        (
            trust_with({b"a"}),
            trust_with({b"a"}, 8),
            b"middle",
            "a certificate was revoked that may be in its chain",
        ),
        (trust_with({b"a", b"b"}), trust_with({b"b"}), b"root", "an authority of clients was withdrawn"),
    ],
)
def test_who_has_to_show_its_certificate_anew(
    before: Trust, after: Trust, issuer: bytes, reason: str
) -> None:
    assert ended_by(before, after, PeerCredentials("operator", "plc", 7, issuer, 0.0)) == reason


def test_a_file_that_was_overwritten_with_its_old_time_is_another_one(tmp_path: Path) -> None:
    """`cp -p` onto a file of the same length leaves its inode, and sets its time back."""
    path = tmp_path / "revoked.pem"
    path.write_text("one")
    files, before = TrustFiles(str(path), str(path), str(path), None), path.stat()
    stamps = stamps_of(files)
    while path.stat().st_ctime_ns == before.st_ctime_ns:
        path.write_text("two")
        os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    after = path.stat()
    assert (after.st_mtime_ns, after.st_size, after.st_ino) == (
        before.st_mtime_ns,
        before.st_size,
        before.st_ino,
    )
    assert stamps_of(files) != stamps
