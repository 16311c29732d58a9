"""One cell with every kind of lock, policy and direction, on which the tests of the core stand."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import (
    CellDefinition,
    Direction,
    Fallback,
    FallbackKind,
    Limits,
    Lock,
    ValueKind,
    Variable,
    Writer,
)

PLC, HMI, AUX = range(3)
HOLD = Fallback(FallbackKind.HOLD)
LOW, HIGH = -(2.0**31), 2.0**31 - 1


def _variables() -> tuple[Variable, ...]:
    i, o = Direction.INPUT, Direction.OUTPUT
    b, n, r = ValueKind.BOOL, ValueKind.INT, ValueKind.FLOAT
    word = "input_bit_registers0_to_31"
    return (
        Variable(1, "start", i, b, word, bit=0, lock=0),
        Variable(2, "lamp", i, b, word, bit=1, lock=1),
        Variable(3, "part", i, n, "input_int_register_0", low=LOW, high=HIGH, on_release=HOLD, lock=2),
        Variable(
            4,
            "force",
            i,
            r,
            "input_double_register_0",
            limits=Limits(0.0, 150.0, clamp=True),
            on_release=Fallback(FallbackKind.VALUE, 10.0),
            lock=3,
        ),
        Variable(5, "speed", i, r, "input_double_register_1", limits=Limits(0.0, 1.0), lock=4),
        Variable(
            6,
            "path",
            i,
            n,
            "input_int_register_1",
            low=LOW,
            high=HIGH,
            on_release=Fallback(FallbackKind.VALUE, 7),
            lock=4,
        ),
        Variable(7, "cycles", o, n, "output_int_register_0", low=LOW, high=HIGH),
        Variable(8, "level", o, r, "output_double_register_0", on_stale=HOLD),
        Variable(
            9,
            "mode",
            o,
            n,
            "output_int_register_1",
            low=LOW,
            high=HIGH,
            on_stale=Fallback(FallbackKind.VALUE, 99),
        ),
        Variable(
            10,
            "alarm",
            o,
            b,
            "output_bit_registers0_to_31",
            bit=0,
            on_stale=Fallback(FallbackKind.EXCEPTION),
        ),
    )


@pytest.fixture
def press() -> CellDefinition:
    """Writers plc, hmi and aux (time-out 1 s); a fixed, two listed (one with takeover), a shared lock and a group."""
    return CellDefinition(
        name="press",
        fingerprint=0xC0FFEE42,
        variables=_variables(),
        locks=(
            Lock("start", (0,), (PLC,)),
            Lock("lamp", (1,), (PLC, HMI), takeover=True, lease=5.0),
            Lock("part", (2,), (PLC, HMI), lease=2.0),
            Lock("force", (3,), (PLC, HMI, AUX), lease=5.0),
            Lock("motion", (4, 5), (PLC, HMI, AUX), takeover=True, lease=2.0),
        ),
        writers=(Writer("plc"), Writer("hmi"), Writer("aux", timeout=1.0)),
        stale_after=0.1,
    )


@pytest.fixture
def connect() -> Callable[[Cell, float], None]:
    """Brings the robot up: a session, all inputs adopted as 0, one package with known values."""

    def up(cell: Cell, now: float) -> None:
        cell.robot_connected(now)
        cell.adopt({index: cell.definition.variables[index].kind.zero for index in range(6)}, now)
        assert cell.package_arrived(now, now)
        cell.image.values[6:10] = [5, 2.5, 3, True]
        cell.outputs_written(now)

    return up


@pytest.fixture
def cell(press: CellDefinition, connect: Callable[[Cell, float], None]) -> Cell:
    """The press with its robot up at time 0."""
    cell = Cell(press)
    connect(cell, 0.0)
    return cell
