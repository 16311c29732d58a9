"""Every reserved register both ways: PLC -> gateway -> robot -> robot program -> gateway -> PLC, bit for bit."""

from __future__ import annotations

import math
import struct

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import NO_VALUE, PLC, Plc
from tests.e2e.processes import Simulator, wait_for

FULL = f"""\
writers: {{plc: {{modbus: {PLC}}}}}
variables:
  bits_in:     {{robot: input_bit_register_0..63,     modbus: [0.0, {{coil: 0}}]}}
  ints_in:     {{robot: input_int_register_0..23,     modbus: 100}}
  doubles_in:  {{robot: input_double_register_0..23,  modbus: 200}}
  bits_out:    {{robot: output_bit_register_0..63,    modbus: [1000.0, {{discrete: 0}}]}}
  ints_out:    {{robot: output_int_register_0..23,    modbus: 1100}}
  doubles_out: {{robot: output_double_register_0..23, modbus: 1200}}
"""

INTEGERS = [-(2**31), 2**31 - 1, -1, 0, 1, 0x12345678, -0x12345678, 0x0000FFFF, 0x00010000, -0x8000]
DOUBLES = [
    1.7976931348623157e308,
    -1.7976931348623157e308,
    2.2250738585072014e-308,
    5e-324,
    -5e-324,
    0.0,
    -0.0,
    0.1,
    math.pi,
    -1e-300,
    math.inf,
    -math.inf,
    math.nan,
]


def images(values: list[float]) -> list[bytes]:
    """Doubles as bytes, so that -0.0 is not 0.0 and NaN is NaN."""
    return [struct.pack(">d", value) for value in values]


def connect(plant: Plant) -> tuple[Simulator, Plc]:
    simulator = plant.simulator()
    plant.daemon(plant.mapping(FULL, simulator.port))
    return simulator, plant.ready_plc()


def test_every_register_goes_to_the_robot_and_comes_back(plant: Plant) -> None:
    simulator, plc = connect(plant)

    integers = [(number + 1) * 0x01010101 * (-1) ** number % 2**31 for number in range(24)]
    integers[: len(INTEGERS)] = INTEGERS
    doubles = [(number + 1) * 1.1 for number in range(24)]
    doubles[: len(DOUBLES)] = DOUBLES
    assert plc.write(0, [0x8001, 0x1234, 0xFFFF, 0xA55A]) == 0
    assert plc.write_integers(100, *integers) == 0
    assert plc.write_doubles(200, *doubles) == 0
    wait_for(lambda: plc.doubles(1292) == [doubles[-1]], "the last double to come back")

    assert plc.read(1000, 4) == [0x8001, 0x1234, 0xFFFF, 0xA55A]
    assert plc.discrete(0, 64) == [bool(0xA55AFFFF12348001 >> bit & 1) for bit in range(64)]
    assert plc.coils(0, 64) == plc.discrete(0, 64)
    assert plc.integers(1100, 24) == plc.integers(100, 24) == integers
    assert images(plc.doubles(1200, 24)) == images(plc.doubles(200, 24)) == images(doubles)
    assert simulator.integer("input_bit_registers0_to_31") == 0x12348001
    assert simulator.integer("input_bit_registers32_to_63") == 0xA55AFFFF
    assert [simulator.integer(f"input_int_register_{n}") for n in range(24)] == integers
    assert images([simulator.number(f"input_double_register_{n}") for n in range(24)]) == images(doubles)


def test_every_bit_is_a_bit_of_its_own(plant: Plant) -> None:
    """Each of the 64 coils alone reaches its own bit of the robot and comes back as its own discrete input."""
    simulator, plc = connect(plant)

    for bit in range(64):
        assert plc.write_coils(bit, [True]) == 0
        wait_for(lambda bit=bit: plc.discrete(bit, 1) == [True], f"bit {bit}")  # type: ignore[misc]
        lit = [number for number, on in enumerate(plc.discrete(0, 64)) if on]
        assert lit == [bit]
        assert plc.write_coils(bit, [False]) == 0
        wait_for(lambda bit=bit: plc.discrete(bit, 1) == [False], f"bit {bit} to go")  # type: ignore[misc]
    assert simulator.integer("input_bit_registers0_to_31") == 0


ORDERS = {"ABCD": "01020304", "CDAB": "03040102", "BADC": "02010403", "DCBA": "04030201"}
"""0x01020304 on the wire."""


def test_order_type_and_scale_on_the_wire(plant: Plant) -> None:
    """The four orders, and a scaled 16-bit view of a double; out of its type or limits is 03."""
    simulator = plant.simulator()
    numbers = "".join(
        f"  {order.lower()}: {{robot: input_int_register_{n}, modbus: {{holding: {2 * n}, order: {order}}}}}\n"
        for n, order in enumerate(ORDERS)
    )
    placed = "modbus: {holding: 10, type: int16, scale: 0.1}"
    force = f"  force: {{robot: input_double_register_3, {placed}, limits: [0, 150]}}"
    plant.daemon(
        plant.mapping(f"writers: {{plc: {{modbus: {PLC}}}}}\nvariables:\n{numbers}{force}\n", simulator.port)
    )
    plc = plant.ready_plc()

    assert plc.write(0, list(struct.unpack(">8H", bytes.fromhex("".join(ORDERS.values()))))) == 0
    assert plc.write_one(10, 1234) == 0
    wait_for(lambda: simulator.number("input_double_register_3") != 0, "the scaled value")
    assert [simulator.integer(f"input_int_register_{n}") for n in range(4)] == [0x01020304] * 4
    assert simulator.number("input_double_register_3") == pytest.approx(123.4)
    assert plc.write_one(10, 1501) == NO_VALUE
    assert plc.write_one(10, 0xFFFF) == NO_VALUE
    assert plc.read(10) == [1234]
