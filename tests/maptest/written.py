"""Tests of a mapping, written as in a file, and what becomes of them."""

from __future__ import annotations

from gatewayd.mapping.loader import Loaded, load
from gatewayd.maptest.plant import Plant
from gatewayd.maptest.run import FileOutcome, run_file

MAPPING = """\
gatewayd: 1
cell: press-3
robot: {host: 192.0.2.10, stale_after: 200ms, adopt_for: 5s}
modbus: {listen: '192.0.2.2:1502'}
canopen: {channel: can0, bitrate: 500000, node: 16, heartbeat: 500ms}
writers:
  plc: {modbus: 192.0.2.20, timeout: 2s}
  hmi: {modbus: 192.0.2.21, timeout: 2s, grace: 1s}
  panel: {modbus: 192.0.2.22}
  line: {canopen: any, node: 1, heartbeat: 1s}
groups:
  motion: {owner: [plc, hmi], lease: 1.5s, whole: true}
variables:
  start: {robot: input_bit_register_0, modbus: 0.0, owner: plc}
  light: {robot: input_bit_register_40, modbus: 50.0, owner: panel, on_release: true}
  speed: {robot: input_double_register_0, modbus: 1, owner: [plc, hmi], lease: 5s, limits: [0, 100]}
  part: {robot: input_int_register_0, modbus: {holding: 60, type: uint16}, owner: any, on_release: hold, lease: 3s}
  clamp: {robot: input_double_register_1, modbus: 62, owner: plc, limits: [-1, 1], clamp: true}
  go: {robot: input_bit_register_32, modbus: 10.0, group: motion}
  target: {robot: input_int_register_1, modbus: 11, group: motion}
  belt: {robot: input_double_register_2, canopen: {type: REAL32}, owner: line}
  recipe: {robot: 'input_int_register_8..10', modbus: 20, owner: plc}
  cycles: {robot: output_int_register_0, modbus: 100, on_stale: hold}
  force: {robot: output_double_register_0, modbus: 110, on_stale: -1}
  busy: {robot: output_bit_register_0, modbus: 120.0, valid: running}
  state: {robot: runtime_state, modbus: {holding: 121, type: uint16}}
"""


def loaded(tests: str, mapping: str = MAPPING) -> Loaded:
    """The mapping with these lines below `tests:`."""
    lines = "".join(f"  {line}\n" for line in tests.strip("\n").splitlines())
    return load(f"{mapping}tests:\n{lines}".encode(), "cell.yaml")


def outcome(*steps: str) -> FileOutcome:
    """One test, called `it works`, of these steps, which must pass its check."""
    found = run_file(loaded("it works:\n" + "\n".join(f"  - {step}" for step in steps)))
    assert [finding.message for finding in found.errors] == []
    return found


def failures(*steps: str) -> list[str]:
    """What failed in such a test."""
    return [failure.message for one in outcome(*steps).outcomes for failure in one.failures]


def plant() -> Plant:
    """A plant of the mapping, without steps."""
    plan = loaded("nothing:\n  - {expect: {start: false}}").plan
    assert plan is not None
    return Plant(plan.cell)
