"""The environment that the package makes on the machine, here of made-up wheels; and the command in front of it."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.packaging.programs import PACKAGING

PYTHON = f"{sys.version_info.major}.{sys.version_info.minor}"


class Machine:
    """What lies in /usr/lib/gatewayd of a machine, below another root."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.home = root / "usr/lib/gatewayd"
        (self.home / "wheels").mkdir(parents=True)

    def carry(self, says: str, python: str = PYTHON) -> Path:
        """Bring one wheel, whose program prints `says`."""
        for old in (self.home / "wheels").iterdir():
            old.unlink()
        wheel = self.home / "wheels/gatewayd-0-py3-none-any.whl"
        with zipfile.ZipFile(wheel, "w") as archive:
            archive.writestr("gatewayd/__init__.py", "")
            archive.writestr("gatewayd/__main__.py", f"def main() -> None: print({says!r})\n")
        digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
        (self.home / f"wheels/{python}.sha256").write_text(f"{digest}  {wheel.name}\n")
        return wheel

    def make(self, *options: str) -> subprocess.CompletedProcess[str]:
        program = str(PACKAGING / "environment.py")
        command = [sys.executable, "-I", program, "--root", str(self.root), *options]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    def made(self) -> str:
        """Make it; its name."""
        done = self.make()
        assert (done.returncode, done.stderr) == (0, "")
        return self.current()

    def current(self) -> str:
        return (self.home / "env").readlink().name

    def environments(self) -> set[str]:
        return {path.name for path in self.home.glob("env-*")}

    def run(self, *command: str) -> subprocess.CompletedProcess[str]:
        """Run the environment's Python, isolated as the command does it."""
        python = self.home / "env/bin/python3"
        return subprocess.run([python, "-I", *command], capture_output=True, text=True, check=False)

    def launch(self) -> subprocess.CompletedProcess[str]:
        """Run packaging/gatewayd as if this root were /."""
        text = (PACKAGING / "gatewayd").read_text()
        assert text.count("home=/usr/lib/gatewayd\n") == 1
        script = text.replace("home=/usr/lib/gatewayd\n", f"home={self.home}\n")
        return subprocess.run(
            ["/bin/sh", "-c", script, "gatewayd"], capture_output=True, text=True, check=False
        )


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_it_is_made_of_the_wheels_and_the_standard_library(machine: Machine) -> None:
    machine.carry("one")
    assert machine.made().startswith(f"env-{PYTHON}-")
    assert machine.run("-c", "from gatewayd.__main__ import main; main()").stdout == "one\n"
    assert machine.run("-c", "import pytest").returncode != 0, "nothing of the Python that made it"
    paths = machine.run("-c", "import sys; print(*sys.path, sep='\\n')").stdout.splitlines()
    assert [path for path in paths if "site-packages" in path or "dist-packages" in path] == [
        str(machine.home / f"env/lib/python{PYTHON}/site-packages")
    ]


def test_its_interpreter_is_a_version_and_no_name_that_moves(machine: Machine) -> None:
    machine.carry("one")
    machine.made()
    assert not (machine.home / "env/bin/python3").readlink().is_symlink()


def test_its_modules_are_compiled_and_valid_by_content(machine: Machine) -> None:
    """Bit 0 of the flags: by content; bit 1 clear: without looking at the source (PEP 552)."""
    machine.carry("one")
    machine.made()
    compiled = list(machine.home.glob("env/lib/*/site-packages/gatewayd/__pycache__/*.pyc"))
    assert len(compiled) == 2
    assert {path.read_bytes()[4] for path in compiled} == {1}
    assert not [path for path in compiled if str(machine.root).encode() in path.read_bytes()]


def test_it_has_no_tool_to_change_itself_with(machine: Machine) -> None:
    machine.carry("one")
    machine.made()
    assert {path.name for path in (machine.home / "env/bin").iterdir()} == {"python3", "gatewayd"}


def test_a_second_call_changes_nothing(machine: Machine) -> None:
    machine.carry("one")
    before = machine.home / machine.made()
    inode = before.stat().st_ino
    assert machine.made() == before.name
    assert before.stat().st_ino == inode


def test_other_wheels_are_another_environment_and_the_old_one_waits(machine: Machine) -> None:
    """A process that runs in the old one may still import from it."""
    machine.carry("one")
    old = machine.made()
    machine.carry("two")
    new = machine.made()
    assert machine.environments() == {old, new}
    assert machine.run("-m", "gatewayd").returncode == 0
    assert machine.make("--clean").returncode == 0
    assert machine.environments() == {new}


def test_cleaning_leaves_what_a_process_uses(machine: Machine) -> None:
    machine.carry("one")
    old = machine.made()
    program = "import sys; print('here', flush=True); sys.stdin.read()"
    command = [str(machine.home / old / "bin/python3"), "-I", "-c", program]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        machine.carry("two")
        new = machine.made()
        machine.make("--clean")
        assert machine.environments() == {old, new}
        process.communicate()
    machine.make("--clean")
    assert machine.environments() == {new}


def test_a_damaged_wheel_is_named_and_the_environment_in_use_stays(machine: Machine) -> None:
    machine.carry("one")
    old = machine.made()
    wheel = machine.carry("two")
    wheel.write_bytes(wheel.read_bytes() + b"x")
    done = machine.make()
    assert done.returncode == 1
    assert f"{wheel} is damaged" in done.stderr
    assert machine.current() == old
    assert machine.run("-c", "import gatewayd").returncode == 0


def test_half_an_environment_is_none(machine: Machine) -> None:
    """What a power cut left is made again."""
    machine.carry("one")
    name = machine.made()
    half = (machine.home / name).rename(machine.home / f"{name}.new")
    (half / "pyvenv.cfg").write_text("nonsense")
    assert machine.launch().returncode == 69
    assert machine.made() == name
    assert machine.run("-c", "import gatewayd").returncode == 0
    machine.make("--clean")
    assert machine.environments() == {name}


def test_a_python_without_wheels_is_said(machine: Machine) -> None:
    machine.carry("one", python="3.9")
    done = machine.make()
    assert done.returncode == 1
    assert f"no wheels for this system's Python {PYTHON}, but for: 3.9" in done.stderr
    assert machine.environments() == set()


def test_the_command_runs_the_environment(machine: Machine) -> None:
    machine.carry("one")
    name = machine.made()
    command = machine.home / name / "bin/gatewayd"
    # Its first line names the environment below /; here that is another root.
    command.write_text(command.read_text().replace("#!/usr", f"#!{machine.root}/usr"))
    done = machine.launch()
    assert (done.returncode, done.stdout) == (0, "one\n")


@pytest.mark.parametrize("gone", ["interpreter", "environment"])
def test_the_command_says_what_to_do_when_its_python_is_gone(machine: Machine, gone: str) -> None:
    """As between the removal of an old Python and dpkg's trigger; not 1 or 2, so the service tries again."""
    machine.carry("one")
    machine.made()
    python = machine.home / "env/bin/python3"
    if gone == "interpreter":
        python.unlink()
        python.symlink_to("/usr/bin/python3.0")
    else:
        (machine.home / "env").unlink()
    done = machine.launch()
    assert done.returncode == 69
    assert done.stderr.strip().endswith(f"as root: {machine.home}/make-environment")
    assert len(done.stderr.splitlines()) == 1
