"""No value is ever mixed, no block of two moments, in either direction, under as much load as there can be.

GATEWAYD_TORN_READS scales it: block reads of each of the two readers.
"""

from __future__ import annotations

import os

import pytest

from tests.e2e.hammer import DOUBLES, INTEGERS
from tests.e2e.plant import Plant
from tests.e2e.plc import PLC, STRANGER
from tests.e2e.processes import HOST, Process, wait_for

READS = int(os.environ.get("GATEWAYD_TORN_READS", "100000"))
INPUTS, OUTPUTS = 0, 500
DOUBLE_INPUTS = INPUTS + 2 * INTEGERS

CELL = f"""\
writers: {{plc: {{modbus: {PLC}, grace: 1min}}}}
variables:
  ints:    {{robot: input_int_register_0..{INTEGERS - 1},     modbus: {INPUTS}}}
  doubles: {{robot: input_double_register_0..{DOUBLES - 1},   modbus: {DOUBLE_INPUTS}}}
  told:    {{robot: output_double_register_0..{DOUBLES - 1},  modbus: {OUTPUTS}}}
"""
PROGRAM = "; ".join(f"output_double_register_{number} = timestamp" for number in range(DOUBLES))
"""All doubles change together in every control cycle."""


def finish(process: Process) -> list[str]:
    """End its input; the words of its result."""
    assert process.popen.stdin is not None
    process.popen.stdin.close()
    words = process.answer().split()
    assert words[:1] != ["torn:"], " ".join(words)
    return words


@pytest.mark.timeout(120 + READS // 1000)
def test_nothing_is_ever_torn(plant: Plant) -> None:
    simulator = plant.simulator("--program", PROGRAM, frequency=500)
    plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    sampler = plant.start("sampler", HOST, simulator.port)
    assert sampler.answer() == "sampling"
    writer = plant.start("hammer", HOST, plant.modbus, PLC, "write", INPUTS)
    readers = [
        plant.start("hammer", HOST, plant.modbus, STRANGER, "read", address, READS)
        for address in (OUTPUTS, DOUBLE_INPUTS)
    ]

    reads = [finish(reader) for reader in readers]
    written = finish(writer)
    last = int(written[1])
    wait_for(lambda: simulator.integer("input_int_register_0") == last, "the last value in the robot")
    assert plc.integers(INPUTS, INTEGERS) == [last] * INTEGERS
    assert plc.doubles(DOUBLE_INPUTS, DOUBLES) == [float(last)] * DOUBLES
    sampled = finish(sampler)

    for what, words in zip(("outputs", "inputs"), reads, strict=True):
        print(f"{what}:", *words)
        assert int(words[0]) == READS
        assert int(words[2]) > READS / 2000, "the values changed meanwhile"
    print("writes:", *written, "sampled by a second RTDE client:", *sampled)
    assert int(sampled[0]) > 100
    assert int(sampled[2]) > 50, "the sampler saw values change"
