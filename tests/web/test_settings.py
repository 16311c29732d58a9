"""Options of the status listener."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.web.settings import SettingsError, listen_address, settings


@pytest.mark.parametrize(
    "text, address",
    [
        ("127.0.0.1:9502", ("127.0.0.1", 9502)),
        ("[::1]:9502", ("::1", 9502)),
        (":9502", ("127.0.0.1", 9502)),
        ("gateway.plant:1", ("gateway.plant", 1)),
        ("0.0.0.0:0", ("0.0.0.0", 0)),
    ],
)
def test_addresses(text: str, address: tuple[str, int]) -> None:
    assert listen_address(text) == address


@pytest.mark.parametrize("text", ["", "9502", "127.0.0.1", "a:b", "a:70000", "::1:9502", "a:-1", "a:٣"])
def test_what_is_no_address_is_said_with_an_example(text: str) -> None:
    with pytest.raises(SettingsError, match=r"127\.0\.0\.1:9502"):
        listen_address(text)


@pytest.mark.parametrize(
    "host, local",
    [("127.0.0.1", True), ("127.0.0.9", True), ("[::1]", True), ("localhost", True), ("0.0.0.0", False),
     ("192.0.2.5", False), ("[::]", False), ("gateway.plant", False), ("localhost.plant", False)],
)  # fmt: skip
def test_only_this_machine_reaches_a_loopback_address(host: str, local: bool) -> None:
    assert settings(f"{host}:9502").is_local is local
    assert not settings(f"{host}:9502", proxy="127.0.0.1").is_local, "a proxy leads others here"


def test_beyond_loopback_it_needs_tls_and_tokens(tmp_path: Path) -> None:
    file = tmp_path / "file"
    assert settings("127.0.0.1:9502").obstacle == ""
    missing = settings("192.0.2.5:9502").obstacle
    assert "--status-certificate and --status-key" in missing
    assert "--token-file" in missing
    assert "--token-file" not in settings("192.0.2.5:9502", file).obstacle
    assert "--status-certificate" in settings("192.0.2.5:9502", file).obstacle
    assert "--status-certificate" not in settings("192.0.2.5:9502", None, file, file).obstacle
    assert settings("192.0.2.5:9502", file, file, file).obstacle == ""
    assert settings("192.0.2.5:9502", file, proxy="192.0.2.10").obstacle == ""
    assert "--token-file" in settings("127.0.0.1:9502", proxy="127.0.0.1").obstacle


def test_names_are_those_that_were_declared_and_the_address() -> None:
    assert settings("192.0.2.5:9502", names=["GW1.plant"]).own_names == ("192.0.2.5", "gw1.plant")
    assert settings("0.0.0.0:9502", names=["gw1"]).own_names == ("gw1",)
    assert settings("[::]:9502").own_names == ()


def test_what_cannot_be_used_is_said(tmp_path: Path) -> None:
    for name in ("", "gw1:9502", "https://gw1", "a b", "-", "a..b", "x" * 254, "\xe4"):
        with pytest.raises(SettingsError, match="--status-name"):
            settings("127.0.0.1:1", names=[name])
    for proxy in ("", "proxy.plant", "192.0.2.0/24"):
        with pytest.raises(SettingsError, match="--status-proxy"):
            settings("127.0.0.1:1", proxy=proxy)
    with pytest.raises(SettingsError, match="belong together"):
        settings("127.0.0.1:1", certificate=tmp_path)
