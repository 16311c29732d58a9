"""What a connection needs from files: read at each attempt, so that what was renewed counts from the next one on."""

from __future__ import annotations

import ssl
from dataclasses import dataclass
from pathlib import Path

from gatewayd.mqtt.messages import BrokerSettings, BrokerTlsFiles

MAX_PASSWORD = 4096
"""Bytes of a file that can be one."""


class CredentialsError(OSError):
    """A file cannot be read, or is not what it should be; the text says which and why."""


@dataclass(frozen=True, slots=True)
class BrokerCredentials:
    """Password and TLS of one attempt."""

    password: str | None = None
    tls: ssl.SSLContext | None = None


def read_credentials(settings: BrokerSettings) -> BrokerCredentials:
    """Read the files, which takes some ms: not for the loop. Raises CredentialsError."""
    password = _password(settings.password_file) if settings.password_file else None
    return BrokerCredentials(password, _context(settings.tls) if settings.tls is not None else None)


def needs_files(settings: BrokerSettings) -> bool:
    """Whether there is anything to read."""
    return bool(settings.password_file) or settings.tls is not None


def _password(path: str) -> str:
    """The first line: editors end files with a line break that is no part of it."""
    try:
        with Path(path).open("rb") as file:
            data = file.read(MAX_PASSWORD + 1)
    except OSError as error:
        raise CredentialsError(f"password_file {path}: {error.strerror}") from error
    if len(data) > MAX_PASSWORD:
        raise CredentialsError(f"password_file {path}: more than {MAX_PASSWORD} bytes")
    try:
        return data.decode("utf-8").split("\n", 1)[0].rstrip("\r")
    except UnicodeDecodeError as error:
        raise CredentialsError(f"password_file {path}: not UTF-8") from error


def _context(files: BrokerTlsFiles) -> ssl.SSLContext:
    try:
        context = ssl.create_default_context(cafile=files.ca or None)
    except (OSError, ssl.SSLError) as error:
        raise CredentialsError(f"tls: ca {files.ca}: {_reason(error)}") from error
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    if files.certificate:
        try:
            context.load_cert_chain(files.certificate, files.key or None, password=_no_password)
        except (OSError, ssl.SSLError) as error:
            where = " and ".join(filter(None, (files.certificate, files.key)))
            raise CredentialsError(f"tls: {where}: {_reason(error)}") from error
    return context


def _no_password() -> str:
    """Nobody is there who could type one: without this OpenSSL asks the terminal."""
    return ""


def _reason(error: OSError) -> str:
    if isinstance(error, ssl.SSLError):
        return (error.reason or "cannot be read").lower().replace("_", " ")
    return error.strerror or str(error)
