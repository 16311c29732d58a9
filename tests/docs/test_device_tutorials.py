"""The tutorial's steps with devices, as a reader does them: every line that they show comes, where it is shown."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from tests.docs.generated import DOCS
from tests.docs.test_commands import commands
from tests.e2e.can_plant import start_bus
from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, Daemon, Process, free_port, wait_for

pytestmark = pytest.mark.slow

SHOWN = re.compile(
    r"<!-- (log|type|prints|watch|status|trace)(?:: \w+)? -->\n```text\n(.*?)^```"
    r"|^mbpoll -0 -p 1502 -r (\d+ 127\.0\.0\.1 \d+)$",
    re.MULTILINE | re.DOTALL,
)
FILE = re.compile(r"<!-- file: (\S+) -->\n```yaml\n(.*?)^```", re.MULTILINE | re.DOTALL)
STAND_IN = ".venv/bin/python "


@dataclass
class Reader:
    """Somebody who follows a page; addresses and ports of the page are replaced by those of the test."""

    page: Path
    plant: Plant
    replaced: dict[str, str] = field(default_factory=dict)
    client: ModbusTcpClient | None = None

    def __post_init__(self) -> None:
        self.text = self.page.read_text()
        (found,) = FILE.findall(self.text)
        self.name, self.mapping = found
        self.socket = self.plant.directory / "control.sock"
        self.daemon: Daemon
        self.device: Process

    def here(self, text: str) -> str:
        """What the page says, where this test is."""
        for there, here in self.replaced.items():
            text = text.replace(there, here)
        return text

    def switch_on(self) -> None:
        """Start the stand-in of the device by the page's own command."""
        (line,) = (line for line in commands(self.page) if line.startswith(STAND_IN))
        words = [sys.executable, *shlex.split(self.here(line))[1:]]
        self.device = self.plant.program(words, "device")
        assert self.device.answer().startswith(("listening", "booted")), self.device.text()

    def run(self) -> None:
        """Robot and gateway, until the gateway has the device."""
        simulator = self.plant.simulator()
        text = self.here(self.mapping).replace("series: e", f"series: e\n  port: {simulator.port}")
        mapping = self.plant.directory / self.name
        mapping.write_text(text.replace("host: 127.0.0.1", f"host: {HOST}"))
        self.daemon = self.plant.run("--control", self.socket, mapping)
        self.daemon.wait_for_line("inputs adopted")

    def type(self, text: str) -> None:
        assert self.device.popen.stdin is not None
        self.device.popen.stdin.write(text)
        self.device.popen.stdin.flush()

    def prints(self, text: str) -> None:
        """The device prints these lines, perhaps in another order: a reader types more slowly."""
        awaited = set(self.here(text).splitlines())
        while awaited:
            line = self.device.answer()
            assert line, f"{awaited} never came; {self.device.text()}"
            awaited.discard(line)

    def log(self, text: str) -> None:
        for line in self.here(text).splitlines():
            self.daemon.wait_for_line(re.sub(r"\s+", " ", line).partition(" ")[2])

    def asks(self, *command: str) -> str:
        """What a command says, blanks as one."""
        words = [sys.executable, "-m", "gatewayd", *command, "--socket", str(self.socket)]
        done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)
        return re.sub(r" +", " ", done.stdout)

    def watch(self, text: str) -> None:
        self._said(text, "watch", "--once")

    def status(self, text: str) -> None:
        self._said(text, "status")

    def trace(self, text: str) -> None:
        self._said(text, "trace", "--link", "device", "--seconds", "0.2s")

    def _said(self, text: str, *command: str) -> None:
        """The command shows these lines, once what was done has come through."""

        def is_said() -> bool:
            said = self.asks(*command)
            return all(self._is_in(line, said) for line in self.here(text).splitlines())

        wait_for(is_said, f"{text} in {command}", limit=30.0)

    @staticmethod
    def _is_in(line: str, said: str) -> bool:
        *words, owner = line.split()
        if words and words[0] in {"->", "<-"}:
            return re.search(rf"{re.escape(' '.join(words))} .*{owner}", said) is not None
        return line in said

    def order(self, text: str) -> None:
        """`mbpoll` writes one register."""
        address, _, value = text.split()
        assert self.client is not None
        wait_for(self.client.connect, "the gateway to listen")
        assert not self.client.write_register(int(address), int(value)).isError()


def play(reader: Reader) -> None:
    """Everything that the page shows, in its order; the device is switched off before the page says what follows."""
    for kind, text, order in SHOWN.findall(reader.text):
        if "device lost" in text:
            reader.type("q\n")
        getattr(reader, kind or "order")(text or order)


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[Plant]:
    plant = Plant(tmp_path)
    yield plant
    plant.stop()


def test_island(plant: Plant) -> None:
    port = free_port()
    reader = Reader(DOCS / "tutorial" / "7-io-island.md", plant)
    reader.replaced = {"127.0.0.1:1520": f"{HOST}:{port}", "127.0.0.1 1520": f"{HOST} {port}"}
    reader.switch_on()
    reader.run()
    play(reader)
    reader.switch_on()
    reader.daemon.wait_for_line("device answers", count=2)
    reader.prints("coil 1 off")


def test_gripper(plant: Plant) -> None:
    pytest.importorskip("serial")
    reader = Reader(DOCS / "tutorial" / "8-gripper.md", plant)
    port = str(plant.directory / "gripper")
    reader.replaced = {"/tmp/gripper": port, "listen: 127.0.0.1:1502": f"listen: {HOST}:{plant.modbus}"}  # noqa: S108 - the page's
    reader.replaced["modbus: 127.0.0.1"] = f"modbus: {HOST}"
    reader.switch_on()
    reader.run()
    reader.client = client = ModbusTcpClient(HOST, port=plant.modbus, retries=0, source_address=(HOST, 0))
    play(reader)
    shown = re.findall(r"^\[(\d+)\]:  (\d+)$", reader.text, re.MULTILINE)
    assert shown == [("112", "2"), ("114", "200")]
    values = [0, 2, 0, 200]
    wait_for(
        lambda: client.read_holding_registers(112, count=4).registers == values, "what the gripper reports"
    )
    client.close()  # type: ignore[no-untyped-call]


def test_encoder(plant: Plant) -> None:
    """On a bus between processes, because machines that test may have no kernel with CAN."""
    _, port = start_bus(plant)
    reader = Reader(DOCS / "tutorial" / "9-encoder.md", plant)
    bus = f"socket://{HOST}:{port}"
    sheet = plant.directory / "encoder.eds"
    sheet.write_bytes((DOCS.parent / "mappings" / "encoder.eds").read_bytes())
    reader.replaced = {
        "canopen: vcan0": f"canopen: '{bus}', interface: slcan",
        "can_encoder.py vcan0 encoder.eds": f"can_encoder.py {bus} {sheet} --interface slcan",
    }
    reader.switch_on()
    reader.run()
    play(reader)
    reader.switch_on()
    reader.daemon.wait_for_line("device in operation", count=2)
