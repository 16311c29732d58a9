"""A small authority for certificates with roles, by the program `openssl`; docs/howto/secure-modbus.md is by hand.

The program is another hand than the product's: what it writes into a certificate is judged by neither.
"""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

OPENSSL = shutil.which("openssl")
ROLE_OID = "1.3.6.1.4.1.50316.802.1"
_AUTHORITY = """\
[ca]
default_ca = here
[here]
database = {folder}/index.txt
new_certs_dir = {folder}
serial = {folder}/serial
crlnumber = {folder}/crlnumber
certificate = {folder}/authority.crt
private_key = {folder}/authority.key
default_md = sha256
default_days = 365
default_crl_days = 30
unique_subject = no
policy = any
[any]
commonName = supplied
[authority]
basicConstraints = critical, CA:TRUE
keyUsage = critical, keyCertSign, cRLSign
subjectKeyIdentifier = hash
"""


@dataclass(frozen=True, slots=True)
class Issued:
    """One certificate and its key."""

    certificate: Path
    """With that of its authority behind it."""
    key: Path


class Authority:
    """One authority, in a folder of its own."""

    def __init__(self, folder: Path, name: str = "Commissioning") -> None:
        folder.mkdir(parents=True)
        self.folder = folder
        self.certificate = folder / "authority.crt"
        self.revoked = folder / "revoked.crl"
        self._config = folder / "openssl.cnf"
        self._config.write_text(_AUTHORITY.format(folder=folder))
        (folder / "index.txt").touch()
        (folder / "serial").write_text("01\n" if name == "Commissioning" else "A1\n")
        (folder / "crlnumber").write_text("01\n")
        run("req", "-x509", "-config", self._config, "-extensions", "authority", *_KEY, "-days", "3650",
            "-subj", f"/CN={name}", "-keyout", folder / "authority.key", "-out", self.certificate)  # fmt: skip
        self.list_revoked()

    def issue(self, name: str, *extensions: str, ends: str | None = None, key: str = "rsa:2048") -> Issued:
        """A certificate; `ends` as openssl takes it: 20200101000000Z."""
        request, made, whole = (self.folder / f"{name}.{kind}" for kind in ("csr", "pem", "crt"))
        file = self.folder / f"{name}.ext"
        file.write_text("\n".join(("basicConstraints = CA:FALSE", *extensions)) + "\n")
        made_key = self.folder / f"{name}.key"
        how = (
            ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1") if key == "ec" else ("-newkey", key)
        )
        run(
            "req",
            "-config",
            self._config,
            *how,
            "-nodes",
            "-subj",
            f"/CN={name}",
            "-keyout",
            made_key,
            "-out",
            request,
        )
        made_key.chmod(0o640)
        dates = ("-startdate", "20150101000000Z", "-enddate", ends) if ends is not None else ()
        run(
            "ca",
            "-config",
            self._config,
            "-batch",
            "-notext",
            "-in",
            request,
            "-out",
            made,
            "-extfile",
            file,
            *dates,
        )
        whole.write_bytes(made.read_bytes() + self.certificate.read_bytes())
        return Issued(whole, made_key)

    def role(self, role: str, name: str | None = None, **others: str) -> Issued:
        """A certificate with a role."""
        return self.issue(name or role, f"{ROLE_OID} = ASN1:UTF8String:{role}", **others)

    def revoke(self, issued: Issued) -> None:
        """Withdraw it."""
        run("ca", "-config", self._config, "-revoke", issued.certificate)
        self.list_revoked()

    def list_revoked(self) -> None:
        """Write the list anew, whole or not at all."""
        new = self.revoked.with_suffix(".new")
        run("ca", "-config", self._config, "-gencrl", "-out", new)
        new.replace(self.revoked)


_KEY = ("-newkey", "rsa:2048", "-nodes")


def run(*arguments: object) -> str:
    """What the program says; fails with that where it fails."""
    assert OPENSSL is not None
    done = subprocess.run(
        [OPENSSL, *map(str, arguments)], capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL
    )
    assert done.returncode == 0, done.stderr
    return done.stdout
