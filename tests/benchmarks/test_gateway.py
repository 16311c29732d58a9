"""The gateway in C serves what gatewayd serves: otherwise it would be no yardstick."""

from __future__ import annotations

import random
import struct
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial

import pytest

from gatewayd.rtde.fields import OUTPUTS
from tests.benchmarks.compiled import libmodbus_is_there
from tests.benchmarks.controller import Controller
from tests.benchmarks.image import INTEGERS_IN, STATE, WRITABLE, numbers
from tests.benchmarks.latency import fed
from tests.benchmarks.plc import Plc
from tests.benchmarks.servers import c_gateway, mapped_gateway
from tests.e2e.processes import wait_for

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not libmodbus_is_there(), reason="no C compiler with libmodbus's headers"),
]

Side = tuple[Controller, Plc]
OUTPUT_BLOCKS = ((200, 4), (210, 48), (300, 96), (396, 108), (504, 108), (612, 44))


@pytest.fixture
def sides() -> Iterator[tuple[Side, Side]]:
    """gatewayd and the gateway in C, each with a controller and a PLC of its own."""
    with ExitStack() as stack:
        found = []
        for start in (mapped_gateway, c_gateway):
            controller, served = stack.enter_context(fed(start))
            plc = Plc(served.port)
            stack.callback(plc.close)
            found.append((controller, plc))
        yield found[0], found[1]


def _feed(controllers: list[Controller]) -> None:
    """Random values of every output, the same for all of them; integers of the state are whole registers' worth."""
    source = random.Random(7)
    values: dict[str, tuple[float, ...]] = {
        f"output_bit_registers{words}": (source.getrandbits(32),) for words in ("0_to_31", "32_to_63")
    }
    for number in range(24):
        values[f"output_int_register_{number}"] = (source.randrange(-(2**31), 2**31),)
        values[f"output_double_register_{number}"] = (source.uniform(-9, 9),)
    for name in STATE:
        kind = OUTPUTS[name].type
        whole = kind.word not in ("DOUBLE", "VECTOR6D")
        values[name] = tuple(
            source.getrandbits(31) if whole else source.uniform(-9, 9) for _ in range(kind.count)
        )
    for controller in controllers:
        controller.values.update(values)
        controller.send()


def test_outputs_lie_at_the_same_registers(sides: tuple[Side, Side]) -> None:
    (own, plc), (other, c_plc) = sides
    for first, count in OUTPUT_BLOCKS:

        def same(first: int = first, count: int = count) -> bool:
            _feed([own, other])
            return plc.read(first, count) == c_plc.read(first, count) != bytes(2 * count)

        wait_for(same, f"the same registers from {first} on")


def test_a_write_goes_to_the_robot_as_the_same_package(sides: tuple[Side, Side]) -> None:
    (own, plc), (other, c_plc) = sides
    for controller, one in ((own, plc), (other, c_plc)):
        wait_for(partial(_takes_writes, controller, one), "writes to be accepted")
        one.write(INTEGERS_IN, numbers(WRITABLE, 3))

    def arrived() -> bool:
        for controller in (own, other):
            controller.pump(0.01)
            controller.send()
        return _inputs(own) == _inputs(other) and own.values.get("input_int_register_0") == (6,)

    wait_for(arrived, "the same inputs at both controllers")
    assert own.values["input_bit_registers0_to_31"] == (0x56781234,)


def _takes_writes(controller: Controller, plc: Plc) -> bool:
    """gatewayd does once it has read what the robot's inputs hold."""
    controller.pump(0)
    controller.send()
    try:
        plc.write(0, struct.pack(">4H", 0x1234, 0x5678, 0x9ABC, 0xDEF0))
    except RuntimeError:
        return False
    return True


def _inputs(controller: Controller) -> dict[str, tuple[float, ...]]:
    return {name: values for name, values in controller.values.items() if name.startswith("input_")}
