"""What lies in the Debian package. What installing, upgrading and removing it does: test_boot.py."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from gatewayd import __version__

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def unpacked(package: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its files, somewhere."""
    target = tmp_path_factory.mktemp("unpacked")
    subprocess.run(["dpkg-deb", "--extract", package, target], check=True)
    return target


def field(package: Path, name: str) -> str:
    done = subprocess.run(["dpkg-deb", "--field", package, name], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_it_says_what_it_is_and_what_it_needs(package: Path) -> None:
    assert field(package, "Package") == "gatewayd"
    assert field(package, "Version") == __version__
    needs = field(package, "Depends")
    assert "python3 (>= 3." in needs
    assert "python3 (<< 3." in needs, "compiled modules serve one version of Python"
    assert "systemd" in needs


def test_everything_lies_where_debian_expects_it(unpacked: Path) -> None:
    expected = {
        "etc/default/gatewayd": "packaging/gatewayd.default",
        "usr/bin/gatewayd": "packaging/gatewayd",
        "usr/lib/systemd/system/gatewayd.service": "systemd/gatewayd.service",
        "usr/lib/systemd/system/gatewayd@.service": "systemd/gatewayd@.service",
        "usr/lib/sysusers.d/gatewayd.conf": "systemd/gatewayd.sysusers",
        "usr/lib/tmpfiles.d/gatewayd.conf": "systemd/gatewayd.tmpfiles",
        "usr/share/doc/gatewayd/copyright": "packaging/debian/copyright",
        "usr/share/doc/gatewayd/examples/addresses.conf": "systemd/examples/addresses.conf",
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
        and not path.is_relative_to(unpacked / "usr/lib/gatewayd")
        and not path.is_relative_to(unpacked / "usr/share/doc/gatewayd")
        and str(path.relative_to(unpacked)) not in expected
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


def test_it_runs_on_the_systems_python_alone(unpacked: Path) -> None:
    """Not with what the builder had: nothing of the environment counts."""
    python = unpacked / "usr/lib/gatewayd/bin/python3"
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


def test_it_is_compiled_because_the_service_cannot_write(unpacked: Path) -> None:
    (site,) = (unpacked / "usr/lib/gatewayd/lib").glob("python3*/site-packages")
    sources = list((site / "gatewayd").rglob("*.py"))
    compiled = list((site / "gatewayd").rglob("__pycache__/*.pyc"))
    assert len(sources) == len(compiled) > 50
    # Bit 0 of the flags: valid by content, bit 1 clear: without looking at the source (PEP 552).
    assert {path.read_bytes()[4] for path in compiled} == {1}


def test_it_names_no_place_of_its_making(unpacked: Path) -> None:
    """Neither the directory it was built in, nor this tree."""
    for path in unpacked.rglob("*"):
        if path.is_file() and not path.is_symlink():
            content = path.read_bytes()
            assert b"/tmp/tmp." not in content, path
            assert bytes(ROOT) + b"/" not in content, path


def test_it_has_no_tool_to_change_itself_with(unpacked: Path) -> None:
    (site,) = (unpacked / "usr/lib/gatewayd/lib").glob("python3*/site-packages")
    assert not [name for name in ("pip", "setuptools", "flit_core") if (site / name).exists()]
    names = {path.name for path in (unpacked / "usr/lib/gatewayd/bin").iterdir()}
    assert all(name.startswith("python") for name in names)
