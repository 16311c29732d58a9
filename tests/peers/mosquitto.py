"""mosquitto as a process: a broker with a configuration that is written for it, on a port of its own.

Where it is not installed, the tests that ask for it are skipped.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from tests.e2e.processes import HOST, Process, free_port, wait_for

_ELSEWHERE = os.pathsep.join((os.environ.get("PATH", ""), "/usr/sbin", "/usr/local/sbin"))
"""Debian puts the broker where only root's PATH leads."""


@dataclass(frozen=True)
class BrokerTls:
    """Files for TLS, made by `certificates`."""

    authority: Path
    certificate: Path
    key: Path
    client_certificate: Path
    client_key: Path
    asks_for_certificate: bool = False
    """Whether clients need one; its common name is the user's name then."""


@dataclass(frozen=True)
class BrokerOptions:
    """How the broker is configured."""

    users: Mapping[str, str] = field(default_factory=dict)
    """Name -> password. Without users everybody may do everything."""
    access: str = ""
    """An access list, as acl_file has it."""
    tls: BrokerTls | None = None
    is_persistent: bool = False
    """Whether retained messages survive a restart."""
    more: tuple[str, ...] = ()
    """Further lines of mosquitto.conf: `max_keepalive 5`."""


class Mosquitto:
    """A broker that can be stopped, killed, frozen and started again, on the same port."""

    def __init__(self, folder: Path, options: BrokerOptions | None = None, port: int = 0) -> None:
        program = shutil.which("mosquitto", path=_ELSEWHERE)
        if program is None:
            pytest.skip("mosquitto is not installed")
        self.host = HOST
        self.port = port or free_port()
        self.options = options or BrokerOptions()
        self._program = program
        self._folder = folder
        self._runs = 0
        self.process: Process
        folder.mkdir(parents=True, exist_ok=True)
        self._configuration = folder / "mosquitto.conf"
        self._configuration.write_text("\n".join(self._lines()) + "\n")
        self.start()

    def start(self) -> None:
        """Start it, and wait until it serves."""
        self._runs += 1
        log = self._folder / f"mosquitto-{self._runs}.log"
        self.process = Process([self._program, "-c", str(self._configuration)], log)
        wait_for(self._serves, f"mosquitto on {self.host}:{self.port}: {log.read_text()}")

    def stop(self) -> None:
        """End it as a service manager does: it saves what it has to."""
        self.process.signal(signal.SIGTERM)
        self.process.wait()
        self.process.kill()

    def kill(self) -> None:
        """End it without giving it a chance."""
        self.process.kill()

    def freeze(self) -> None:
        """It is there and does nothing (SIGSTOP)."""
        self.process.signal(signal.SIGSTOP)

    def thaw(self) -> None:
        """It goes on."""
        self.process.signal(signal.SIGCONT)

    def text(self) -> str:
        """What it has logged since its start, every packet included."""
        return self.process.text()

    def wait_for_line(self, *parts: str, count: int = 1) -> str:
        """The `count`-th line of its log that contains all parts."""
        return self.process.wait_for_line(*parts, count=count)

    def _serves(self) -> bool:
        assert self.process.running, self.text()
        with socket.socket() as probe:
            return probe.connect_ex((self.host, self.port)) == 0

    def _lines(self) -> Iterator[str]:
        options = self.options
        yield "per_listener_settings false"
        yield f"listener {self.port} {self.host}"
        yield f"allow_anonymous {str(not options.users).lower()}"
        yield "log_dest stderr"
        yield "log_type all"
        if os.geteuid() == 0:
            # Otherwise it becomes a user who may not enter the folders of pytest.
            yield "user root"
        if options.users:
            yield f"password_file {self._passwords()}"
        if options.access:
            path = self._folder / "access"
            path.write_text(options.access)
            yield f"acl_file {path}"
        if options.tls is not None:
            yield f"cafile {options.tls.authority}"
            yield f"certfile {options.tls.certificate}"
            yield f"keyfile {options.tls.key}"
            yield f"require_certificate {str(options.tls.asks_for_certificate).lower()}"
            yield f"use_identity_as_username {str(options.tls.asks_for_certificate).lower()}"
        if options.is_persistent:
            yield "persistence true"
            yield f"persistence_location {self._folder}/"
        yield from options.more

    def _passwords(self) -> Path:
        """A password file, hashed by mosquitto's own tool."""
        path = self._folder / "passwords"
        path.write_text("".join(f"{name}:{password}\n" for name, password in self.options.users.items()))
        path.chmod(0o600)
        subprocess.run(["mosquitto_passwd", "-U", path], check=True, capture_output=True)
        return path


@contextmanager
def mosquitto(folder: Path, options: BrokerOptions | None = None, port: int = 0) -> Iterator[Mosquitto]:
    """A broker for as long as the block lasts."""
    broker = Mosquitto(folder, options, port)
    try:
        yield broker
    finally:
        broker.kill()


def certificates(folder: Path, *, asks_for_certificate: bool = False, client: str = "gatewayd") -> BrokerTls:
    """An authority, a server for `HOST` and a client of this name, by openssl; skips where it is missing."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed")
    folder.mkdir(parents=True, exist_ok=True)
    authority, authority_key = folder / "ca.pem", folder / "ca.key"
    subject = ["-subj", "/CN=test authority"]
    _openssl("req", "-x509", *_NEW_KEY, "-keyout", authority_key, "-out", authority, "-days", "2", *subject)
    made: list[Path] = []
    for name, extension in (("server", f"subjectAltName=IP:{HOST}"), (client, "extendedKeyUsage=clientAuth")):
        key, request, certificate = (folder / f"{name}.{end}" for end in ("key", "csr", "pem"))
        _openssl("req", "-new", *_NEW_KEY, "-keyout", key, "-out", request, "-subj", f"/CN={name}")
        extensions = folder / f"{name}.ext"
        extensions.write_text(extension)
        signer = ("-CA", authority, "-CAkey", authority_key, "-CAcreateserial", "-days", "2")
        _openssl("x509", "-req", "-in", request, "-out", certificate, "-extfile", extensions, *signer)
        made += [certificate, key]
    certificate, key, client_certificate, client_key = made
    return BrokerTls(authority, certificate, key, client_certificate, client_key, asks_for_certificate)


_NEW_KEY = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes")


def _openssl(*arguments: str | Path) -> None:
    subprocess.run(["openssl", *arguments], check=True, capture_output=True)
