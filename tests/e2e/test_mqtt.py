"""Values to a broker and commands from it, with separate processes: simulator, gateway, mosquitto and its tools, and
Tahu's host application. What a broker does must never be noticed on the fieldbus.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import PLC, Plc
from tests.e2e.processes import HOST, Daemon, Process, Simulator, wait_for
from tests.peers.mosquitto import Mosquitto, mosquitto
from tests.peers.tahu import tahu_host

SECTION = "mqtt: {{host: {host}, port: {port}, keepalive: 1s, interval: 50ms, {how}}}\n"
CELL = f"""\
writers:
  plc: {{modbus: {PLC}}}
  mes: {{mqtt: MES}}
variables:
  speed: {{robot: input_double_register_0, owner: [plc, mes], lease: 60s, limits: [0, 1], unit: m/s, modbus: 10}}
  part:  {{robot: input_int_register_0, owner: mes, mqtt: order/part}}
  count: {{robot: output_int_register_1, modbus: 100}}
"""
JSON = CELL.replace("mqtt: MES", "mqtt: set, timeout: 30s")


@dataclass
class Served:
    """A robot, a gateway, a broker, and who listens there."""

    plant: Plant
    broker: Mosquitto
    simulator: Simulator
    daemon: Daemon
    file: Path
    socket: Path
    ear: Process

    def said(self, topic: str) -> list[Any]:
        """Everything that was published there."""
        found = []
        for line in self.ear.text().splitlines():
            name, _, text = line.partition(" ")
            if name == topic:
                found.append(json.loads(text) if text.startswith("{") else text)
        return found

    def publish(self, topic: str, payload: object, *options: str) -> None:
        where = ["-h", self.broker.host, "-p", str(self.broker.port)]
        text = payload if isinstance(payload, str) else json.dumps(payload)
        command = ["mosquitto_pub", *where, "-t", topic, "-m", text, *options]
        subprocess.run(command, check=True, capture_output=True)

    def ask(self, payload: object, *options: str) -> dict[str, Any]:
        """What a command is answered."""
        before = len(self.said("plant/cell/set/result"))
        self.publish("plant/cell/set", payload, *options)
        wait_for(lambda: len(self.said("plant/cell/set/result")) > before, "an answer")
        found: dict[str, Any] = self.said("plant/cell/set/result")[before]
        return found

    def link(self) -> dict[str, Any]:
        """What the gateway says of the link."""
        command = [sys.executable, "-m", "gatewayd", "status", "--json", "--socket", str(self.socket)]
        printed = subprocess.run(command, capture_output=True, text=True, check=False).stdout
        found: dict[str, Any] = json.loads(printed)["cells"][0]["mqtt"]
        return found


def listening(plant: Plant, broker: Mosquitto) -> Process:
    """mosquitto_sub, which prints on its log."""
    shell = 'exec stdbuf -oL mosquitto_sub -h "$0" -p "$1" -v -t "#" >&2'
    ear = plant.program(["sh", "-c", shell, broker.host, str(broker.port)], "ear")
    broker.wait_for_line("Sending SUBACK to")
    return ear


def serve(plant: Plant, broker: Mosquitto, how: str, cell: str) -> Served:
    simulator = plant.simulator("--model", "ur5e")
    section = SECTION.format(host=broker.host, port=broker.port, how=how)
    ear = listening(plant, broker)
    file = plant.mapping(section + cell, simulator.port)
    socket = plant.directory / "control.sock"
    daemon = plant.daemon(file, "--control", socket, "--state", plant.directory)
    daemon.wait_for_line("connected to the broker")
    daemon.wait_for_line("listening for control")
    return Served(plant, broker, simulator, daemon, file, socket, ear)


@pytest.fixture
def served(plant: Plant) -> Iterator[Served]:
    with mosquitto(plant.directory / "broker") as broker:
        yield serve(plant, broker, "topic: plant/cell", JSON)


def count(plc: Plc) -> int:
    return plc.read(100, 2)[1]


def test_values_go_and_commands_come(served: Served) -> None:
    served.simulator.do("set output_int_register_1 41")
    wait_for(lambda: [each["value"] for each in served.said("plant/cell/count")][-1:] == [41], "the value")
    assert served.said("plant/cell/count")[-1]["quality"] == "good"
    assert served.said("plant/cell/available") == ["online"]
    answer = served.ask({"id": 1, "write": {"speed": 0.5, "order/part": 7}})
    assert (answer["id"], answer["result"], answer["values"]["order/part"]["value"]) == (1, "done", 7)
    wait_for(lambda: served.simulator.integer("input_int_register_0") == 7, "the robot to have it")
    assert served.ask({"write": {"speed": 3}})["reason"] == "out_of_limits"
    plc = served.plant.ready_plc()
    assert plc.write(10, [0, 0, 0, 0]) == 0
    refused = served.ask({"write": {"speed": 0.75}})
    assert (refused["reason"], refused["holder"], refused["values"]["speed"]["value"]) == ("held", "plc", 0.0)
    served.publish("plant/cell/set", {"write": {"order/part": 99}}, "-r")
    wait_for(
        lambda: served.simulator.integer("input_int_register_0") == 99, "a live one, retained for others"
    )
    served.daemon.stop()
    wait_for(lambda: served.said("plant/cell/available")[-1] == "offline", "its good-bye")


def test_a_broker_that_is_killed_costs_its_writers_and_nothing_else(served: Served) -> None:
    plc = served.plant.ready_plc()
    served.ask({"write": {"order/part": 7}})
    wait_for(lambda: served.simulator.integer("input_int_register_0") == 7, "the robot to have it")
    served.broker.kill()
    wait_for(lambda: served.simulator.integer("input_int_register_0") == 0, "the release of its order")
    for number in (1, 2, 3):
        served.simulator.do(f"set output_int_register_1 {number}")
        wait_for(lambda number=number: count(plc) == number, "the PLC to see it")  # type: ignore[misc]
        wait_for(lambda number=number: served.link()["stored"] >= number, "it to be kept")  # type: ignore[misc]
    assert served.link()["state"] == "not connected"
    served.broker.start()
    ear = listening(served.plant, served.broker)
    served.ear = ear
    wait_for(lambda: served.link()["state"] == "connected", "the broker")
    wait_for(lambda: served.link()["stored"] == 0, "the history to be sent")
    assert plc.status(55) == 0


def test_a_broker_that_stands_still_is_not_noticed_on_the_fieldbus(served: Served) -> None:
    plc = served.plant.ready_plc()
    served.ask({"write": {"order/part": 7}})
    served.broker.freeze()
    number = 0
    while served.link()["state"] != "not connected":
        number += 1
        served.simulator.do(f"set output_int_register_1 {number}")
        wait_for(lambda number=number: count(plc) == number, "the PLC to see it")  # type: ignore[misc]
    wait_for(lambda: served.simulator.integer("input_int_register_0") == 0, "the release of its order")
    served.broker.thaw()
    wait_for(lambda: served.link()["state"] == "connected", "the broker")


def test_what_was_sent_while_the_gateway_stood_still_is_too_old(plant: Plant) -> None:
    with mosquitto(plant.directory / "broker") as broker:
        cell = JSON.replace("timeout: 30s", "timeout: 500ms")
        served = serve(plant, broker, "topic: plant/cell", cell.replace("keepalive: 1s", "keepalive: 60s"))
        plant.ready_plc()
        served.daemon.signal(signal.SIGSTOP)
        served.publish("plant/cell/set", {"write": {"order/part": 5}})
        command = ["mosquitto_pub", "-h", HOST, "-p", str(broker.port), "-t", "a", "-m", "b"]
        deadline = wait_for(lambda: subprocess.run(command, check=False).returncode == 0, "the broker")
        assert deadline < 10
        subprocess.run(["sleep", "0.8"], check=True)  # the time that makes it old
        served.daemon.signal(signal.SIGCONT)
        wait_for(lambda: bool(served.said("plant/cell/set/result")), "an answer")
        assert served.said("plant/cell/set/result")[0]["reason"] == "waited"
        assert served.simulator.integer("input_int_register_0") == 0


def test_a_reload_keeps_the_connection_where_it_can(served: Served) -> None:
    text = served.file.read_text()
    served.file.write_text(
        text.replace("  count:", "  more:  {robot: output_int_register_2, modbus: 110}\n  count:")
    )
    command = [sys.executable, "-m", "gatewayd", "reload", "--socket", str(served.socket)]
    subprocess.run(command, check=True, capture_output=True)
    wait_for(lambda: bool(served.said("plant/cell/more")), "the new value")
    assert served.link()["connections"] == 1
    served.file.write_text(text.replace("topic: plant/cell", "topic: plant/other"))
    subprocess.run(command, check=True, capture_output=True)
    wait_for(lambda: served.said("plant/other/available") == ["online"], "the other topic")
    wait_for(lambda: served.said("plant/cell/available")[-1] == "offline", "the good-bye at the old one")


def test_a_foreign_host_application_understands_births_and_commands(plant: Plant) -> None:
    """Eclipse Tahu's: types and values, DCMD accepted and refused, and lost with the host."""
    with (
        mosquitto(plant.directory / "broker") as broker,
        tahu_host(broker, plant.directory / "host.log", "scada", "plant") as host,
    ):
        how = "sparkplug: {group: plant, node: hall-2, primary_host: scada}"
        cell = CELL.replace("mqtt: MES", "mqtt: primary_host").replace("order/part", "part")
        served = serve(plant, broker, how, cell)
        device = "plant/hall-2/cell"
        host.wait_for(lambda: "part" in host.metrics("onBirthMetric", device), "the birth")
        births = host.metrics("onBirthMetric", device)
        assert births["speed"][0] == "Double"
        assert births["part"][0] == "Int32"
        plant.ready_plc()
        host.command("hall-2", "cell", "part", "Int32", "7")
        wait_for(lambda: served.simulator.integer("input_int_register_0") == 7, "the robot to have it")
        host.wait_for(
            lambda: host.metrics("onDataMetric", device).get("part", ["", ""])[1] == "7", "the answer"
        )
        seen = len(host.of("onDataMetric", device))
        host.command("hall-2", "cell", "speed", "Double", "5.0")
        host.wait_for(lambda: len(host.of("onDataMetric", device)) > seen, "the truth")
        assert host.metrics("onDataMetric", device)["speed"][1] == "0.0"
        assert served.link()["refused"] == {"out_of_limits": 1}
        host.quit()
        wait_for(lambda: served.simulator.integer("input_int_register_0") == 0, "the release of its order")


def test_nothing_of_it_is_loaded_where_no_cell_has_a_broker(tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from gatewayd.mapping.worker import compile_files;"
        "from gatewayd.service.daemon import Daemon;"
        "Daemon(compile_files([sys.argv[1]]).plans, Path(sys.argv[2]));"
        "print(*[name for name in sys.modules if name.startswith(('paho', 'gatewayd.sparkplug', 'gatewayd.mqtt.cl'))])"
    )
    root = Path(__file__).parents[2]
    command = [sys.executable, "-c", program, str(root / "mappings/small-cell.yaml"), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=root)
    assert done.stdout.strip() == ""
