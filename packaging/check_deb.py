"""Unpack packages, of whatever architecture, and check that all is there for each Python they are for.

`python packaging/check_deb.py PACKAGE.deb...`: every wheel has its locked hash and serves that architecture and Python,
every compiled module in it is one of that machine. Prints one line for each; exit code 1 with what is wrong.
"""

from __future__ import annotations

import hashlib
import re
import struct
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

TREE = Path(__file__).resolve().parent.parent
MACHINES = {"amd64": ("x86_64", 2, 62), "arm64": ("aarch64", 2, 183), "armhf": ("armv7l", 1, 40)}
"""Architecture -> its name in wheels, and class and machine in the head of an ELF file."""


def wrong_modules(wheel: Path, architecture: str, tag: str) -> Iterator[str]:
    """Compiled modules that this machine, or this Python, would not load."""
    _, bits, machine = MACHINES[architecture]
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            if not name.endswith(".so"):
                continue
            head = archive.open(name).read(20)
            if head[:4] != b"\x7fELF" or (head[4], struct.unpack_from("<H", head, 18)[0]) != (bits, machine):
                yield f"{wheel.name}: {name} is for another machine"
            if f".cpython-{tag}-" not in name:
                yield f"{wheel.name}: {name} is for another Python than {tag}"


def wrong_wheels(listing: Path, architecture: str, locked: str) -> Iterator[str]:
    """What is wrong with the wheels for one Python."""
    tag = listing.stem.replace(".", "")
    names = []
    for line in listing.read_text().splitlines():
        digest, file = line.split("  ")
        wheel = listing.with_name(file)
        name, _, python, abi, platform = file.removesuffix(".whl").split("-")
        names.append(name.replace("_", "-").lower())
        if hashlib.sha256(wheel.read_bytes()).hexdigest() != digest:
            yield f"{file} is damaged"
        if name != "gatewayd" and f"--hash=sha256:{digest}" not in locked:
            yield f"{file} is not locked"
        compiled = (python, abi) == (f"cp{tag}", f"cp{tag}") and platform.endswith(MACHINES[architecture][0])
        if not compiled and (python, abi, platform) != ("py3", "none", "any"):
            yield f"{file} is not for this architecture and Python {listing.stem}"
        yield from wrong_modules(wheel, architecture, tag)
    needed = set(re.findall(r"^([\w-]+)==", locked, re.MULTILINE)) - {"flit-core"} | {"gatewayd"}
    if sorted(names) != sorted(needed):
        yield f"{listing.stem}: not once each what is locked: {sorted(needed ^ set(names))}"


def check(package: Path) -> list[str]:
    """What is wrong with one package."""
    field = ["dpkg-deb", "--field", str(package), "Architecture"]
    architecture = subprocess.run(field, capture_output=True, text=True, check=True).stdout.strip()
    locked = (TREE / "requirements.lock").read_text()
    with tempfile.TemporaryDirectory() as directory:
        subprocess.run(["dpkg-deb", "--extract", str(package), directory], check=True)
        listings = sorted(Path(directory, "usr/lib/gatewayd/wheels").glob("*.sha256"))
        if not listings:
            return ["it has no wheels"]
        wrong = [text for listing in listings for text in wrong_wheels(listing, architecture, locked)]
    if not wrong:
        pythons = ", ".join(listing.stem for listing in listings)
        print(
            f"{package.name}: {package.stat().st_size / 1e6:.1f} MB, wheels for {architecture}, Python {pythons}"
        )
    return wrong


def main() -> int:
    """Do what the command line says."""
    wrong = [f"{package}: {text}" for package in sys.argv[1:] for text in check(Path(package))]
    print(*wrong, sep="\n", end="\n" if wrong else "", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
