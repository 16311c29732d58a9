"""The laboratory: namespaces, programs, faults and what they cost. Needs root, iproute2 and keepalived."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from gatewayd.control.client import Client, ControlError, NoDaemon
from tests.standby_lab.supervisor import WATCHDOG

ROOT = Path(__file__).parents[2]
VIRTUAL, ROBOT = "192.0.2.50", "198.51.100.10"
HOSTS = {"a": 11, "b": 12}
MAPPING = f"""\
gatewayd: 1
cell: press-3
robot: {{host: {ROBOT}, frequency: 125}}
modbus: {{listen: '0.0.0.0:1502', allow: 192.0.2.0/24}}
standby:
  peer: ['192.0.2.11:2930', '192.0.2.12:2930']
  address: {VIRTUAL}
  grace: 10s
writers:
  plc: {{modbus: 192.0.2.20, timeout: 5s}}
variables:
  part: {{robot: input_int_register_0, modbus: 10, owner: plc}}
  mode: {{robot: input_int_register_1, modbus: 12, owner: plc}}
  cycles: {{robot: output_int_register_0, modbus: 100}}
"""
PATIENCE = 40.0


def usable() -> bool:
    """Whether the laboratory can be had here."""
    if os.geteuid() != 0 or not all(map(shutil.which, ("ip", "keepalived", "flock"))):
        return False
    probe = f"gwprobe{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", probe], capture_output=True, check=False)
    subprocess.run(["ip", "netns", "del", probe], capture_output=True, check=False)
    return made.returncode == 0


def shell(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT)


class Lab:
    """Two gateways `a` and `b`, a robot that drops silent clients after `release` seconds, a PLC."""

    def __init__(self, directory: Path, release: float) -> None:
        self.directory = directory
        self.release = release
        self.prefix = f"gw{os.getpid()}"
        self.programs: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Self:
        try:
            self._wire()
            self._start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        for program in reversed(self.programs):
            program.kill()
            program.wait()
        for name in ("a", "b"):
            pid = self._pid(name)
            if pid:
                with suppress(OSError):
                    os.kill(pid, signal.SIGKILL)
        for space in ("switch", "robot", "plc", "a", "b"):
            subprocess.run(["ip", "netns", "del", self.space(space)], capture_output=True, check=False)

    def space(self, name: str) -> str:
        return f"{self.prefix}{name}"

    def ip(self, space: str, *command: str) -> None:
        shell("ip", "-n", self.space(space), *command)

    def run(self, space: str, *command: str, log: str) -> subprocess.Popen[bytes]:
        with (self.directory / log).open("ab") as stream:
            program = subprocess.Popen(
                ["ip", "netns", "exec", self.space(space), *command],
                stdout=stream,
                stderr=stream,
                cwd=ROOT,
            )
        self.programs.append(program)
        return program

    def _wire(self) -> None:
        for name in ("switch", "robot", "plc", "a", "b"):
            shell("ip", "netns", "add", self.space(name))
            self.ip(name, "link", "set", "lo", "up")
        for bridge in ("plant", "cell"):
            self.ip("switch", "link", "add", bridge, "type", "bridge")
            self.ip("switch", "link", "set", bridge, "up")
        self._cable("plc", "plant", "192.0.2.20")
        self._cable("robot", "cell", ROBOT)
        for name, number in HOSTS.items():
            self._cable(name, "plant", f"192.0.2.{number}")
            self._cable(name, "cell", f"198.51.100.{number}")

    def _cable(self, space: str, bridge: str, address: str) -> None:
        port = f"{space}-{bridge}"
        self.ip(
            "switch", "link", "add", port, "type", "veth", "peer", "name", bridge, "netns", self.space(space)
        )
        self.ip("switch", "link", "set", port, "master", bridge, "up")
        self.ip(space, "address", "add", f"{address}/24", "dev", bridge)
        self.ip(space, "link", "set", bridge, "up")

    def _start(self) -> None:
        python, mapping = sys.executable, self.directory / "press-3.yaml"
        mapping.write_text(MAPPING)
        self.run(
            "robot",
            python,
            "-m",
            "tests.standby_lab.robot",
            ROBOT,
            str(self.release),
            self.path("robot.jsonl"),
            log="robot.log",
        )
        self.run("plc", python, "-m", "tests.standby_lab.plc", VIRTUAL, self.path("plc.txt"), log="plc.log")
        example = (ROOT / "systemd/examples/keepalived.conf").read_text("ascii")
        script = ROOT / "systemd/examples/gatewayd-standby-alive"
        for name in HOSTS:
            (self.directory / name).mkdir()
            (self.directory / name / "standby-press-3").write_text("1\n")
            text = example.replace("interface eth0", "interface plant")
            text = text.replace("/run/gatewayd/", f"{self.directory}/{name}/")
            text = text.replace("/usr/local/lib/gatewayd/standby-alive", str(script))
            (self.directory / f"{name}.conf").write_text(text)
            self.run(
                name,
                python,
                "-m",
                "tests.standby_lab.supervisor",
                name,
                str(self.directory),
                str(mapping),
                log=f"{name}.out",
            )
            self.keepalived(name)

    def keepalived(self, name: str) -> None:
        pids = [f"--{kind}={self.path(f'{name}.{kind}')}" for kind in ("pid", "vrrp_pid")]
        self.run(
            name,
            "keepalived",
            "-n",
            "-l",
            "-P",
            *pids,
            "-f",
            self.path(f"{name}.conf"),
            log=f"{name}.keepalived.log",
        )

    def path(self, name: str) -> str:
        return str(self.directory / name)

    # -- what is seen ------------------------------------------------------------------------------------------------

    def _pid(self, name: str) -> int:
        try:
            return int((self.directory / name / "pid").read_text())
        except (OSError, ValueError):
            return 0

    def standby(self, name: str) -> dict[str, Any]:
        try:
            client = Client(self.directory / name / "control.sock")
            return dict(client.get("/v1/status")["cells"][0]["standby"])
        except (NoDaemon, ControlError, IndexError, KeyError):
            return {}

    def wait(self, condition: Callable[[], object], what: str, limit: float = PATIENCE) -> None:
        end = time.monotonic() + limit
        while not condition():
            if time.monotonic() > end:
                raise AssertionError(f"waited in vain for {what}: {[self.standby(name) for name in HOSTS]}")
            time.sleep(0.02)

    def active(self) -> str:
        """The one that serves, once it does, the other is ready, and the PLC's writes are accepted."""

        def found() -> list[str]:
            return [
                name
                for name in HOSTS
                if (seen := self.standby(name)).get("role") == "active" and seen.get("peer_ready")
            ]

        self.wait(found, "a pair", 60)
        since = time.monotonic()
        self.wait(lambda: self.accepted(since) is not None, "the PLC to be served")
        return found()[0]

    def accepted(self, since: float) -> float | None:
        """When the first write of the PLC after `since` was accepted."""
        try:
            lines = (self.directory / "plc.txt").read_text().splitlines()
        except OSError:
            return None
        times = (float(line.split()[0]) for line in lines[-400:] if len(line.split()) == 2)
        return next((at for at in times if at > since), None)

    # -- faults ------------------------------------------------------------------------------------------------------

    def link(self, name: str, bridge: str, *, up: bool) -> None:
        self.ip("switch", "link", "set", f"{name}-{bridge}", "up" if up else "down")

    def released(self, since: float) -> float:
        """When the robot gave the inputs free: it had dropped the client that wrote."""
        for line in (self.directory / "robot.jsonl").read_text().splitlines():
            when, what, *_ = json.loads(line)
            if what == "gone" and when > since:
                return float(when)
        return since

    def do(self, fault: str, name: str) -> Outcome:
        """Bring the fault about at gateway `name`, which serves, and wait until the PLC is served by the other one."""
        other = next(host for host in HOSTS if host != name)
        hold = self.directory / f"hold-{name}"
        pid, since = self._pid(name), time.monotonic()
        if fault == "crash":
            hold.touch()
            os.kill(pid, signal.SIGKILL)
        elif fault == "frozen":
            hold.touch()
            os.kill(pid, signal.SIGSTOP)
        elif fault == "power":
            hold.touch()
            for bridge in ("plant", "cell"):
                self.link(name, bridge, up=False)
            os.kill(pid, signal.SIGKILL)
        elif fault in {"cable_plant", "cable_robot"}:
            self.link(name, "plant" if fault == "cable_plant" else "cell", up=False)
        else:
            Client(self.directory / name / "control.sock").post("/v1/cells/press-3/hand-over", {})
        taken: list[float] = []

        def served() -> bool:
            if self.standby(other).get("role") != "active":
                return False
            # Writes that the former one still accepted do not count: the other has served since its role began.
            start = time.monotonic() - float(self.standby(other).get("since") or 0)
            at = self.accepted(start)
            if at is not None:
                taken.append(at - since)
            return bool(taken)

        try:
            self.wait(served, f"a takeover after {fault} at {name}")
        finally:
            for bridge in ("plant", "cell"):
                self.link(name, bridge, up=True)
            hold.unlink(missing_ok=True)
        return Outcome(fault, self.released(since) - since, taken[0], aim(fault, self.release))


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a fault cost, in seconds since it began."""

    fault: str
    released: float
    """Until the robot gave its inputs free."""
    served: float
    """Until the first write of the PLC was accepted by the other gateway."""
    aim: float
    """Until it has to be."""

    @property
    def kept(self) -> bool:
        return self.served <= self.aim

    def __str__(self) -> str:
        free, after = self.released * 1000, (self.served - self.released) * 1000
        verdict = "kept" if self.kept else "MISSED"
        return (
            f"{self.fault:12} inputs free after {free:6.0f} ms, served after {self.served * 1000:6.0f} ms "
            f"({after:4.0f} ms later); aim {self.aim * 1000:6.0f} ms: {verdict}"
        )


def aim(fault: str, release: float) -> float:
    """Seconds within which the PLC has to be served again, for a robot that drops a silent client after `release`."""
    return {
        "crash": 2.0,
        "frozen": WATCHDOG + 1.0,
        "power": release + 1.0,
        "cable_robot": release + 1.0,
        "cable_plant": 2.0,
        "switch": 0.5,
    }[fault]


FAULTS = ("crash", "frozen", "power", "cable_plant", "cable_robot", "switch")


def faults(count: int, seed: int) -> Sequence[str]:
    """So many faults: each kind as often as the others, in a random order."""
    chosen = [FAULTS[number % len(FAULTS)] for number in range(count)]
    random.Random(seed).shuffle(chosen)
    return chosen
