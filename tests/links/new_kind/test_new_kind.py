"""A new fieldbus is one folder and one line: a kind of link that is here and nowhere else works in every command.

The tree is copied, the folder added to it, and the line to its registry; nothing else in it changes.
"""

from __future__ import annotations

import json
import shutil
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import STRANGER, Plc
from tests.e2e.processes import HOST, Process, free_port, wait_for

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
LAST = '    "gatewayd.links.canopen_node",\n'
HEAD = """\
gatewayd: 1
cell: press
robot: {{host: {host}, port: {robot}}}
modbus: {{listen: '{host}:{modbus}'}}
lines: {{listen: '{host}:{listen}', to: '{host}:{to}'}}
writers:
  plc: {{lines: {host}, timeout: 1min}}
variables:
"""
VARIABLES = """\
  speed: {robot: input_double_register_0, lines: speed, modbus: 0, owner: plc, limits: [0, 1], on_release: 0}
  done: {robot: output_int_register_0..1, lines: done}
"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tree with the new kind."""
    tree = tmp_path_factory.mktemp("tree")
    shutil.copytree(
        ROOT / "gatewayd", tree / "gatewayd"
    )  # with what is compiled: the times of the files are kept
    shutil.copytree(HERE / "udp_lines", tree / "gatewayd" / "links" / "udp_lines")
    registry = tree / "gatewayd" / "links" / "registry.py"
    text = registry.read_text()
    assert LAST in text
    registry.write_text(text.replace(LAST, f'{LAST}    "gatewayd.links.udp_lines",\n'))
    return tree


def command(tree: Path, *arguments: str | Path) -> list[str]:
    return ["env", "-C", str(tree), sys.executable, "-m", "gatewayd", *map(str, arguments)]


def run(tree: Path, *arguments: str | Path, code: int | None = 0) -> str:
    done = subprocess.run(command(tree, *arguments), capture_output=True, text=True, check=False)
    assert code is None or done.returncode == code, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return done.stdout + (done.stderr if code else "")


def mapping(path: Path, variables: str = VARIABLES, **ports: int) -> Path:
    numbers = {"robot": 30004, "modbus": 1502, "listen": 9001, "to": 9002} | ports
    path.write_text(HEAD.format(host=HOST, **numbers) + variables)
    return path


def test_check_finds_by_its_rule_with_place_and_remedy(tree: Path, tmp_path: Path) -> None:
    file = mapping(tmp_path / "press.yaml", VARIABLES.replace("lines: done", "lines: speed", 1))
    twice = file.read_text().replace("output_int_register_0..1", "output_int_register_0")
    file.write_text(twice)
    (finding,) = json.loads(run(tree, "check", "--format", "json", file, code=1))["findings"]
    assert (finding["rule"], finding["line"], finding["hint"]) == ("GW899", 10, "give it another name")
    assert finding["related"][0]["line"] == 9
    assert "JSON keeps the last" in run(tree, "check", "--explain", "GW899")


def test_check_knows_its_keys_and_their_types(tree: Path, tmp_path: Path) -> None:
    file = mapping(tmp_path / "press.yaml")
    file.write_text(file.read_text().replace("lines: {listen:", "lines: {lisen:"))
    findings = json.loads(run(tree, "check", "--format", "json", file, code=1))["findings"]
    assert {one["slug"] for one in findings} == {"unknown-key", "missing-key"}
    assert all("the section `lines`" in one["message"] for one in findings)
    assert "did you mean `listen`?" in {one["hint"] for one in findings}


def test_the_schema_has_its_section_and_keys(tree: Path) -> None:
    text = subprocess.run(
        ["env", "-C", tree, sys.executable, "-m", "gatewayd.mapping.schema"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    schema = json.loads(text)
    assert "lines" in schema["properties"]
    assert "lines" in schema["$defs"]["VariableSpec"]["properties"]
    assert "lines" in schema["$defs"]["WriterSpec"]["properties"]


def test_show_has_its_places(tree: Path, tmp_path: Path) -> None:
    file = mapping(tmp_path / "press.yaml")
    rows = json.loads(run(tree, "show", "--format", "json", file))["variables"]
    assert [row["lines"] for row in rows] == ["speed", "done0", "done1"]
    assert "done1" in run(tree, "show", "--format", "csv", file)
    assert "speed" in run(tree, "show", file)


def test_doctor_looks_at_what_it_needs(tree: Path, tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as foreign:
        foreign.bind((HOST, free_port()))
        file = mapping(tmp_path / "press.yaml", robot=free_port(), listen=foreign.getsockname()[1])
        document = json.loads(run(tree, "doctor", "--json", "--socket", tmp_path / "none", file, code=1))
    (socket_check,) = (check for check in document["checks"] if check["link"] == "lines")
    assert (socket_check["check"], socket_check["outcome"]) == ("socket", "problem")
    assert [advice["link"] for advice in document["advice"]][-2:] == ["lines", "gateway"]


def test_diff_tells_its_settings_and_places_by_name(tree: Path, tmp_path: Path) -> None:
    old = mapping(tmp_path / "old.yaml")
    new = mapping(tmp_path / "new.yaml", VARIABLES.replace("lines: speed", "lines: tempo"), to=9003)
    text = run(tree, "diff", old, new, code=1)
    assert f"~ lines: to {HOST}:9002 -> {HOST}:9003" in text
    assert "~ speed: lines line speed -> line tempo" in text


class Party:
    """Somebody who listens to the lines and writes."""

    def __init__(self, listen: int, gateway: int) -> None:
        self.ear = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.ear.bind((HOST, listen))
        self.ear.settimeout(5)
        self.mouth = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.mouth.bind((HOST, 0))
        self.mouth.settimeout(5)
        self.gateway = HOST, gateway

    def line(self) -> dict[str, Any]:
        """The newest line."""
        self.ear.setblocking(False)
        with suppress(BlockingIOError):
            while True:
                self.ear.recv(65536)
        self.ear.settimeout(5)
        found: dict[str, Any] = json.loads(self.ear.recv(65536))
        return found

    def write(self, **values: float) -> str | None:
        """What it is refused for."""
        self.mouth.sendto(json.dumps({"write": values}).encode(), self.gateway)
        answer: str | None = json.loads(self.mouth.recv(65536))["refused"]
        return answer

    def close(self) -> None:
        self.ear.close()
        self.mouth.close()


class Served:
    """A running gateway with the new kind, a robot and a party."""

    def __init__(self, tree: Path, plant: Plant, directory: Path) -> None:
        self.tree = tree
        self.robot = plant.simulator()
        self.listen, self.to, self.page, self.modbus = (free_port() for _ in range(4))
        self.file = directory / "press.yaml"
        self.map()
        self.party = Party(self.to, self.listen)
        self.socket = directory / "control.sock"
        options = ("--control", self.socket, "--state", directory, "--status", f"{HOST}:{self.page}")
        self.daemon = Process(command(tree, "run", self.file, *options), directory / "gateway.log")
        wait_for(lambda: self.status()["cells"][0]["healthy"], "a healthy cell", 20)

    def map(self, variables: str = VARIABLES, **ports: int) -> None:
        numbers = {
            "robot": self.robot.port,
            "modbus": self.modbus,
            "listen": self.listen,
            "to": self.to,
        } | ports
        mapping(self.file, variables, **numbers)

    def status(self) -> dict[str, Any]:
        if not self.socket.exists():
            return {"cells": [{"healthy": False}]}
        found: dict[str, Any] = json.loads(self.ask("status", "--json", code=None))
        return found

    def ask(self, *arguments: str, code: int | None = 0) -> str:
        return run(self.tree, arguments[0], "--socket", self.socket, *arguments[1:], code=code)

    def well(self) -> str:
        """What `status` prints when all is well; a busy machine may be too late for the robot's values before."""
        printed = ""

        def is_well() -> bool:
            nonlocal printed
            printed = self.ask("status", code=None)
            return "degraded" not in printed

        wait_for(is_well, "a gateway without a complaint")
        return printed

    def get(self, path: str) -> str:
        with urllib.request.urlopen(f"http://{HOST}:{self.page}{path}", timeout=5) as answer:
            found: str = answer.read().decode()
        return found

    def close(self) -> None:
        self.party.close()
        self.daemon.signal(signal.SIGTERM)
        assert self.daemon.wait() == 0, self.daemon.text()


@pytest.fixture
def served(tree: Path, tmp_path: Path, plant: Plant) -> Iterator[Served]:
    served = Served(tree, plant, tmp_path)
    yield served
    served.close()


def test_it_runs_reads_and_writes(served: Served) -> None:
    """Values go out, writes come back to the robot, and what is refused is refused as anywhere."""
    assert set(served.party.line()) == {"speed", "done0", "done1"}
    served.map(VARIABLES.replace("owner: plc,", "owner: plc, lease: 500ms,"))
    served.ask("reload")
    assert served.party.write(speed=0.5) is None
    wait_for(lambda: served.robot.number("input_double_register_0") == 0.5, "the robot to have it")
    assert served.party.line()["speed"] == 0.5
    assert served.party.write(speed=7.0) == "value out of limits"
    wait_for(lambda: served.robot.number("input_double_register_0") == 0.0, "the end of its lease", 5)


def test_it_is_in_status_metrics_and_page(served: Served) -> None:
    cell = served.status()["cells"][0]
    assert cell["lines"]["listen"] == f"{HOST}:{served.listen}"
    assert cell["lines"]["sent"] > 0
    text = served.well()
    assert f"{HOST}:{served.listen} sending" in text
    assert 'gatewayd_lines_total{cell="press",direction="out"}' in served.get("/metrics")
    layout = json.loads(served.get("/page/cells/press"))
    assert "speed" in json.dumps(layout["variables"][0]["places"])
    picture = json.loads(served.get("/page/cells/press/state?since=0"))["picture"]
    assert f"lines {HOST}:{served.listen}" in [one["name"] for one in picture["buses"]]


def test_its_word_is_in_the_status_block_behind_all_others(served: Served) -> None:
    reader = Plc(served.modbus, STRANGER, host=HOST)
    before = reader.status(60)
    wait_for(lambda: reader.status(60) > before, "lines that were sent")
    assert reader.status(0) == 1
    reader.close()


def test_a_reload_keeps_it_rebinds_it_and_hears_its_objections(served: Served) -> None:
    own = served.party.mouth.getsockname()
    served.map(VARIABLES.replace("lines: done", "lines: parts"))
    assert "reloaded" in served.ask("reload")
    wait_for(lambda: "parts0" in served.party.line(), "the other names")
    assert served.party.mouth.getsockname() == own
    assert served.party.write(speed=0.25) is None
    served.map(VARIABLES.replace("lines: done", "lines: parts"), to=free_port())
    said = served.ask("reload", code=1)
    assert "lines would go to" in said
    assert served.party.write(speed=0.3) is None, "the old mapping runs on"
    served.map(VARIABLES.replace("lines: done", "lines: parts"), listen=free_port())
    assert "would be released: its socket ends [release]" in served.ask("reload", code=1)


def test_the_watchdog_looks_after_it(served: Served) -> None:
    """Its progress is among what has to go on."""
    program = (
        "import sys, asyncio; from pathlib import Path; from gatewayd.mapping.worker import compile_files;"
        "from gatewayd.service.daemon import Daemon;"
        "plans = compile_files([sys.argv[1]]).plans;"
        "print(*Daemon(plans, Path(sys.argv[2])).progress(), sep='\\n')"
    )
    words = ["env", "-C", served.tree, sys.executable, "-c", program, served.file, served.file.parent]
    names = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=True).stdout
    assert "lines link of press" in names.splitlines()


def test_a_cell_has_two_of_it(tree: Path, tmp_path: Path) -> None:
    """Links go by their names, and each knows its kind; one is moved by a reload, the other stays."""
    program = shutil.copy(HERE / "two_links.py", tree)
    ports = {name: free_port() for name in ("robot", "modbus", "listen", "to")}
    file = mapping(tmp_path / "press.yaml", VARIABLES, **ports)
    words = ["env", "-C", tree, sys.executable, program, file, tmp_path, free_port(), free_port()]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    before, after = found["before"], found["after"]
    status = before["status"]
    assert [link["name"] for link in status["links"]] == ["robot", "modbus", "left", "right"]
    assert {link["title"] for link in status["links"][2:]} == {"JSON lines over UDP"}
    assert status["lines"] is None
    assert status["left"]["sent"] > status["right"]["sent"] > 0
    assert before["variable"]["left"] == before["variable"]["right"] == {"name": "speed"}
    assert before["page"]["lines"] is None
    assert before["page"]["left"]["listen"] != before["page"]["right"]["listen"]
    assert [place for place in before["places"] if place[1] == "speed"] == [
        ["left", "speed"],
        ["right", "speed"],
    ]
    outwards = [line.rpartition(" ")[0] for line in before["metrics"] if 'direction="out"' in line]
    assert outwards == [
        f'gatewayd_lines_total{{cell="press",direction="out",link="{name}"}}' for name in ("left", "right")
    ]
    assert {"lines link left of press", "lines link right of press"} < before["progress"].keys()
    assert "~ right: " in found["diff"]
    assert "left" not in found["diff"]
    assert sum("lines would go to" in text for text in found["objections"]) == 1
    assert after["ids"]["left"] == before["ids"]["left"]
    assert after["ids"]["right"] != before["ids"]["right"]
    assert after["progress"]["lines link right of press"] == 0
