"""`gatewayd devices scan`."""

from __future__ import annotations

import json

import pytest

from tests.cli.conftest import Invoke
from tests.cli.devices.conftest import Plant


def test_who_answers(lone_device: Plant, invoke: Invoke) -> None:
    done = invoke("devices", "scan", f"127.0.0.1:{lone_device.port}", "--numbers", "1..2")
    assert done.exit_code == 0
    assert done.stdout.splitlines() == [
        "unit 1: answers, says nothing of itself",
        "unit 2: answers, says nothing of itself",
    ]
    assert "asking units 1..2 for holding register 0" in done.stderr
    assert "nothing is written" in done.stderr
    assert lone_device.unit.bits == lone_device.unit.registers == {}


def test_json(lone_device: Plant, invoke: Invoke) -> None:
    done = invoke("devices", "scan", f"127.0.0.1:{lone_device.port}", "--numbers", "7", "--json")
    (found,) = json.loads(done.stdout)
    assert (found["number"], found["vendor"]) == (7, None)


def test_nobody_answers(lone_device: Plant, invoke: Invoke) -> None:
    lone_device.unit.change = lambda _: None
    where = f"127.0.0.1:{lone_device.port}"
    done = invoke("devices", "scan", where, "--numbers", "1..2", "--timeout", "10ms")
    assert (done.exit_code, done.stdout) == (1, "")
    assert "nobody answers" in done.stderr


def test_running_gateway_is_named(plant: Plant, invoke: Invoke) -> None:
    done = invoke("devices", "scan", f"127.0.0.1:{plant.port}", "--numbers", "1")
    assert done.exit_code == 0
    assert "device island) is connected there as well" in done.stderr
    done = invoke("devices", "scan", "/dev/ttyUSB0")
    assert done.exit_code == 1
    assert "/dev/ttyUSB0 19200 8N1 is not scanned: the gateway at " in done.stderr


@pytest.mark.parametrize(
    "arguments, says",
    [
        (("127.0.0.1:1", "--numbers", "1..2..3"), "is no range"),
        (("127.0.0.1:1", "--numbers", "1..999"), "are no units"),
        (("127.0.0.1:1", "--baudrate", "9600"), "no --baudrate"),
        (("a b",), "is not the address of a device"),
        (("127.0.0.1:1",), "Connection refused"),
        (("/dev/no-such-port",), "there is no such port"),
    ],
)
def test_line_that_cannot_be_scanned(invoke: Invoke, arguments: tuple[str, ...], says: str) -> None:
    done = invoke("devices", "scan", *arguments)
    assert done.exit_code == 2
    assert says in done.stderr
