"""A listener that everybody wants: undeclared readers, the declared PLC, and what the log says of it."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import BUSY, HMI, NO_ADDRESS, PLC, STRANGER, Plc
from tests.e2e.processes import HOST, wait_for

CELL = f"""\
writers:
  plc: {{modbus: {PLC}, timeout: none}}
  hmi: {{modbus: {HMI}, timeout: none}}
variables:
  start: {{robot: input_bit_register_0, modbus: 0.0, owner: plc}}
  stop:  {{robot: input_bit_register_1, modbus: 0.1, owner: [hmi, plc]}}
  part:  {{robot: input_int_register_0, modbus: {{holding: 10, type: uint16}}, owner: [plc, hmi]}}
  door:  {{robot: output_bit_register_0, modbus: {{discrete: 5}}, on_stale: exception}}
  count: {{robot: output_int_register_0, modbus: 100, on_stale: exception}}
"""
READ = bytes.fromhex("0001 0000 0006 01 03 ea60 0001")


class Pollers:
    """Connections of one undeclared reader that ask all the time, and come again when they are shown out."""

    def __init__(self, port: int, number: int) -> None:
        self._address = (HOST, port)
        self._ending = threading.Event()
        self.answers = [0] * number
        self.refusals = [0] * number
        self._threads = [threading.Thread(target=self._poll, args=(index,)) for index in range(number)]
        for thread in self._threads:
            thread.start()

    def _poll(self, index: int) -> None:
        while not self._ending.is_set():
            try:
                with socket.create_connection(self._address, 5, (STRANGER, 0)) as connection:
                    while not self._ending.wait(0.01):
                        connection.sendall(READ)
                        if not connection.recv(300):
                            break
                        self.answers[index] += 1
            except OSError:
                pass
            self.refusals[index] += 1
            self._ending.wait(0.05)

    def end(self) -> None:
        self._ending.set()
        for thread in self._threads:
            thread.join()


@pytest.fixture
def pollers_of() -> Iterator[list[Pollers]]:
    """Ended after the test, whatever became of it."""
    started: list[Pollers] = []
    yield started
    for pollers in started:
        pollers.end()


def test_a_reader_with_32_polling_connections_keeps_nobody_out(
    plant: Plant, pollers_of: list[Pollers]
) -> None:
    """Of 20 attempts of the PLC every one succeeds, and another reader is served too."""
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    pollers = Pollers(plant.modbus, 32)
    pollers_of.append(pollers)
    wait_for(
        lambda: sum(map(bool, pollers.answers)) >= 16 and sum(pollers.refusals) > 32, "the reader's share"
    )
    for _ in range(20):
        plc = Plc(plant.modbus)
        assert plc.status(0) == 1
        plc.close()
    other = plant.plc("127.0.0.10")
    assert other.status(26) <= 18
    assert plant.ready_plc(HMI).write_one(10, 7) == 0
    crowded = daemon.lines("too many connections of one peer")
    assert len(crowded) == 1, "merged"
    assert f"peer={STRANGER}:" in crowded[0]


def test_blocks_that_meet_gaps_can_be_read_and_written(plant: Plant) -> None:
    simulator = plant.simulator()
    daemon = plant.daemon(
        plant.mapping(CELL, simulator.port, modbus_options=", gaps: zero, write_gaps: ignore")
    )
    plc = plant.ready_plc()
    assert plc.read(0, 125)[10] == 0
    assert plc.read(59_875, 125) == [0] * 125
    assert plc.discrete(0, 2000) == [False] * 2000
    assert plc.write(0, [0x8001, *[3] * 9, 42, *[5] * 9]) == 0
    assert plc.read(0, 11) == [1, *[0] * 9, 42]
    assert plc.write(11, [1, 2, 3]) == NO_ADDRESS, "nothing mapped"
    assert plc.write(59_999, [0, 0]) == NO_ADDRESS, "the status block is no gap"
    assert plc.write(99, [0, 0, 0, 0]) == NO_ADDRESS, "a value of the robot is no gap"
    assert daemon.running


def test_the_default_unit_and_the_answer_for_a_robot_away_are_those_of_the_cell(plant: Plant) -> None:
    left, right = plant.simulator(), plant.simulator()
    options = ", default_unit: true, robot_away: busy"
    plant.daemon(
        plant.mapping(CELL, left.port, name="left", unit=1),
        plant.mapping(CELL, right.port, name="right", unit=2, modbus_options=options),
    )
    for unit in (255, 0):
        assert plant.ready_plc(unit=unit).write_one(10, 7) == 0
    assert [plant.ready_plc(unit=unit).read(10) for unit in (1, 2)] == [[0], [7]]
    right.kill()
    default = plant.plc(unit=255)
    wait_for(lambda: default.robot_state == 0, "the robot to be lost")
    assert default.write_one(10, 8) == BUSY
    assert default.reading_code(100, 2) == BUSY
