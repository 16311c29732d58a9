"""Collect what the package carries: the wheels of requirements.lock for one architecture and some versions of Python.

`python packaging/wheels.py DIRECTORY ARCHITECTURE VERSION...`, say `... /tmp/wheels arm64 3.11 3.12`, with a Python
that has pip, flit_core and network. Downloads only wheels, and only those whose SHA-256 the lock file has; builds the
wheel of this tree. Beside them comes a list for each Python, VERSION.sha256, in the form of sha256sum. Prints the least
glibc that all of them run on. Without arguments it prints the versions of Python that a package is for.
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path

TREE = Path(__file__).resolve().parent.parent
MACHINES = {"amd64": "x86_64", "arm64": "aarch64", "armhf": "armv7l"}
"""Debian's name of an architecture -> the one in the names of wheels."""
VERSIONS = ("3.11", "3.12", "3.13", "3.14")
"""CPython of Debian 12 and 13, Ubuntu 24.04 and 26.04."""
NEWEST_GLIBC = 36
"""Minor version of the glibc of Debian 12, the oldest system that has a Python of VERSIONS."""
_BUILD_ONLY = ("flit-core",)
_DOWNLOAD = (
    *("--quiet", "--disable-pip-version-check", "--no-input", "download"),
    *("--only-binary=:all:", "--no-deps", "--require-hashes"),
)


def requirements(lock: str) -> str:
    """The lock file without what only builds."""
    entries = re.split(r"\n(?=[^\s#])", lock)
    return "\n".join(entry for entry in entries if not entry.startswith(_BUILD_ONLY)) + "\n"


def platforms(architecture: str) -> list[str]:
    """The platform tags that a system with NEWEST_GLIBC takes, as pip wants to have them: each."""
    machine = MACHINES.get(architecture, architecture)
    return [
        f"manylinux2014_{machine}",
        *(f"manylinux_2_{minor}_{machine}" for minor in range(5, NEWEST_GLIBC + 1)),
    ]


def download(directory: Path, lock: Path, architecture: str, version: str) -> list[Path]:
    """The wheels for one Python, from the package index that this machine's pip is set up for."""
    target = directory / version
    chosen = [f"--platform={platform}" for platform in platforms(architecture)]
    chosen += [f"--python-version={version}", "--implementation=cp"]
    command = [sys.executable, "-m", "pip", *_DOWNLOAD, f"--requirement={lock}", f"--dest={target}", *chosen]
    subprocess.run(command, check=True, stdout=sys.stderr)
    return sorted(target.iterdir())


def build(directory: Path) -> Path:
    """The wheel of this tree; the same tree gives the same wheel if SOURCE_DATE_EPOCH is the same."""
    subprocess.run(
        [sys.executable, "-m", "flit_core.wheel", "--outdir", directory, TREE], check=True, stdout=sys.stderr
    )
    (wheel,) = directory.glob("gatewayd-*.whl")
    wheel.chmod(0o644)
    return wheel


def glibc(names: list[str]) -> int:
    """The minor version of the oldest glibc that all these wheels run on: the least of each wheel's tags counts."""
    least = [min(map(int, found)) for name in names if (found := re.findall(r"manylinux_2_(\d+)_", name))]
    return max(least, default=17)


def collect(directory: Path, architecture: str, versions: list[str]) -> list[str]:
    """Fill `directory`; returns the names of the wheels."""
    directory.mkdir(parents=True)
    lock = directory / "requirements.lock"
    lock.write_text(requirements((TREE / "requirements.lock").read_text()))
    ours = build(directory)
    for version in versions:
        fetched = download(directory, lock, architecture, version)
        found = [ours, *(wheel.replace(directory / wheel.name) for wheel in fetched)]
        (directory / version).rmdir()
        lines = [f"{hashlib.sha256(wheel.read_bytes()).hexdigest()}  {wheel.name}\n" for wheel in found]
        (directory / f"{version}.sha256").write_text("".join(lines))
    lock.unlink()
    return sorted(wheel.name for wheel in directory.glob("*.whl"))


def main() -> None:
    """Do what the command line says."""
    if not sys.argv[1:]:
        print(*VERSIONS)
        return
    directory, architecture, *versions = sys.argv[1:]
    os.umask(0o022)
    print(f"2.{glibc(collect(Path(directory), architecture, versions))}")


if __name__ == "__main__":
    main()
