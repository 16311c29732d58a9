"""A server's certificate and private key in files: read, judged, read again when they change, and how long they last.

Replacing them needs no restart, and never leaves a server without: what cannot be used is reported, and what was read
before goes on. How contexts are made, and for whom, is for those who serve.
"""

from __future__ import annotations

import os
import ssl
import stat
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gatewayd.machine.x509 import Certificate, CertificateError, chain_fault, from_pem

MAX_FILE = 256 * 1024
"""Bytes of a file with certificates or a key."""

_Signature = tuple[tuple[int, ...] | None, ...]


@dataclass(frozen=True, slots=True)
class CertificateFiles:
    """Where a server's certificate (followed by those of its issuers) and its private key are, as PEM."""

    certificate: Path
    key: Path

    def load(self, context: ssl.SSLContext) -> tuple[Certificate, ...]:
        """Have the context present them; the chain. Raises CertificateError, after which the context is of no use."""
        chain = read_certificates(self.certificate)
        _judge_key_file(self.key)
        fault = chain_fault(chain)
        if fault:
            raise CertificateError(f"{self.certificate}: {fault}")
        try:
            context.load_cert_chain(self.certificate, self.key, self._passphrase)
        except ssl.SSLError as error:
            raise CertificateError(self._reason(error)) from error
        except OSError as error:
            raise CertificateError(f"{self.key}: {error.strerror}") from error
        return chain

    def _passphrase(self) -> str:
        """Called for an encrypted key; without this OpenSSL would ask at the terminal, and wait."""
        raise CertificateError(
            f"{self.key}: the key is encrypted, and a service has nobody to ask for the passphrase; "
            f"decrypt it (openssl pkey -in {self.key} -out PLAIN) and let the file's permissions protect it"
        )

    def _reason(self, error: ssl.SSLError) -> str:
        reason = (error.reason or str(error)).replace("_", " ").lower()
        if error.reason == "KEY_VALUES_MISMATCH":
            return f"{self.key}: not the key of the certificate in {self.certificate}"
        if error.reason in {"EE_KEY_TOO_SMALL", "CA_MD_TOO_WEAK", "CA_KEY_TOO_SMALL"}:
            return f"{self.certificate}: OpenSSL refuses it: {reason}"
        return f"{self.key}: not a private key in PEM form: {reason}"


def read_certificates(path: Path) -> tuple[Certificate, ...]:
    """The certificates of a PEM file. Raises CertificateError, with the file's name."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise CertificateError(f"{path}: not a regular file")
        with path.open("rb") as stream:
            text = stream.read(MAX_FILE + 1)
    except OSError as error:
        raise CertificateError(f"{path}: {error.strerror}") from error
    if len(text) > MAX_FILE:
        raise CertificateError(f"{path}: more than {MAX_FILE // 1024} KiB")
    try:
        return from_pem(text)
    except CertificateError as error:
        raise CertificateError(f"{path}: {error}") from error


class ServerIdentity:
    """The TLS context of a server, made anew when its files change. It stays as it is while what they hold is faulty.

    `make` gives a context with everything but certificate and key; it may read the files in `further` (authorities,
    revocations) and raise CertificateError. `prove` says why nobody could use the context, empty: somebody can.
    `refresh` reads files: where a file system may hang, call it in a thread.
    """

    def __init__(
        self,
        files: CertificateFiles,
        make: Callable[[], ssl.SSLContext],
        further: Sequence[Path] = (),
        prove: Callable[[ssl.SSLContext], str] = lambda _context: "",
    ) -> None:
        self.files = files
        self.context: ssl.SSLContext | None = None
        """For new connections; None: there was never a usable certificate."""
        self.chain: tuple[Certificate, ...] = ()
        """What `context` presents, the server's own certificate first."""
        self.fault = ""
        """Why the files as they are now cannot be used; empty: they are what is in use."""
        self._make = make
        self._prove = prove
        self._watch = FileWatch((files.certificate, files.key, *further))

    def refresh(self) -> bool:
        """Read the files if they changed; whether there is another context. A fault is in `fault`."""
        if not self._watch.changed():
            return False
        try:
            context = self._make()
            chain = self.files.load(context)
        except CertificateError as error:
            self.fault = str(error)
            return False
        fault = self._prove(context)
        if fault:
            self.fault = f"{self.files.certificate}: {fault}"
            return False
        self.chain, self.context, self.fault = chain, context, ""
        return True

    def trouble(self, wall: float) -> str:
        """What has to be done about it at this time, in one line; empty: nothing."""
        if self.fault:
            return self.fault if self.context is None else f"{self.fault}; the former certificate is in use"
        ending = self.chain[0].trouble(wall) if self.chain else ""
        return ending and f"{self.files.certificate}: the certificate {ending}"


class FileWatch:
    """Notices by what the file system says of them that files were changed, replaced, or are gone. Reads none."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = tuple(paths)
        self._seen: _Signature | None = None

    def changed(self) -> bool:
        """Whether anything changed since the last call; the first time: yes."""
        found = tuple(map(signature_of, self._paths))
        former, self._seen = self._seen, found
        return found != former


def signature_of(path: Path) -> tuple[int, ...] | None:
    """What tells a file from a changed one; None: it cannot be looked at. A copy may keep its time, but not `ctime`."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_ctime_ns, found.st_size, found.st_ino, found.st_dev


def _judge_key_file(path: Path) -> None:
    """A private key that everybody on the machine can read is none."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        raise CertificateError(f"{path}: {error.strerror}") from error
    if not stat.S_ISREG(mode):
        raise CertificateError(f"{path}: not a regular file")
    if mode & (stat.S_IROTH | stat.S_IWOTH):
        raise CertificateError(f"{path}: others may read or change it; run: chmod o-rw {os.fspath(path)}")
