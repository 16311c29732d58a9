"""Two gateways for one robot, as processes on one machine: the address that both listen on stands for the virtual one.

How the address itself moves, by keepalived between two machines, tests/standby_lab shows.
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from gatewayd.control.client import Client, ControlError, NoDaemon
from tests.e2e.plant import Plant
from tests.e2e.plc import PLC, Plc
from tests.e2e.processes import HOST, Daemon, Simulator, free_port, wait_for

START = 60.0
"""Seconds for three programs that start at one time: on a busy machine each of them waits for the others."""
TEXT = """\
standby: {{peer: '{host}:{there}', listen: '{host}:{here}', grace: {grace}}}
writers:
  plc: {{modbus: {plc}}}
variables:
  part: {{robot: input_int_register_0, modbus: 10, owner: plc}}
  mode: {{robot: input_int_register_1, modbus: 12, owner: plc, on_release: hold}}
  cycles: {{robot: output_int_register_2, modbus: 100}}
"""


class Gateways:
    """Two of them. `stop` of the plant ends them."""

    def __init__(self, plant: Plant, *, grace: str = "2s", options: tuple[str, ...] = ()) -> None:
        self.plant = plant
        self.robot: Simulator = plant.simulator("--program", "demo", *options)
        ports = free_port(), free_port()
        self.files = [
            self._file(name, here, there, grace)
            for name, (here, there) in zip("ab", (ports, ports[::-1]), strict=True)
        ]
        self.sockets = [plant.directory / f"{name}.sock" for name in "ab"]
        self.daemons: list[Daemon] = []
        for number in (0, 1):
            self.daemons.append(self.start(number))

    def _file(self, name: str, here: int, there: int, grace: str) -> Path:
        text = TEXT.format(host=HOST, plc=PLC, here=here, there=there, grace=grace)
        path = self.plant.mapping(text, self.robot.port, name="cell")
        return path.rename(path.with_name(f"{name}.yaml"))

    def start(self, number: int) -> Daemon:
        return self.plant.run(
            self.files[number],
            "--control",
            self.sockets[number],
            "--state",
            self.plant.directory / f"state-{number}",
        )

    def standby(self, number: int) -> dict[str, Any]:
        """What a gateway says of the pair; empty while it does not answer."""
        try:
            return dict(Client(self.sockets[number]).get("/v1/status")["cells"][0]["standby"])
        except (NoDaemon, ControlError):
            return {}

    def role(self, number: int) -> str:
        return str(self.standby(number).get("role", ""))

    def active(self) -> int:
        """Which of them serves the cell, once one does and the other could take over."""
        wait_for(lambda: any(self.standby(number).get("peer_ready") for number in (0, 1)), "a pair", START)
        # Two gateways may be a pair before both of them listen for control.
        wait_for(lambda: all(self.role(number) for number in (0, 1)), "both control sockets", START)
        # The other one may have heard of the claim before this one has looked for its address.
        wait_for(lambda: "active" in (self.role(0), self.role(1)), "one that serves the cell", START)
        (found,) = (number for number in (0, 1) if self.role(number) == "active")
        return found

    def adoption(self, number: int) -> float:
        """Seconds that owners have left to come back."""
        return float(Client(self.sockets[number]).get("/v1/status")["cells"][0]["robot"]["adoption"])

    def command(self, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "gatewayd", *map(str, arguments)],
            capture_output=True,
            text=True,
            check=False,
        )

    def plc(self) -> Plc:
        """A connection to the one that serves the cell, once the robot can be written."""
        wait_for(self._answers, "a gateway that serves the cell", START)
        return self.plant.plc()

    def _answers(self) -> bool:
        try:
            plc = Plc(self.plant.modbus)
        except ConnectionError:
            return False
        try:
            return plc.reading_code(10) == 0 and plc.writable
        finally:
            plc.close()


def test_a_crash_is_survived_and_the_robot_keeps_its_values(plant: Plant) -> None:
    """kill -9: the kernel closes the connection, the robot frees the inputs, and the other one has them at once."""
    gateways = Gateways(plant)
    active = gateways.active()
    plc = gateways.plc()
    assert plc.write(10, [0, 7]) == 0
    assert plc.write(12, [0, 8]) == 0
    wait_for(lambda: gateways.robot.integer("input_int_register_0") == 7, "the value in the robot")
    wait_for(lambda: gateways.robot.integer("input_int_register_1") == 8, "the other value in the robot")
    crashed = time.monotonic()
    gateways.daemons[active].kill()
    plc = gateways.plc()
    took = time.monotonic() - crashed
    print(f"takeover after a crash: {took * 1000:.0f} ms")
    assert gateways.robot.integer("input_int_register_0") == 7, "nobody has written to the robot"
    assert plc.integers(10) == [7]
    assert plc.write(10, [0, 9]) == 0
    wait_for(lambda: gateways.robot.integer("input_int_register_0") == 9, "the owner's value, who is back")
    wait_for(lambda: gateways.adoption(1 - active) == 0, "the end of the grace")
    assert plc.owner(2) == 0
    assert gateways.robot.integer("input_int_register_0") == 9
    assert gateways.robot.integer("input_int_register_1") == 8, "on_release: hold"


def test_an_owner_who_does_not_come_back_is_lost(plant: Plant) -> None:
    gateways = Gateways(plant, grace="1s")
    active = gateways.active()
    plc = gateways.plc()
    assert plc.write(10, [0, 7]) == 0
    wait_for(lambda: gateways.robot.integer("input_int_register_0") == 7, "the value in the robot")
    crashed = time.monotonic()
    gateways.daemons[active].kill()
    wait_for(lambda: gateways.robot.integer("input_int_register_0") == 0, "the release fallback")
    assert time.monotonic() - crashed >= 1


def test_planned_switch_and_back(plant: Plant) -> None:
    """Forces end, values stay, and the writer finds the cell on the other side."""
    gateways = Gateways(plant, grace="60s")
    plc = gateways.plc()
    assert plc.write(10, [0, 7]) == 0
    for _turn in range(2):
        active = gateways.active()
        forced = gateways.command("force", "mode", "5", "--for", "60s", "--socket", gateways.sockets[active])
        assert forced.returncode == 0, forced.stderr
        wait_for(lambda: gateways.robot.integer("input_int_register_1") == 5, "the force in the robot")
        standing_by = gateways.command(
            "force", "mode", "5", "--for", "9s", "--socket", gateways.sockets[1 - active]
        )
        assert standing_by.returncode == 1
        assert "this gateway stands by" in standing_by.stderr
        wrong = gateways.command(
            "standby", "switch", "--cell", "cell", "--socket", gateways.sockets[1 - active]
        )
        assert wrong.returncode == 1
        assert "hand over at the one that serves the cell" in wrong.stderr
        done = gateways.command("standby", "switch", "--socket", gateways.sockets[active])
        assert done.returncode == 0, done.stderr
        print(done.stdout.strip())
        plc = gateways.plc()
        assert plc.integers(10) == [7]
        assert gateways.active() == 1 - active
        assert gateways.robot.integer("input_int_register_0") == 7
    shown = gateways.command("standby", "--socket", gateways.sockets[active])
    assert shown.stdout.startswith("cell: this gateway is standing by, the other one active"), shown


def test_a_robot_that_restarts_is_claimed_by_exactly_one(plant: Plant) -> None:
    gateways = Gateways(plant)
    gateways.active()
    for _restart in range(3):
        gateways.robot.do("restart")
        wait_for(
            lambda: (
                sorted((gateways.role(0), gateways.role(1))) == ["active", "standing by"]
                and gateways.robot.do("clients") == "2"
            ),
            "one that serves",
        )
        gateways.active()


def test_another_mapping_stands_by_until_it_is_the_same(plant: Plant) -> None:
    gateways = Gateways(plant)
    active = gateways.active()
    other = gateways.files[1 - active]
    text = other.read_text()
    other.write_text(text.replace("modbus: 12", "modbus: 14"))
    reloaded = gateways.command("reload", "--socket", gateways.sockets[1 - active])
    assert reloaded.returncode == 0, reloaded.stdout
    wait_for(lambda: gateways.role(1 - active) == "mismatched", "the mismatch")
    refused = gateways.command("standby", "switch", "--socket", gateways.sockets[active])
    assert "the mapping of the other gateway differs" in refused.stderr
    status = gateways.command("status", "--socket", gateways.sockets[active])
    assert "the other gateway has another mapping" in status.stdout
    gateways.daemons[active].kill()
    gateways.daemons[active] = gateways.start(active)
    wait_for(lambda: gateways.role(active) == "active", "the one that served the cell before", START)
    assert gateways.role(1 - active) == "mismatched"
    other.write_text(text)
    assert gateways.command("reload", "--socket", gateways.sockets[1 - active]).returncode == 0
    assert gateways.active() == active
