"""With which plans a node goes on, and what its peers could rely on less."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.links.canopen_node.continuity import goes_on, weakened
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan

TEXT = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.9}
canopen:
  channel: can0
  bitrate: 500000
  node: 5
  heartbeat: 500ms
  cob_ids: {tpdo: 0x1A0..0x1A3, rpdo: 0x220..0x223}
  pdos:
    command: {cob_id: 0x205, deadline: 300ms, variables: [speed]}
    report: {cob_id: 0x185, inhibit: 10ms, variables: [count]}
writers: {line: {canopen: rpdo, node: 7, heartbeat: 500ms}}
variables:
  speed: {robot: input_int_register_1, owner: line, canopen: {pdo: command}}
  count: {robot: output_int_register_0, canopen: {pdo: report}}
  level: {robot: output_double_register_0, canopen: object}
"""
AFTER = "  more: {robot: %s, %s}\n"


def plan(*replaced: tuple[str, str], more: str = "") -> Plan:
    text = TEXT
    for old, new in replaced:
        assert old in text
        text = text.replace(old, new)
    loaded = load((text + more).encode(), "press.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def ask(function: Any, old: Plan, new: Plan) -> Any:
    plans = old.the(CanopenPlan), new.the(CanopenPlan)
    return list(function(*plans)) if function is weakened else function(*plans, old.cell, new.cell)


@pytest.mark.parametrize(
    "new, expected",
    [
        (plan(), True),
        (plan(more=AFTER % ("output_int_register_1", "canopen: auto")), True),
        (plan(more=AFTER % ("output_int_register_1", "canopen: {pdo: report}")), True),
        (plan(more=AFTER % ("input_int_register_2", "owner: line, canopen: auto")), True),
        (plan(more=AFTER % ("input_int_register_2", "owner: line, canopen: {pdo: command}")), False),
        (plan(("variables: [count]", "status: [flags], variables: [count]")), False),
        (plan(("canopen: object", "canopen: auto")), True),
        (plan(("  level: {robot: output_double_register_0, canopen: object}\n", "")), False),
        (plan(("heartbeat: 500ms\n", "autostart: true\n  heartbeat: 1s\n")), True),
        (plan(("node: 7, heartbeat: 500ms", "node: 7, heartbeat: 1s")), True),
        (plan(("node: 7", "node: 8")), False),
        (plan(("300ms", "200ms"), ("inhibit: 10ms", "inhibit: 20ms, event: 1s")), True),
        (plan(("0x185", "0x1A0")), False),
        (plan(("inhibit: 10ms", "transmission: sync")), False),
        (plan(("bitrate: 500000", "bitrate: 250000")), False),
        (plan(("canopen: rpdo", "canopen: any")), False),
    ],
)
def test_a_node_goes_on_where_its_peers_need_not_care(new: Plan, expected: bool) -> None:
    assert ask(goes_on, plan(), new) is expected


def test_an_object_that_moves_is_another_one() -> None:
    first = AFTER % ("output_int_register_1", "canopen: object")
    assert ask(goes_on, plan(), plan(("  count:", first + "  count:"))) is False


def test_longer_times_are_weaker_and_shorter_ones_are_not() -> None:
    longer = plan(("heartbeat: 500ms\n", "heartbeat: 1s\n"), ("300ms", "400ms"))
    assert ask(weakened, plan(), longer) == [
        "the loss of node 5 would be noticed later: heartbeat 500 ms -> 1000 ms",
        "the loss of RPDO 1 would be noticed later: deadline 300 ms -> 400 ms",
    ]
    assert ask(weakened, longer, plan()) == []
    none = plan(("heartbeat: 500ms\n", "heartbeat: none\n"), (" deadline: 300ms,", ""))
    assert [text.rpartition(" -> ")[2] for text in ask(weakened, plan(), none)] == ["none", "none"]
    assert ask(weakened, none, plan()) == []
