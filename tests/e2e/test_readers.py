"""Many readers of the status listener beside a PLC: the fieldbus goes first."""

from __future__ import annotations

import time

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import PLC
from tests.e2e.processes import HOST, free_port, wait_for

CELL = f"""\
writers: {{plc: {{modbus: {PLC}, timeout: 10s}}}}
variables:
  number: {{robot: input_int_register_0,  modbus: 0, owner: plc}}
  bits:   {{robot: 'output_bit_register_0..63', modbus: 300.0}}
  words:  {{robot: 'output_int_register_0..23', modbus: 400}}
  reals:  {{robot: 'output_double_register_0..23', modbus: 500}}
"""
READERS = 30
SECONDS = 4.0
CYCLE = 0.005
"""Seconds between two requests of the PLC."""
QUICK = 0.01
"""Seconds for most answers: half of them took 0.02 to 0.04 when readers had no bound, on a machine that was idle."""


@pytest.mark.parametrize("path", ["/api/v1/variables", "/metrics"])
def test_a_plc_beside_thirty_readers_is_answered_and_nothing_is_stale(plant: Plant, path: str) -> None:
    simulator, port = plant.simulator(), free_port()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port), "--status", f"{HOST}:{port}")
    plc = plant.ready_plc()
    wait_for(lambda: bool(daemon.lines("status page")), "the status page")
    readers = plant.start("http_readers", HOST, port, path, READERS, str(SECONDS)).popen
    assert readers.stdout is not None
    times: list[float] = []
    assert readers.stdout.readline() == "begun\n"
    while readers.poll() is None:
        asked = time.monotonic()
        assert plc.write_integers(0, len(times)) == 0
        times.append(time.monotonic() - asked)
        time.sleep(CYCLE)
    assert int(readers.stdout.readline()) > 2 * READERS, "they are served, only later"
    assert sorted(times)[len(times) // 2] < QUICK
    assert not daemon.lines("robot values stale")
    assert not daemon.lines("writer lost")
