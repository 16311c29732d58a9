"""The robot's side of a cell as errors of the node."""

from __future__ import annotations

import math

import pytest

from gatewayd.canopen.emergency import Emergency, ErrorCode
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, ValueKind, Variable
from gatewayd.links.canopen_node.robot_errors import FIRST_CONNECTION, QUIET, RobotErrors
from tests.links.canopen_node.wire import Client, Wire


class Bench:
    """A cell of two outputs, and what is reported of it on the bus."""

    def __init__(self) -> None:
        self.now = 0.0
        self.wire = Wire()
        variables = tuple(
            Variable(number, f"v{number}", Direction.OUTPUT, ValueKind.INT, f"output_int_register_{number}")
            for number in (1, 2)
        )
        self.cell = Cell(CellDefinition("test", 1, variables, (), (), 0.1))
        self.emergency = Emergency(self.wire.send, 5, lambda: True)
        self.client = Client(self.emergency.objects())
        self.running = True
        self.errors = RobotErrors(self.cell, self.emergency, lambda: self.running)

    def well(self) -> None:
        self.cell.robot_connected(self.now)
        self.package()

    def package(self) -> None:
        self.cell.package_arrived(1.0 + self.now, self.now)
        self.cell.outputs_written(self.now)

    def look(self, seconds: float = 0.0) -> list[str]:
        """What is reported when the cell is looked at so much later: code, register, data."""
        self.now += seconds
        self.errors.tick(self.now)
        return [
            f"{int.from_bytes(frame.data[:2], 'little'):04X} {frame.data[2]:02X} {frame.data[3:5].hex()}"
            for frame in self.wire.take()
        ]


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.well()
    return bench


def test_a_cell_that_is_well_tells_nothing(bench: Bench) -> None:
    assert bench.look() == []
    assert bench.errors.next_deadline(0.0) == math.inf


def test_a_lost_robot_is_an_error_until_its_packages_are_back(bench: Bench) -> None:
    bench.cell.robot_lost("cable", 0.0)
    assert bench.look() == ["FF10 81 0000"]
    bench.cell.robot_connected(0.0)
    assert bench.look(9.0) == [], "connected is not yet well"
    bench.package()
    assert bench.look() == []
    assert bench.errors.next_deadline(bench.now) == bench.now + QUIET
    assert bench.look(QUIET) == ["0000 00 0000"]


def test_a_robot_that_was_never_there_is_missed_after_a_while() -> None:
    bench = Bench()
    assert bench.look() == []
    assert bench.errors.next_deadline(0.0) == FIRST_CONNECTION
    assert bench.look(FIRST_CONNECTION) == ["FF10 81 0000"]
    assert bench.errors.next_deadline(bench.now) == math.inf


def test_stale_values_are_another_error(bench: Bench) -> None:
    bench.cell.tick(0.2)
    assert bench.look(0.2) == ["FF11 81 0300"]
    bench.package()
    assert bench.look(QUIET / 2) == []
    assert bench.look(QUIET / 2) == []
    assert bench.look(QUIET / 2) == ["0000 00 0000"]


def test_read_back_and_registers_are_counted(bench: Bench) -> None:
    bench.cell.health.differing = 3
    assert bench.look() == ["FF12 81 0300"]
    bench.cell.set_availability([0, 1], available=False, reason="taken", now=0.0)
    assert bench.look() == ["FF13 81 0200"]
    bench.cell.health.differing = 0
    bench.look()
    assert bench.look(QUIET) == [], "one is left"
    assert not bench.emergency.active(ErrorCode.ROBOT_DIFFERS)
    bench.cell.set_availability([0, 1], available=True, reason="given", now=0.0)
    bench.look()
    assert bench.look(QUIET) == ["0000 00 0000"]


@pytest.mark.parametrize("inhibit", [0, 50_000])
def test_what_comes_and_goes_is_reported_once(bench: Bench, inhibit: int) -> None:
    bench.client.write(0x1015, 0, inhibit)
    quiet = max(QUIET, inhibit / 10_000)
    reported = []
    for _ in range(100):
        bench.cell.robot_lost("cable", bench.now)
        reported += bench.look(quiet * 0.4)
        bench.well()
        reported += bench.look(quiet * 0.4)
    assert reported == ["FF10 81 0000"]
    reported = bench.look(quiet)
    assert reported == ["0000 00 0000"]


def test_after_a_reset_what_is_still_wrong_is_reported_again(bench: Bench) -> None:
    bench.cell.robot_lost("cable", 0.0)
    bench.look()
    bench.emergency.restart(forget=True)
    bench.running = False
    assert bench.look() == []
    bench.running = True
    assert bench.look() == ["FF10 81 0000"]
