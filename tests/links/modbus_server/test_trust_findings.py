from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import pytest

from gatewayd.links.modbus_server.trust_findings import findings
from tests.links.modbus_server.secured import Certificates
from tests.peers.authority import OPENSSL

pytestmark = pytest.mark.skipif(OPENSSL is None, reason="no program openssl")


def test_files_in_order(certificates: Certificates) -> None:
    assert list(findings(certificates.files(revoked=False), time.time())) == []


def test_what_expires_is_told_before_and_after(certificates: Certificates) -> None:
    files, now = certificates.files(), time.time()
    soon = list(findings(files, now + 25 * 86400))
    assert [(each.key, each.unusable) for each in soon] == [("revoked", False)]
    assert "expires in 4 days: a revocation list, on " in soon[0].text
    late = {each.key: each for each in findings(files, now + 366 * 86400)}
    assert late.keys() == {"certificate", "revoked"}
    assert late["certificate"].text.startswith("has expired: the gateway's certificate, on ")
    assert late["certificate"].unusable
    assert [each.key for each in findings(files, now + 3649 * 86400)] == [
        "certificate",
        "clients",
        "revoked",
    ]


def test_clocks_that_differ(certificates: Certificates) -> None:
    found = list(findings(certificates.files(revoked=False), time.time() - 86400))
    assert [(each.key, each.remedy) for each in found] == [("certificate", "compare the clocks")]


def test_all_that_is_wrong_comes_together(certificates: Certificates, tmp_path: Path) -> None:
    key = tmp_path / "cell.key"
    key.write_bytes(certificates.viewer.key.read_bytes())
    key.chmod(0o644)
    alone = certificates.gateway.certificate.with_suffix(".pem")
    files = replace(certificates.files(revoked=False), key=str(key), certificate=str(alone))
    texts = [each.text for each in findings(files, time.time())]
    assert len(texts) == 3
    assert "does not fit" in texts[0]
    assert "the whole chain" in texts[1]
    assert "can be read by everybody" in texts[2]


def test_a_missing_file_is_one_finding(certificates: Certificates) -> None:
    files = replace(certificates.files(), clients="/nowhere/clients.crt")
    (found,) = findings(files, time.time())
    assert (found.key, found.text) == ("clients", "cannot be read: no such file or directory")
