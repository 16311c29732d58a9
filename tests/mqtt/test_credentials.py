"""What a connection needs from files, and what is said of files that are none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from gatewayd.mqtt.credentials import CredentialsError, needs_files, read_credentials
from gatewayd.mqtt.messages import BrokerSettings, BrokerTlsFiles

PLAIN = BrokerSettings("broker", 1883, "press", username="press")


def test_the_first_line_is_the_password(tmp_path: Path) -> None:
    file = tmp_path / "secret"
    file.write_bytes("gehäim \r\nnext\n".encode())
    settings = replace(PLAIN, password_file=str(file))
    assert needs_files(settings)
    assert read_credentials(settings).password == "gehäim "  # noqa: S105 - of a test
    assert not needs_files(PLAIN)


@pytest.mark.parametrize("content, why", [(b"\xff\xfe", "not UTF-8"), (b"x" * 5000, "more than 4096 bytes")])
def test_what_is_no_password(tmp_path: Path, content: bytes, why: str) -> None:
    file = tmp_path / "secret"
    file.write_bytes(content)
    with pytest.raises(CredentialsError, match=f"password_file {file}: {why}"):
        read_credentials(replace(PLAIN, password_file=str(file)))


def test_files_of_tls_that_are_none(tmp_path: Path) -> None:
    (tmp_path / "empty").write_text("")
    for tls in (BrokerTlsFiles(ca=str(tmp_path / "none")), BrokerTlsFiles(ca=str(tmp_path / "empty"))):
        with pytest.raises(CredentialsError, match=f"tls: ca {tmp_path}"):
            read_credentials(replace(PLAIN, tls=tls))
    with pytest.raises(CredentialsError, match=f"tls: {tmp_path}/none and {tmp_path}/none"):
        read_credentials(
            replace(PLAIN, tls=BrokerTlsFiles("", str(tmp_path / "none"), str(tmp_path / "none")))
        )
