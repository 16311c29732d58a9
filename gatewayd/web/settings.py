"""Where the status listener listens, and what it asks for. Light: the command line is checked by it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path

from gatewayd.report.format import parse_address

_NAME = re.compile(
    r"(?=.{1,253}$)[a-z0-9_]([a-z0-9_-]{0,62}[a-z0-9_])?(\.[a-z0-9_]([a-z0-9_-]{0,62}[a-z0-9_])?)*"
)


class SettingsError(ValueError):
    """An option that cannot be used; the text says what to do."""


@dataclass(frozen=True, slots=True)
class TlsFiles:
    """Where certificate and private key are, as PEM."""

    certificate: Path
    key: Path


@dataclass(frozen=True, slots=True)
class Settings:
    """Where to listen, and what to ask for."""

    host: str
    port: int
    token_file: Path | None = None
    tls: TlsFiles | None = None
    names: tuple[str, ...] = ()
    """Further names by which clients may call the listener, in lower case."""
    proxy: str | None = None
    """Address of a reverse proxy that ends TLS in front of the listener; None: there is none."""

    @property
    def is_local(self) -> bool:
        """Whether only this machine reaches it, and no proxy leads others to it."""
        return self.proxy is None and is_loopback(self.host)

    @property
    def own_names(self) -> tuple[str, ...]:
        """What clients may call the listener beside the address of their connection."""
        everywhere = _is_address(self.host) and ip_address(self.host).is_unspecified
        return self.names if everywhere else (_usual(self.host), *self.names)

    @property
    def obstacle(self) -> str:
        """Why it must not listen like this, and what to do; empty: it may."""
        if self.is_local:
            return ""
        missing = []
        if self.tls is None and self.proxy is None:
            missing.append("--status-certificate and --status-key (or --status-proxy ADDRESS)")
        if self.token_file is None:
            missing.append("--token-file (gatewayd token create)")
        return f"beyond loopback it needs {' and '.join(missing)}" if missing else ""


def settings(  # noqa: PLR0917 - one for each option
    text: str,
    token_file: Path | None = None,
    certificate: Path | None = None,
    key: Path | None = None,
    names: Sequence[str] = (),
    proxy: str | None = None,
) -> Settings:
    """What the options say. Raises SettingsError."""
    host, port = listen_address(text)
    if (certificate is None) != (key is None):
        raise SettingsError("--status-certificate and --status-key belong together: give both, or neither")
    tls = TlsFiles(certificate, key) if certificate is not None and key is not None else None
    known = tuple(_usual(name) for name in names)
    for name in known:
        if not _NAME.fullmatch(name) and not _is_address(name):
            raise SettingsError(f"--status-name {name}: not a name or an address, without port and scheme")
    if proxy is not None and not _is_address(proxy):
        raise SettingsError(f"--status-proxy {proxy}: not an IP address, say 192.0.2.10")
    return Settings(host, port, token_file, tls, known, proxy)


def listen_address(text: str) -> tuple[str, int]:
    """`127.0.0.1:9502`, `[::1]:9502`, `gateway.plant:9502`; `:9502` alone is loopback."""
    try:
        return parse_address(f"127.0.0.1{text}" if text.startswith(":") else text)
    except ValueError as error:
        raise SettingsError(str(error)) from None


def is_loopback(host: str) -> bool:
    """Whether a host, as it is written, is this machine for itself; another name might be anything."""
    if host.lower() == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _usual(name: str) -> str:
    """A name or an address as it is compared with what a client says."""
    return str(ip_address(name)) if _is_address(name) else name.lower()


def _is_address(text: str) -> bool:
    try:
        ip_address(text)
    except ValueError:
        return False
    return True
