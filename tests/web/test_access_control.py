from __future__ import annotations

import time
from pathlib import Path

import pytest

from gatewayd.control.access import Role
from gatewayd.web.access_control import TOKEN_SOON, AccessControl
from gatewayd.web.settings import settings
from tests.machine.authority import OPENSSL, Authority
from tests.web.press import TOKEN, engineer, token, write_tokens


def test_on_loopback_nothing_is_needed() -> None:
    found = AccessControl(settings("127.0.0.1:0"))
    found.refresh()
    assert (found.obstacle, found.troubles(time.time())) == ("", [])


def test_beyond_it_is_not_opened_without_and_says_so() -> None:
    found = AccessControl(settings("192.0.2.5:9502"))
    assert "beyond loopback it needs" in found.obstacle
    assert found.troubles(0.0) == [f"status listener: not open: {found.obstacle}"]


def test_tokens_are_reported_before_they_end_and_a_faulty_file_at_once(tmp_path: Path) -> None:
    file, now = tmp_path / "tokens", time.time()
    soon, later = (
        token("anna", Role.VIEWER, TOKEN, TOKEN_SOON),
        token("bert", Role.VIEWER, "x", 400 * 86400.0),
    )
    write_tokens(file, soon, later)
    found = AccessControl(settings("127.0.0.1:0", file))
    found.refresh()
    assert found.troubles(now) == []
    assert found.troubles(now + 0.8 * TOKEN_SOON) == ["status listener: the token anna ends in 2.8 days"]
    assert found.troubles(now + 2 * TOKEN_SOON) == []
    file.write_text("?")
    found.refresh()
    (trouble,) = found.troubles(now)
    assert trouble.startswith(
        f"status listener: nothing can be changed with a token: {file}: not a file of tokens"
    )


@pytest.mark.skipif(OPENSSL is None, reason="openssl is not installed")
def test_it_is_opened_once_there_is_a_certificate(tmp_path: Path) -> None:
    certificate, key = tmp_path / "gateway.pem", tmp_path / "gateway.key"
    found = AccessControl(settings("127.0.0.1:0", engineer(tmp_path / "tokens"), certificate, key))
    found.refresh()
    assert found.obstacle == f"{certificate}: No such file or directory"
    Authority(tmp_path).issue("gateway")
    found.refresh()
    assert found.obstacle == ""
    assert found.troubles(time.time()) == []
    assert "certificate expires in" in found.troubles(time.time() + 80 * 86400)[-1]
