#!/usr/bin/python3 -I
"""Make the environment of gatewayd on this machine's Python, offline, from the wheels that lie beside this file.

Installed as /usr/lib/gatewayd/make-environment, and run as root: by the package when it is configured and when dpkg
says that the system's Python has changed, and by `make install`. The service cannot write here.

An environment is a directory of its own, env-VERSION-KEY, whose key covers everything that it is made of; the link
`env` names the one in use. So a second call finds its work done, a process that runs keeps what it has loaded and may
still load, and at no moment is there half an environment. Only the standard library is used: Debian's pip and venv are
packages that nothing else on the machine may need.

Exit code: 0 done or nothing to do; 1 with a reason on stderr.
"""

from __future__ import annotations

import argparse
import compileall
import hashlib
import importlib.util
import os
import py_compile
import shutil
import sys
import zipfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

HOME = "usr/lib/gatewayd"
LINK = "env"
UNCHECKED = py_compile.PycInvalidationMode.UNCHECKED_HASH
WHEELS = "wheels"
PYTHON = f"{sys.version_info.major}.{sys.version_info.minor}"
SITE = f"lib/python{PYTHON}/site-packages"

COMMAND = """\
#!/{environment}/bin/python3 -I
\"\"\"The command gatewayd. -I: no environment variable and no directory of a user decides what is imported.\"\"\"

from gatewayd.__main__ import main

main()
"""

SETTINGS = """\
home = {home}
include-system-site-packages = false
version = {version}
"""


class UnusableError(Exception):
    """Why there can be no environment."""


def carried(home: Path) -> dict[Path, str]:
    """The wheels for this Python -> their SHA-256."""
    listing = home / WHEELS / f"{PYTHON}.sha256"
    try:
        lines = listing.read_text().splitlines()
    except FileNotFoundError as error:
        others = sorted((path.stem for path in listing.parent.glob("*.sha256")), key=_number)
        known = ", ".join(others) or "none"
        raise UnusableError(f"no wheels for this system's Python {PYTHON}, but for: {known}") from error
    pairs = (line.split("  ", 1) for line in lines)
    return {listing.parent / name: digest for digest, name in pairs}


def _number(version: str) -> list[int]:
    return [int(part) for part in version.split(".")]


def key(wheels: dict[Path, str]) -> str:
    """What tells this environment from one of other wheels, another interpreter, or an older one of these programs."""
    parts = [
        *sorted(wheels.values()),
        Path(__file__).read_text(),
        interpreter(),
        importlib.util.MAGIC_NUMBER.hex(),
    ]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:12]


def interpreter() -> str:
    """The system's interpreter by its own name: `python3` may mean another one tomorrow."""
    return os.path.realpath(getattr(sys, "_base_executable", sys.executable))


def unpack(wheel: Path, digest: str, site: Path) -> None:
    """Unpack one wheel, if it is the one that was locked."""
    if hashlib.sha256(wheel.read_bytes()).hexdigest() != digest:
        raise UnusableError(f"{wheel} is damaged: install the package again")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)


def make(root: Path, target: Path, wheels: dict[Path, str]) -> None:
    """Make the environment `target`, which appears whole or not at all."""
    unfinished = target.with_name(target.name + ".new")
    shutil.rmtree(unfinished, ignore_errors=True)
    site = unfinished / SITE
    site.mkdir(parents=True)
    for wheel, digest in wheels.items():
        unpack(wheel, digest, site)
    final = target.relative_to(root)
    # Valid by content and never looked at again (PEP 552): the service cannot write, and no clock matters.
    old, new = str(unfinished), f"/{final}"
    if not compileall.compile_dir(site, quiet=1, invalidation_mode=UNCHECKED, stripdir=old, prependdir=new):
        raise UnusableError("a module of the package is no Python that this interpreter knows")
    (unfinished / "pyvenv.cfg").write_text(
        SETTINGS.format(home=Path(interpreter()).parent, version=sys.version.split()[0])
    )
    programs = unfinished / "bin"
    programs.mkdir()
    (programs / "python3").symlink_to(interpreter())
    command = programs / "gatewayd"
    command.write_text(COMMAND.format(environment=final))
    command.chmod(0o755)
    if root == Path("/"):
        # After a power cut a directory must not be there without what is in it.
        os.sync()
    unfinished.rename(target)


def use(target: Path) -> None:
    """Let the link name it, from one moment to the next."""
    new = target.with_name(LINK + ".new")
    new.unlink(missing_ok=True)
    new.symlink_to(target.name)
    new.replace(target.with_name(LINK))


def running() -> Iterator[str]:
    """The command lines of this machine's processes."""
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            yield path.read_bytes().decode(errors="replace")


def clean(home: Path) -> None:
    """Remove the environments that are neither named by the link nor used by a process."""
    lines = list(running())
    current = (home / LINK).resolve().name
    for path in home.glob("env-*"):
        if path.name != current and not any(f"/{HOME}/{path.name}/" in line for line in lines):
            shutil.rmtree(path)


def main() -> int:
    """Do what the command line says."""
    parser = argparse.ArgumentParser(description="Make the environment of gatewayd on this machine's Python.")
    parser.add_argument("--root", type=Path, default=Path("/"), help="the directory that will be / later")
    parser.add_argument(
        "--clean", action="store_true", help="instead, remove environments that nobody uses any more"
    )
    arguments = parser.parse_args()
    home = arguments.root.resolve() / HOME
    if arguments.clean:
        clean(home)
        return 0
    os.umask(0o022)
    try:
        wheels = carried(home)
        target = home / f"env-{PYTHON}-{key(wheels)}"
        if not target.exists():
            make(arguments.root.resolve(), target, wheels)
        use(target)
    except (UnusableError, OSError, zipfile.BadZipFile) as error:
        print(f"gatewayd: no environment: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
