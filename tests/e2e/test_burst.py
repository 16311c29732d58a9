"""Packages that come together, in one segment of TCP: every one of them passes the gateway, in order."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from tests.benchmarks.controller import Controller, Values
from tests.e2e.can_plant import start_bus
from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, free_port, wait_for

BITS, INTEGERS = 0x190, 0x290
"""COB-IDs of the TPDOs."""
MAPPING = f"""\
canopen:
  interface: slcan
  channel: 'socket://{HOST}:{{port}}'
  bitrate: 1000000
  node: 16
  autostart: true
  heartbeat: none
variables:
  pulse:   {{{{robot: output_bit_register_0, modbus: 0.0, canopen: auto}}}}
  counter: {{{{robot: output_int_register_0, modbus: 1,   canopen: auto}}}}
"""


class Listener:
    """Hears a bus."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection((HOST, port), 5)
        self._socket.setblocking(False)
        self._data = b""

    def frames(self, can_id: int) -> list[int]:
        """What the frames of an identifier said so far, as numbers."""
        while True:
            try:
                self._data += self._socket.recv(65536)
            except BlockingIOError:
                break
        lines = [
            line for line in self._data.decode("ascii").split("\r")[:-1] if line.startswith(f"t{can_id:03X}")
        ]
        return [int.from_bytes(bytes.fromhex(line[5:]), "little") for line in lines]

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def robot() -> Iterator[Controller]:
    controller = Controller(free_port(), HOST)
    yield controller
    controller.close()


def test_a_pulse_of_one_package_and_every_count_reach_both_buses(plant: Plant, robot: Controller) -> None:
    _, port = start_bus(plant)
    listener = Listener(port)
    plant.daemon(plant.mapping(MAPPING.format(port=port), robot.port), "--state", plant.directory)
    robot.wait_for_start()
    plc = plant.plc()

    def fresh() -> bool:
        robot.pump(0)
        robot.values["output_int_register_0"] = (1,)
        robot.send()
        return plc.integers(1) == [1] and listener.frames(INTEGERS)[-1:] == [1]

    wait_for(fresh, "the first value on both buses")
    before = len(listener.frames(BITS))
    counts: list[Values] = [{"output_int_register_0": (count,)} for count in range(2, 34)]
    counts[20]["output_bit_registers0_to_31"] = (1,)
    counts[21]["output_bit_registers0_to_31"] = (0,)
    robot.burst(counts, 1e-6)
    wait_for(lambda: listener.frames(INTEGERS)[-1] == 33, "the last count")
    assert listener.frames(INTEGERS)[-33:] == list(range(1, 34))
    assert listener.frames(BITS)[before:] == [1, 0]
    assert plc.integers(1) == [33]
    listener.close()
