"""Options of the status listener."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.web.settings import Settings, SettingsError, listen_address, read_token
from tests.web.press import TOKEN


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


def test_a_token_is_one_word_that_nobody_else_may_read(token_file: Path, tmp_path: Path) -> None:
    assert Settings("127.0.0.1:0", token_file).token == TOKEN
    token_file.chmod(0o644)
    with pytest.raises(SettingsError, match="chmod o-rw"):
        read_token(token_file)
    for contents in (b"", b"short", b"two words that are long enough", b"\xff" * 30):
        token_file.write_bytes(contents)
        token_file.chmod(0o600)
        with pytest.raises(SettingsError, match="token"):
            read_token(token_file)
    with pytest.raises(SettingsError, match="No such file"):
        read_token(tmp_path / "nothing")
    with pytest.raises(SettingsError, match="not a regular file"):
        read_token(Path("/dev/zero"))
