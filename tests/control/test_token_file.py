from __future__ import annotations

import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from gatewayd.control.access import Role
from gatewayd.control.token_file import MAX_FILE, change_tokens, read_tokens
from gatewayd.control.tokens import RANDOM_BYTES, TokenFileError, TokenSet, new_token

NOW = 1_800_000_000.0


def add(path: Path, name: str) -> None:
    token, _text = new_token(name, Role.VIEWER, NOW, 3600.0, os.urandom(RANDOM_BYTES))
    change_tokens(path, lambda tokens: tokens.with_token(token, NOW))


def test_a_new_file_is_for_its_owner_and_the_group_of_its_directory(tmp_path: Path) -> None:
    directory = tmp_path / "etc"
    directory.mkdir()
    if os.geteuid() == 0:
        os.chown(directory, -1, 12345)
    path = directory / "tokens"
    add(path, "anna")
    found = path.stat()
    assert stat.S_IMODE(found.st_mode) == 0o640
    assert found.st_gid == directory.stat().st_gid
    if os.geteuid() == 0:
        os.chown(path, -1, 23456)
    add(path, "bert")
    assert path.stat().st_gid == found.st_gid or path.stat().st_gid == 23456
    assert [token.name for token in read_tokens(path).tokens] == ["anna", "bert"]
    assert list(directory.iterdir()) == [path]


def test_commands_at_the_same_time_lose_nothing(tmp_path: Path) -> None:
    names = [f"t{number}" for number in range(12)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda name: add(tmp_path / "tokens", name), names))
    assert sorted(token.name for token in read_tokens(tmp_path / "tokens").tokens) == sorted(names)


def test_what_fails_leaves_the_file_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "tokens"
    add(path, "anna")
    before = path.read_bytes()

    def fail(_tokens: TokenSet) -> TokenSet:
        raise TokenFileError("no")

    with pytest.raises(TokenFileError):
        change_tokens(path, fail)
    assert path.read_bytes() == before
    path.write_text("secret-of-the-former-kind")
    with pytest.raises(TokenFileError, match="gatewayd token create"):
        add(path, "bert")
    assert path.read_text() == "secret-of-the-former-kind"


def test_every_fault_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "tokens"
    with pytest.raises(FileNotFoundError):
        read_tokens(path)
    with pytest.raises(TokenFileError, match="not a regular file"):
        read_tokens(tmp_path)
    with pytest.raises(TokenFileError, match="not a regular file"):
        read_tokens(Path("/dev/zero"))
    path.write_bytes(b" " * (MAX_FILE + 1))
    path.chmod(0o600)
    with pytest.raises(TokenFileError, match=f"{path}: more than 64 KiB"):
        read_tokens(path)
    path.write_text("{}")
    with pytest.raises(TokenFileError, match=f"{path}: not a file of tokens"):
        read_tokens(path)
    path.chmod(0o604)
    with pytest.raises(TokenFileError, match=f"chmod o-rw {path}"):
        read_tokens(path)
