"""What a reload would take from the promises of the running mapping."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gatewayd.core.definition import CellDefinition
from gatewayd.mapping.loader import load
from gatewayd.report.weakening import weakened

TEXT = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1, adopt_for: 10s, stale_after: 200ms}
modbus: {listen: '127.0.0.1:1502'}
canopen: {channel: can0, interface: virtual, bitrate: 500000, node: 16}
writers:
  plc:  {modbus: 127.0.0.2, timeout: 1s, timeout_counts: writes, grace: 1s}
  line: {canopen: any, node: 3, heartbeat: 500ms}
groups:
  move: {owner: [line, plc], lease: 2s, whole: true}
variables:
  to:    {robot: input_int_register_0, modbus: 40, group: move, canopen: auto}
  go:    {robot: input_bit_register_1, modbus: 42.0, group: move, canopen: auto}
  start: {robot: input_bit_register_0, modbus: 0.0, owner: plc}
  force: {robot: input_double_register_0, modbus: 20, owner: [plc, line], canopen: auto, limits: [0, 150]}
  free:  {robot: input_double_register_1, modbus: 24, owner: plc}
  count: {robot: output_int_register_0, modbus: 100, on_stale: exception, valid: running}
"""


def definition(text: str) -> CellDefinition:
    plan = load(text.encode(), "cell.yaml").plan
    assert plan is not None
    return plan.cell


@pytest.mark.parametrize(
    "before, after, found",
    [
        ("timeout: 1s,", "timeout: 2s,", "the loss of `plc` would be noticed later: timeout 1 s -> 2 s"),
        (
            "timeout: 1s, timeout_counts: writes,",
            "",
            "the loss of `plc` would be noticed later: timeout 1 s -> none",
        ),
        (
            " timeout_counts: writes,",
            "",
            "the loss of `plc` would be noticed later: reads would feed its timeout too",
        ),
        (
            "grace: 1s",
            "grace: 3s",
            "`plc` would keep its locks without a connection: grace 1 s -> 3 s",
        ),
        (
            "heartbeat: 500ms",
            "heartbeat: 2s",
            "the loss of `line` would be noticed later: heartbeat 0.5 s -> 2 s",
        ),
        (", limits: [0, 150]", "", "`force` could be written beyond its limits: 0..150 -> none"),
        ("[0, 150]", "[-5, 150]", "`force` could be written beyond its limits: 0..150 -> -5..150"),
        ("lease: 2s", "lease: 3s", "`move` would be kept longer for a silent owner: lease 2 s -> 3 s"),
        ("lease: 2s", "lease: none", "`move` would be kept longer for a silent owner: lease 2 s -> none"),
        (", whole: true", "", "`move` could be taken over in part"),
        ("adopt_for: 10s", "adopt_for: none", "adopted values would be kept longer: adopt_for 10 s -> none"),
        ("24, owner: plc", "24, owner: [plc, line]", "`free` could be owned by line too"),
        ("owner: [line, plc]", "owner: [plc, line]", "`line` could no longer take `move` over from `plc`"),
        (
            "[plc, line], canopen",
            "[plc, line], takeover: false, canopen",
            "`plc` could no longer take `force` over from `line`",
        ),
        (
            "limits: [0, 150]",
            "limits: [0, 150], clamp: true",
            "`force` would be brought to its limits where it is refused today: clamp",
        ),
        (
            "24, owner: plc",
            "24, owner: plc, on_release: hold",
            "`free` would hold its value: on_release hold",
        ),
        ("on_stale: exception", "on_stale: hold", "`count` would hold its value: on_stale hold"),
        (", valid: running", "", "`count` would be good while the robot program does not run: valid"),
        ("stale_after: 200ms", "stale_after: 1s", "values would be stale later: stale_after 0.2 s -> 1 s"),
    ],
)
def test_a_weaker_promise_is_named(before: str, after: str, found: str) -> None:
    old = definition(TEXT)
    new = definition(TEXT.replace(before, after))
    assert found in list(weakened(old, new))
    if "take `move` over" not in found:
        assert list(weakened(new, old)) == [], "the other way round it is stronger"


def test_what_is_new_or_gone_weakens_nothing() -> None:
    old = definition(TEXT)
    less = "".join(line for line in TEXT.splitlines(keepends=True) if "force:" not in line)
    new = definition(less + "  more: {robot: input_double_register_2, modbus: 30}\n")
    assert list(weakened(old, new)) == []


def test_inputs_that_are_adopted_instead_of_cleared_are_named() -> None:
    new = definition(TEXT.replace("adopt_for: 10s", "adopt_for: none"))
    old = replace(new, clear_on_connect=True)
    assert list(weakened(old, new)) == [
        "inputs without an owner would keep what the controller holds: on_connect adopt"
    ]
