"""The sample for nftables, in a network of its own: of a robot the service reaches port 30004, others reach all."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SAMPLE = Path(__file__).parents[2] / "systemd/examples/robot-30004.nft"
SERVICE = 64_999
"""A user id that nobody here has."""

PROBE = """\
import errno, json, os, socket, sys
ROBOT, OTHER = "127.0.0.2", "127.0.0.3"
listening = [socket.create_server((host, port)) for host in (ROBOT, OTHER) for port in (30004, 29999, 22)]
def attempt(host, port):
    try:
        socket.create_connection((host, port), timeout=3).close()
    except OSError as error:
        return errno.errorcode.get(error.errno, type(error).__name__)
    return "open"
def attempts():
    return {f"{name} {port}": attempt(host, port) for name, host in (("robot", ROBOT), ("other", OTHER))
            for port in (30004, 29999, 22)}
as_root = attempts()
os.setuid(int(sys.argv[1]))
print(json.dumps({"root": as_root, "service": attempts()}))
"""


def missing() -> str:
    """Why it cannot be tried; empty if it can."""
    if os.geteuid() != 0:
        return "only root has networks of its own"
    for program, package in (("nft", "nftables"), ("ip", "iproute2"), ("unshare", "util-linux")):
        if shutil.which(program, path="/usr/sbin:/usr/bin:/sbin:/bin") is None:
            return f"{program} is missing (apt-get install {package})"
    tried = subprocess.run(["unshare", "--net", "nft", "list", "ruleset"], capture_output=True, check=False)
    return "" if tried.returncode == 0 else "this kernel has no nf_tables, or lets nobody use it"


@pytest.mark.skipif(bool(missing()), reason=missing())
def test_the_service_reaches_nothing_of_a_robot_but_rtde(tmp_path: Path) -> None:
    rules = SAMPLE.read_text().replace("elements = { 192.0.2.10 }", "elements = { 127.0.0.2 }")
    rules = rules.replace("meta skuid != gatewayd", f"meta skuid != {SERVICE}")
    (tmp_path / "rules.nft").write_text(rules)
    (tmp_path / "probe.py").write_text(PROBE)
    # Loaded twice, as a machine does it that reads its rules again.
    script = 'ip link set lo up; nft -f "$1"; nft -f "$1"; exec "$2" -I "$3" "$4"'
    arguments = [str(tmp_path / "rules.nft"), sys.executable, str(tmp_path / "probe.py"), str(SERVICE)]
    done = subprocess.run(
        ["unshare", "--net", "sh", "-ec", script, "-", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    assert set(seen["root"].values()) == {"open"}, "no other program is disturbed"
    robot = {name: how for name, how in seen["service"].items() if name.startswith("robot")}
    assert robot == {"robot 30004": "open", "robot 29999": "EHOSTUNREACH", "robot 22": "EHOSTUNREACH"}
    assert {how for name, how in seen["service"].items() if name.startswith("other")} == {"open"}


def test_it_names_the_user_of_the_service() -> None:
    (user,) = re.findall(r"meta skuid != (\S+) accept", SAMPLE.read_text())
    assert f"u {user} -" in (SAMPLE.parents[1] / "gatewayd.sysusers").read_text()
