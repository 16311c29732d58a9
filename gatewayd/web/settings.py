"""Where the status listener listens, and the token that it asks for. Light: the command line is checked by it."""

from __future__ import annotations

import stat
from pathlib import Path

from gatewayd.report.format import parse_address

MIN_TOKEN = 16
"""Characters that a token must have."""


class SettingsError(ValueError):
    """An option that cannot be used; the text says what to do."""


class Settings:
    """Where to listen and what to ask for. Raises SettingsError."""

    def __init__(self, text: str, token_file: Path | None = None) -> None:
        self.host, self.port = listen_address(text)
        self.token = read_token(token_file) if token_file is not None else None


def listen_address(text: str) -> tuple[str, int]:
    """`127.0.0.1:9502`, `[::1]:9502`, `gateway.plant:9502`; `:9502` alone is loopback."""
    try:
        return parse_address(f"127.0.0.1{text}" if text.startswith(":") else text)
    except ValueError as error:
        raise SettingsError(str(error)) from None


def read_token(path: Path) -> str:
    """The token: the file's only line. A file that others may read is refused."""
    try:
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            raise SettingsError(f"{path}: not a regular file")
        if mode & (stat.S_IROTH | stat.S_IWOTH):
            raise SettingsError(f"{path}: others may read or change it; run: chmod o-rw {path}")
        with path.open("rb") as stream:
            text = stream.read(1024).decode().strip()
    except OSError as error:
        raise SettingsError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise SettingsError(f"{path}: not a text file") from error
    if len(text) < MIN_TOKEN or not text.isascii() or not text.isprintable() or " " in text:
        raise SettingsError(
            f"{path}: a token is one word of at least {MIN_TOKEN} characters; make one: "
            f"head -c 24 /dev/urandom | base64 > {path}"
        )
    return text
