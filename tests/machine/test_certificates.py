from __future__ import annotations

import os
import ssl
import subprocess
from pathlib import Path

import pytest

from gatewayd.machine.certificates import (
    MAX_FILE,
    CertificateFiles,
    FileWatch,
    ServerIdentity,
    read_certificates,
)
from gatewayd.machine.x509 import DAY, CertificateError
from tests.machine.authority import OPENSSL, Authority

pytestmark = pytest.mark.skipif(OPENSSL is None, reason="openssl is not installed")


def server() -> ssl.SSLContext:
    return ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return Authority(tmp_path)


def test_certificate_and_key_that_fit(authority: Authority) -> None:
    certificate, key = authority.issue("gateway")
    with certificate.open("ab") as stream:
        stream.write(authority.certificate.read_bytes())
    chain = CertificateFiles(certificate, key).load(server())
    assert [found.subject for found in chain] == ["O=Plant, CN=gateway", "CN=authority"]


def fault(certificate: Path, key: Path) -> str:
    with pytest.raises(CertificateError) as error:
        CertificateFiles(certificate, key).load(server())
    return str(error.value)


def test_every_fault_names_the_file_and_the_remedy(authority: Authority, tmp_path: Path) -> None:
    certificate, key = authority.issue("gateway")
    _other, other_key = authority.issue("other")
    assert fault(certificate, other_key) == f"{other_key}: not the key of the certificate in {certificate}"
    assert fault(tmp_path / "none", key) == f"{tmp_path}/none: No such file or directory"
    assert fault(certificate, tmp_path / "none") == f"{tmp_path}/none: No such file or directory"
    assert fault(tmp_path, key) == f"{tmp_path}: not a regular file"
    assert fault(certificate, tmp_path) == f"{tmp_path}: not a regular file"
    assert f"{key}: no PEM certificate" in fault(key, key)
    encrypted = tmp_path / "encrypted.key"
    command = [OPENSSL, "pkey", "-in", key, "-aes256", "-passout", "pass:word", "-out", encrypted]
    subprocess.run(list(map(str, command)), check=True)
    assert f"{encrypted}: the key is encrypted" in fault(certificate, encrypted)
    nonsense = tmp_path / "nonsense"
    nonsense.write_bytes(b"\0" * 100)
    nonsense.chmod(0o600)
    assert f"{nonsense}: not a private key in PEM form" in fault(certificate, nonsense)
    nonsense.write_bytes(bytes(MAX_FILE + 1))
    assert "more than 256 KiB" in fault(nonsense, key)
    key.chmod(0o644)
    assert f"chmod o-rw {key}" in fault(certificate, key)


def test_a_chain_in_the_wrong_order(authority: Authority) -> None:
    certificate, key = authority.issue("gateway")
    certificate.write_bytes(authority.certificate.read_bytes() + certificate.read_bytes())
    assert "the server's own comes first" in fault(certificate, key)


def test_a_change_is_noticed_once(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    watch = FileWatch((first, second))
    assert watch.changed()
    assert not watch.changed()
    first.write_text("1")
    assert watch.changed()
    assert not watch.changed()
    second.write_text("2")
    os.utime(second, ns=(1, 1))
    assert watch.changed()
    second.unlink()
    assert watch.changed()
    assert not watch.changed()


def test_a_faulty_file_leaves_the_former_certificate_in_use(authority: Authority) -> None:
    certificate, key = authority.issue("gateway")
    other, other_key = authority.issue("other")
    identity = ServerIdentity(CertificateFiles(certificate, key), server)
    assert identity.refresh()
    first, (own, *_) = identity.context, identity.chain
    assert not identity.refresh()
    other.replace(certificate)
    assert not identity.refresh()
    assert identity.context is first
    assert identity.chain == (own,)
    assert (
        identity.trouble(own.not_before)
        == f"{key}: not the key of the certificate in {certificate}; the former certificate is in use"
    )
    other_key.replace(key)
    assert identity.refresh()
    assert identity.context is not first
    assert [found.subject for found in identity.chain] == ["O=Plant, CN=other"]
    assert identity.trouble(own.not_before + DAY) == ""
    assert f"{certificate}: the certificate expires in 2 days" in identity.trouble(own.not_after - 2 * DAY)


def test_without_any_usable_certificate_there_is_no_context(authority: Authority, tmp_path: Path) -> None:
    def make() -> ssl.SSLContext:
        read_certificates(tmp_path / "clients.pem")
        return server()

    clients = tmp_path / "clients.pem"
    identity = ServerIdentity(CertificateFiles(*authority.issue("gateway")), make, (clients,))
    assert not identity.refresh()
    assert identity.context is None
    assert identity.trouble(0.0) == f"{clients}: No such file or directory"
    clients.write_bytes(authority.certificate.read_bytes())
    assert identity.refresh()
    assert identity.context is not None
