"""What passes the links of a real daemon, as somebody who traces it sees it; and what a first day's mistakes leave."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import PLC
from tests.e2e.processes import wait_for

CELL = f"""\
canopen: {{interface: virtual, channel: trace, bitrate: 500000, node: 16, heartbeat: 100ms}}
writers:
  plc: {{modbus: {PLC}}}
variables:
  number: {{robot: input_int_register_0,  modbus: 0, owner: plc}}
  echo:   {{robot: output_int_register_0, modbus: 100, canopen: auto}}
"""
Row = dict[str, Any]


def rows(path: Path) -> list[Row]:
    """What was traced, without a line that is still being written."""
    text = path.read_text() if path.exists() else ""
    return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]


@pytest.fixture
def socket(plant: Plant) -> Path:
    simulator = plant.simulator(frequency=20)
    socket = plant.directory / "control.sock"
    daemon = plant.daemon(plant.mapping(CELL, simulator.port), "--control", socket)
    daemon.wait_for_line("listening for control")
    return socket


def traced(socket: Path) -> list[str | Path]:
    """The command, with lines of JSON."""
    return [sys.executable, "-m", "gatewayd", "trace", "--socket", socket, "--format", "json"]


def test_all_links_are_traced_in_words(plant: Plant, socket: Path) -> None:
    plc = plant.ready_plc()
    wrong = plant.plc(unit=7)
    path = plant.directory / "trace.json"
    command = [*traced(socket), "-o", path]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as trace:
        wait_for(lambda: bool(rows(path)), "the trace to begin")
        assert plc.integers(100) == [0]
        assert plc.write_integers(0, 7) == 0
        assert plc.reading_code(98) == 2
        assert wrong.reading_code(100) == 0x0B

        def texts(link: str) -> list[str]:
            return [row["text"] for row in rows(path) if row["link"] == link]

        wait_for(lambda: any("unit 7" in text for text in texts("modbus")), "the last request")
        modbus = texts("modbus")
        for text in (
            "unit 1: read holding 100-101",
            "unit 1: holding 100-101 = 0 0",
            "unit 1: write holding 0-1 = 0 7",
            "unit 1: written holding 0-1",
            "unit 1: refused with 02h illegal data address: function 3 (read holding registers)",
        ):
            assert text in modbus
        wait_for(
            lambda: (
                "710h heartbeat of node 16: pre-operational" in texts("canopen")
                and any(row["out"] and row["text"].startswith("data of recipe") for row in rows(path))
            ),
            "frames of the node, and what went to the robot",
        )
        assert {row["cell"] for row in rows(path) if "unit 7" in row["text"]} == {None}
        trace.send_signal(signal.SIGINT)
        trace.wait(20)
    plc.close()
    wrong.close()
    events = subprocess.run(
        [sys.executable, "-m", "gatewayd", "events", "--socket", socket],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert "plc asked unit 7; units here: 1" in events
    assert "plc read holding 98: 98 is not mapped; nearest: echo 100" in events


def test_what_is_not_wanted_is_left_out(plant: Plant, socket: Path) -> None:
    command = traced(socket)
    done = subprocess.run(
        [*command, "--link", "canopen", "--count", "3"],
        capture_output=True,
        text=True,
        check=True,
        timeout=30,
    )
    assert {json.loads(line)["kind"] for line in done.stdout.splitlines()} == {"canopen"}
    assert plant.directory.exists()
