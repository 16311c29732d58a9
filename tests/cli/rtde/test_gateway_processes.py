"""Gateways in a /proc of the test's own, and in the real one."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from gatewayd.cli.rtde.gateway_processes import GatewayProcess, gateway_processes, is_gateway, listener

UNIX = """\
Num       RefCount Protocol Flags    Type St Inode Path
00000000d0e3c81f: 00000003 00000000 00000000 0001 03 100 /run/connected.sock
00000000d0e3c820: 00000002 00000000 00010000 0001 01 101 /run/a place/control.sock
00000000d0e3c821: 00000002 00000000 00010000 0001 01 102 press.sock
00000000d0e3c822: 00000002 00000000 00010000 0001 01 103 @abstract
00000000d0e3c823: 00000002 00000000 00010000 0001 01 104
"""

Process = Callable[..., Path]


@pytest.fixture
def process(tmp_path: Path) -> Process:
    """A process of the /proc in `tmp_path`, with the inodes of its sockets."""

    def make(
        pid: int, *command: str, inodes: tuple[int, ...] = (), root: str = "/", cwd: str = "/srv"
    ) -> Path:
        directory = tmp_path / str(pid)
        (directory / "fd").mkdir(parents=True)
        (directory / "net").mkdir()
        (directory / "net" / "unix").write_text(UNIX)
        (directory / "cmdline").write_bytes("\0".join((*command, "")).encode())
        for number, inode in enumerate(inodes):
            (directory / "fd" / str(number)).symlink_to(f"socket:[{inode}]")
        (directory / "root").symlink_to(root)
        (directory / "cwd").symlink_to(cwd)
        return directory

    return make


@pytest.mark.parametrize(
    "command, expected",
    [
        (("/usr/bin/gatewayd", "run", "press.yaml"), True),
        (("python3", "-m", "gatewayd", "run"), True),
        (("/usr/bin/python3", "/usr/bin/gatewayd", "demo"), True),
        (("gatewayd", "check", "run"), False),
        (("vi", "gatewayd/run"), False),
        (("",), False),
    ],
)
def test_a_command_line_shows_a_gateway(command: tuple[str, ...], expected: bool) -> None:
    assert is_gateway(command) == expected


def test_sockets_and_files_are_found(process: Process, tmp_path: Path) -> None:
    process(11, "gatewayd", "run", "--log-level", "debug", "press.yaml", "/etc/cells", inodes=(100, 101, 102))
    process(12, "gatewayd", "demo", inodes=(101,))
    process(13, "bash", inodes=(101,))
    assert list(gateway_processes(tmp_path)) == [
        GatewayProcess(
            11,
            (Path("/run/a place/control.sock"), Path("/srv/press.sock")),
            (Path("/srv/press.yaml"), Path("/etc/cells")),
        )
    ]


def test_a_named_socket_is_taken_and_none_is_none(process: Process, tmp_path: Path) -> None:
    process(11, "gatewayd", "run", "a.yaml", "--control", "/run/a.sock")
    process(12, "gatewayd", "run", "a.yaml", "--control=none")
    assert {each.pid: each.sockets for each in gateway_processes(tmp_path)} == {
        11: (Path("/run/a.sock"),),
        12: (),
    }


def test_paths_in_a_container_lie_below_its_root(process: Process, tmp_path: Path) -> None:
    inside = process(11, "gatewayd", "run", "a.yaml", inodes=(101,), root="/var/containers/7")
    (found,) = gateway_processes(tmp_path)
    assert found.sockets == (inside / "root/run/a place/control.sock",)
    assert found.files == (inside / "root/srv/a.yaml",)


def test_of_another_user_only_the_command_line_can_be_seen(process: Process, tmp_path: Path) -> None:
    for pid, file in ((11, "a.yaml"), (12, "/etc/a.yaml")):
        directory = process(pid, "gatewayd", "run", file, "--control", "x.sock", inodes=(101,))
        for link in ("root", "cwd"):
            (directory / link).unlink()
    found = {each.pid: each for each in gateway_processes(tmp_path)}
    assert (found[11].files, found[12].files) == (None, (Path("/etc/a.yaml"),))
    assert found[11].sockets == (Path("/run/a place/control.sock"),), "a relative one is nowhere"


def test_what_is_no_process_any_more_is_passed_over(tmp_path: Path) -> None:
    (tmp_path / "11").mkdir()
    assert list(gateway_processes(tmp_path)) == []


def test_the_process_that_listens_is_known(tmp_path: Path) -> None:
    path = tmp_path / "x.sock"
    assert listener(path) == 0
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(path))
        listening.listen()
        assert listener(path) == os.getpid()
    assert listener(path) == 0


def test_the_real_proc_can_be_read(tmp_path: Path) -> None:
    """A process whose command line is a gateway's, and that listens somewhere."""
    (tmp_path / "gatewayd").write_text(
        "import socket, sys\ns = socket.socket(socket.AF_UNIX)\ns.bind('x.sock')\ns.listen()\n"
        "print(flush=True)\nsys.stdin.read()\n"
    )
    with subprocess.Popen(
        [sys.executable, "gatewayd", "run", "a.yaml"],
        cwd=tmp_path,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as running:
        assert running.stdout is not None
        running.stdout.readline()
        found = next(each for each in gateway_processes() if each.pid == running.pid)
        assert found == GatewayProcess(running.pid, (tmp_path / "x.sock",), (tmp_path / "a.yaml",))
        assert listener(tmp_path / "x.sock") == running.pid
        running.kill()
