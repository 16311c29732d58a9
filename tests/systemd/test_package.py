"""What lies in the Debian package. What installing, upgrading and removing it does: test_boot.py."""

from __future__ import annotations

import gzip
import re
import shutil
import subprocess
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from gatewayd import __version__

ROOT = Path(__file__).parents[2]
MADE = (
    "usr/share/bash-completion/completions/gatewayd",
    "usr/share/fish/vendor_completions.d/gatewayd.fish",
    "usr/share/lintian/overrides/gatewayd",
    "usr/share/man/man1/gatewayd.1.gz",
    "usr/share/zsh/vendor-completions/_gatewayd",
)
"""What has no source of the same content in this tree."""


@pytest.fixture(scope="module")
def unpacked(package: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its files, somewhere."""
    target = tmp_path_factory.mktemp("unpacked")
    subprocess.run(["dpkg-deb", "--extract", package, target], check=True)
    return target


@pytest.fixture(scope="module")
def installed(unpacked: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same, with its environment, which the machine makes."""
    target = tmp_path_factory.mktemp("installed") / "root"
    shutil.copytree(unpacked, target, symlinks=True)
    make = [str(target / "usr/lib/gatewayd/make-environment"), "--root", str(target)]
    done = subprocess.run(make, capture_output=True, text=True, check=False, env={"PATH": "/nowhere"})
    assert (done.returncode, done.stderr) == (0, "")
    return target


def field(package: Path, name: str) -> str:
    done = subprocess.run(["dpkg-deb", "--field", package, name], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_it_says_what_it_is_and_what_it_needs(package: Path) -> None:
    assert field(package, "Package") == "gatewayd"
    assert field(package, "Version") == __version__
    needs = field(package, "Depends")
    assert "python3 (>= 3." in needs
    assert "python3 (<< 3." in needs, "there are wheels for some versions of Python"
    assert "libc6 (>= 2." in needs
    assert "systemd" in needs
    assert re.fullmatch(r".+ <\S+@\S+\.\S+>", field(package, "Maintainer"))


def test_everything_lies_where_debian_expects_it(unpacked: Path) -> None:
    expected = {
        "etc/default/gatewayd": "packaging/gatewayd.default",
        "usr/bin/gatewayd": "packaging/gatewayd",
        "usr/lib/systemd/system/gatewayd.service": "systemd/gatewayd.service",
        "usr/lib/systemd/system/gatewayd@.service": "systemd/gatewayd@.service",
        "usr/lib/sysusers.d/gatewayd.conf": "systemd/gatewayd.sysusers",
        "usr/lib/tmpfiles.d/gatewayd.conf": "systemd/gatewayd.tmpfiles",
        "usr/share/doc/gatewayd/copyright": "packaging/debian/copyright",
        "usr/lib/gatewayd/make-environment": "packaging/environment.py",
        "usr/share/doc/gatewayd/SECURITY.md": "SECURITY.md",
        "usr/share/doc/gatewayd/examples/addresses.conf": "systemd/examples/addresses.conf",
        "usr/share/doc/gatewayd/examples/robot-30004.nft": "systemd/examples/robot-30004.nft",
        "usr/share/doc/gatewayd/examples/can0.network": "systemd/can0.network",
        "usr/share/doc/gatewayd/examples/small-cell.yaml": "mappings/small-cell.yaml",
        "usr/share/doc/gatewayd/howto/install.md": "docs/howto/install.md",
    }
    for target, source in expected.items():
        assert (unpacked / target).read_text() == (ROOT / source).read_text(), target
    strangers = [
        path
        for path in unpacked.rglob("*")
        if not path.is_dir()
        and not path.is_relative_to(unpacked / "usr/lib/gatewayd/wheels")
        and not path.is_relative_to(unpacked / "usr/share/doc/gatewayd")
        and str(path.relative_to(unpacked)) not in (*expected, *MADE)
    ]
    assert strangers == []


def test_no_mapping_is_installed(unpacked: Path) -> None:
    """The service serves what is in /etc/gatewayd, so nothing may be there that nobody asked for."""
    assert list((unpacked / "etc/gatewayd").iterdir()) == []


def test_a_setting_is_kept_by_dpkg(package: Path, tmp_path: Path) -> None:
    subprocess.run(["dpkg-deb", "--control", package, tmp_path], check=True)
    assert (tmp_path / "conffiles").read_text() == "/etc/default/gatewayd\n"


def test_nobody_but_root_can_change_it(package: Path) -> None:
    done = subprocess.run(["dpkg-deb", "--contents", package], capture_output=True, text=True, check=True)
    for line in done.stdout.splitlines():
        mode, owner, *_ = line.split()
        assert owner == "root/root", line
        assert mode.startswith("l") or (mode[5], mode[8]) == ("-", "-"), line
        assert "s" not in mode[1:], line


def test_it_runs_on_the_systems_python_alone(installed: Path) -> None:
    """Not with what the builder had: nothing of the environment counts."""
    python = installed / "usr/lib/gatewayd/env/bin/python3"
    assert python.resolve().is_relative_to("/usr/bin")
    for arguments, said in (
        (["--version"], f"gatewayd {__version__}"),
        (["check", str(ROOT / "mappings/small-cell.yaml")], "1 file checked"),
    ):
        done = subprocess.run(
            [python, "-I", "-m", "gatewayd", *arguments],
            capture_output=True,
            text=True,
            check=False,
            env={"PATH": "/nowhere"},
        )
        assert said in done.stdout, done.stderr


def test_it_is_compiled_because_the_service_cannot_write(installed: Path) -> None:
    (site,) = (installed / "usr/lib/gatewayd").glob("env/lib/python3*/site-packages")
    sources = list((site / "gatewayd").rglob("*.py"))
    compiled = list((site / "gatewayd").rglob("__pycache__/*.pyc"))
    assert len(sources) == len(compiled) > 50


def test_it_names_no_place_of_its_making(unpacked: Path) -> None:
    """Neither the directory it was built in, nor this tree."""
    for path in unpacked.rglob("*"):
        if path.is_file() and not path.is_symlink():
            for content in contents(path):
                assert b"/tmp/tmp." not in content, path
                assert bytes(ROOT) + b"/" not in content, path


def contents(path: Path) -> Iterator[bytes]:
    """Of a file; of our own wheel, of each of its files; of what is compressed, as it was before."""
    if path.suffix == ".gz":
        yield gzip.decompress(path.read_bytes())
    elif path.name.startswith("gatewayd-") and path.suffix == ".whl":
        with zipfile.ZipFile(path) as wheel:
            yield from map(wheel.read, wheel.namelist())
    else:
        yield path.read_bytes()


def test_it_carries_what_is_locked_and_nothing_that_builds(unpacked: Path) -> None:
    carried = unpacked / "usr/lib/gatewayd/wheels"
    (listing,) = carried.glob("*.sha256")
    locked = (ROOT / "requirements.lock").read_text()
    listed = {
        name: digest for digest, name in (line.split("  ") for line in listing.read_text().splitlines())
    }
    assert set(listed) == {path.name for path in carried.glob("*.whl")}
    foreign = {name: digest for name, digest in listed.items() if not name.startswith("gatewayd-")}
    assert all(f"--hash=sha256:{digest}" in locked for digest in foreign.values())
    assert len(foreign) == len(re.findall(r"^[\w-]+==", locked, re.MULTILINE)) - 1
    assert not [name for name in listed if name.startswith(("pip-", "setuptools-", "flit_core-"))]


def test_shells_complete_and_man_knows(unpacked: Path) -> None:
    bash = (unpacked / "usr/share/bash-completion/completions/gatewayd").read_text()
    assert "complete -o nosort -F _gatewayd_completion gatewayd" in bash
    assert (
        (unpacked / "usr/share/zsh/vendor-completions/_gatewayd").read_text().startswith("#compdef gatewayd")
    )
    assert "gatewayd" in (unpacked / "usr/share/fish/vendor_completions.d/gatewayd.fish").read_text()
    page = gzip.decompress((unpacked / "usr/share/man/man1/gatewayd.1.gz").read_bytes()).decode()
    assert ".SS run\n" in page


@pytest.mark.skipif(shutil.which("lintian") is None, reason="lintian is missing (apt-get install lintian)")
def test_lintian_finds_nothing(package: Path) -> None:
    done = subprocess.run(
        ["lintian", "--fail-on", "error,warning", "--allow-root", package],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout


def test_what_is_overridden_has_its_reason() -> None:
    lines = (ROOT / "packaging/debian/lintian-overrides").read_text().splitlines()
    for before, line in zip(["", *lines], lines, strict=False):
        assert line.startswith("#") or before.startswith("#"), line
