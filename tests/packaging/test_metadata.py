"""Wheel and sdist as a registry judges them. The judge of the largest one, twine, is asked by `make dist-check`."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from packaging.metadata import Metadata

from gatewayd import __version__
from tests.packaging.programs import ROOT


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `make dist` makes."""
    target = tmp_path_factory.mktemp("dist")
    build = "import sys, flit_core.buildapi as b; b.build_wheel(sys.argv[1]); b.build_sdist(sys.argv[1])"
    environment = os.environ | {"SOURCE_DATE_EPOCH": "1700000000"}
    subprocess.run(
        [sys.executable, "-c", build, target], check=True, capture_output=True, cwd=ROOT, env=environment
    )
    return target


@pytest.fixture(scope="module")
def sdist(dist: Path) -> set[str]:
    with tarfile.open(dist / f"gatewayd-{__version__}.tar.gz") as archive:
        return {name.partition("/")[2] for name in archive.getnames()}


def test_a_registry_takes_the_metadata(dist: Path) -> None:
    (wheel,) = dist.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        text = archive.read(f"gatewayd-{__version__}.dist-info/METADATA").decode()
    found = Metadata.from_email(text, validate=True)
    assert str(found.version) == __version__
    assert found.license_expression == "Apache-2.0"
    assert found.description_content_type is not None
    assert found.description_content_type.startswith("text/markdown")
    assert found.description is not None
    assert "one owner" in found.description
    assert found.project_urls
    assert found.maintainer_email
    assert not [line for line in found.classifiers or () if line.startswith("License ::")], (
        "PEP 639 has its field"
    )


def test_the_wheel_holds_the_program_and_its_license(dist: Path) -> None:
    (wheel,) = dist.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert f"gatewayd-{__version__}.dist-info/licenses/LICENSE" in names
    assert "gatewayd/py.typed" in names
    assert not [name for name in names if "__pycache__" in name or name.startswith("tests")]


def test_the_sdist_is_enough_to_test_and_to_package(sdist: set[str]) -> None:
    for path in (
        *("Makefile", "CHANGELOG.md", "SECURITY.md", "requirements.lock", "requirements-dev.lock"),
        *(
            "packaging/deb",
            "packaging/debian/control",
            "systemd/gatewayd.service",
            "mappings/small-cell.yaml",
        ),
        *("docs/README.md", "tests/packaging/test_metadata.py", "tests/golden/contracts/commands.json"),
    ):
        assert path in sdist, path


def test_the_sdist_holds_nothing_of_this_machine(sdist: set[str]) -> None:
    assert not [path for path in sdist if re.search(r"__pycache__|\.pyc$|(^|/)\.venv|^dist/", path)]
