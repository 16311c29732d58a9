"""A certification authority for tests, by OpenSSL's command: keys and certificates as a plant would make them."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

OPENSSL = shutil.which("openssl")
_NEW_KEY = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")


@dataclass(frozen=True, slots=True)
class Authority:
    """Issues certificates into a directory, ten milliseconds each."""

    directory: Path
    name: str = "authority"

    @property
    def certificate(self) -> Path:
        """Its own, self-signed."""
        path = self.directory / f"{self.name}.pem"
        if not path.exists():
            key = str(path.with_suffix(".key"))
            subject = ("-subj", f"/CN={self.name}", "-days", "3650")
            _openssl("req", "-x509", *_NEW_KEY, "-keyout", key, *subject, "-out", str(path))
        return path

    def issue(self, name: str, *extensions: str, days: int = 90) -> tuple[Path, Path]:
        """Certificate and key for `CN=name`, with extensions as of `openssl req -addext`."""
        certificate, key = self.directory / f"{name}.pem", self.directory / f"{name}.key"
        request = self.directory / f"{name}.csr"
        further = [word for extension in extensions for word in ("-addext", extension)]
        names = ("-subj", f"/O=Plant/CN={name}", *further)
        _openssl("req", "-new", *_NEW_KEY, "-keyout", str(key), *names, "-out", str(request))
        issuer = ("-CA", str(self.certificate), "-CAkey", str(self.certificate.with_suffix(".key")))
        kept = ("-days", str(days), "-copy_extensions", "copy")
        _openssl("x509", "-req", "-in", str(request), *issuer, *kept, "-out", str(certificate))
        return certificate, key


def _openssl(*arguments: str) -> None:
    assert OPENSSL is not None
    subprocess.run([OPENSSL, *arguments], check=True, capture_output=True)
