"""The second step of the tutorial, as a reader does it: simulator, gateway, and what a Modbus client then sees."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from gatewayd.demo.scene import HOST, free_port
from tests.docs.generated import DOCS

PATIENCE = 30.0
PAGE = (DOCS / "tutorial" / "2-own-mapping.md").read_text()


class Programs:
    """Programs that the reader starts, each in a terminal."""

    def __init__(self, stack: ExitStack, directory: Path) -> None:
        self._stack = stack
        self._directory = directory

    def start(self, *arguments: str) -> subprocess.Popen[str]:
        program = subprocess.Popen(
            [sys.executable, "-m", "gatewayd", *arguments],
            cwd=self._directory,
            env={"PYTHONPATH": str(DOCS.parent)},
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self._stack.callback(program.wait, PATIENCE)
        self._stack.callback(program.terminate)
        return program


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Programs]:
    with ExitStack() as stack:
        yield Programs(stack, tmp_path)


def test_tutorial_works(programs: Programs, tmp_path: Path) -> None:
    simulator = programs.start("simulate", "--program", "demo", "--port", "0")
    assert simulator.stdout is not None
    robot = re.search(r":(\d+)", simulator.stdout.readline())
    assert robot
    port = free_port(HOST)
    mapping = re.search(r"<!-- file: my-cell.yaml -->\n```yaml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    assert mapping
    text = mapping[1].replace("series: e", f"series: e\n  port: {robot[1]}").replace(":1502", f":{port}")
    (tmp_path / "my-cell.yaml").write_text(text)
    programs.start("run", "my-cell.yaml")
    client = ModbusTcpClient(HOST, port=port, retries=0)
    wait_for(client.connect)
    try:
        wait_for(lambda: client.read_holding_registers(60007, count=1).registers == [2])
        wait_for(lambda: not client.write_register(1, 42).isError())
        wait_for(lambda: client.read_holding_registers(101, count=2).registers == [0, 42])
        assert client.write_register(1, 5000).exception_code == 3
        assert any(client.read_holding_registers(110, count=12).registers)
        simulator.terminate()
        wait_for(lambda: client.read_holding_registers(60007, count=1).registers == [0])
        assert client.read_holding_registers(101, count=2).registers == [0, 0]
        assert client.write_register(1, 42).exception_code == 0x0B
    finally:
        client.close()  # type: ignore[no-untyped-call]


def wait_for(condition: object) -> None:
    assert callable(condition)
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it never came to be"
        time.sleep(0.05)
