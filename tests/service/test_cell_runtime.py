"""A cell with its links, and what of them goes on with another plan."""

from __future__ import annotations

from pathlib import Path

from gatewayd.canopen.bus import BusState
from gatewayd.core.requester import Requester
from gatewayd.links.canopen_node.runtime import CanLink
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan
from gatewayd.service.cell_runtime import CellRuntime

TEXT = """\
gatewayd: 1
cell: a
robot: {host: 127.0.0.1, port: 9}
writers: {line: {canopen: any}}
%s
variables:
  one: {robot: input_int_register_0, canopen: %s, owner: line}
  two: {robot: output_int_register_0, canopen: %s, on_stale: %s}
"""
CAN = "canopen: {interface: virtual, channel: none, bitrate: 500000, node: 16}"


def plan(stale: str = "clear", placed: str = "auto") -> Plan:
    loaded = load((TEXT % (CAN, placed, placed, stale)).encode(), "a.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def without_can() -> Plan:
    text = "gatewayd: 1\ncell: a\nrobot: {host: 127.0.0.1, port: 9}\nvariables: {x: {robot: output_int_register_0}}\n"
    loaded = load(text.encode(), "a.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def can_of(runtime: CellRuntime) -> CanLink:
    link = runtime.links["canopen"]
    assert isinstance(link, CanLink)
    return link


def test_a_cell_without_canopen_has_the_robot_alone(tmp_path: Path) -> None:
    runtime = CellRuntime(without_can(), tmp_path, 0.0)
    assert runtime.links == {"robot": runtime.source}


def test_a_cell_with_canopen_has_both_links(tmp_path: Path) -> None:
    runtime = CellRuntime(plan(), tmp_path, 0.0)
    assert runtime.links == {"robot": runtime.source, "canopen": can_of(runtime)}


def test_a_cell_is_reachable_while_its_bus_carries_frames_and_always_without_a_fieldbus(
    tmp_path: Path,
) -> None:
    runtime = CellRuntime(plan(), tmp_path, 0.0)
    found = {}
    for state in BusState:
        can_of(runtime).node.bus = state
        found[state] = runtime.reachable
    assert {state for state, on in found.items() if on} == {
        BusState.PASSIVE,
        BusState.WARNING,
        BusState.ACTIVE,
    }
    assert CellRuntime(without_can(), tmp_path, 0.0).reachable


def test_another_policy_goes_on_with_values_and_node(tmp_path: Path) -> None:
    runtime = CellRuntime(plan(), tmp_path, 0.0)
    cell, can = runtime.cell, can_of(runtime)
    cell.image.values[0] = 7
    runtime.succeed(plan(stale="hold"), 1.0)
    assert runtime.cell is not cell
    assert runtime.cell.image.values[0] == 7
    assert can_of(runtime) is can
    assert cell.listeners == []


def test_other_objects_need_another_node(tmp_path: Path) -> None:
    """Its dictionary is that of one mapping: it boots, and who wrote on the former one is lost."""
    runtime = CellRuntime(plan(), tmp_path, 0.0)
    can = can_of(runtime)
    runtime.cell.writer_connected(Requester(0), 0.5)
    runtime.succeed(plan(placed="object"), 1.0)
    assert can_of(runtime) is not can


def test_canopen_can_be_taken_away(tmp_path: Path) -> None:
    runtime = CellRuntime(plan(), tmp_path, 0.0)
    runtime.succeed(without_can(), 1.0)
    assert runtime.links.keys() == {"robot"}
