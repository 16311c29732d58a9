"""A cell with its links, and what of them goes on with another plan."""

from __future__ import annotations

from pathlib import Path

from gatewayd.core.health import CAN_BUS
from gatewayd.core.requester import Requester
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan
from gatewayd.service.cell_runtime import Station

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


def test_a_cell_without_canopen_has_the_robot_alone(tmp_path: Path) -> None:
    station = Station(without_can(), tmp_path)
    assert station.can is None
    assert station.links == (station.robot,)


def test_a_cell_with_canopen_has_both_links(tmp_path: Path) -> None:
    station = Station(plan(), tmp_path)
    assert station.links == (station.robot, station.can)


def test_a_node_is_on_its_bus_while_that_carries_frames(tmp_path: Path) -> None:
    station = Station(plan(), tmp_path)
    found = {}
    for state, name in enumerate(CAN_BUS):
        station.cell.health.can_bus = state
        found[name] = station.is_on_bus
    assert {name for name, on in found.items() if on} == {"passive", "warning", "active"}
    assert not Station(without_can(), tmp_path).is_on_bus


def test_another_policy_goes_on_with_values_and_node(tmp_path: Path) -> None:
    station = Station(plan(), tmp_path)
    cell, can = station.cell, station.can
    cell.image.values[0] = 7
    station.succeed(plan(stale="hold"), 1.0)
    assert station.cell is not cell
    assert station.cell.image.values[0] == 7
    assert station.can is can
    assert cell.listeners == []


def test_other_objects_need_another_node(tmp_path: Path) -> None:
    """Its dictionary is that of one mapping: it boots, and who wrote on the former one is lost."""
    station = Station(plan(), tmp_path)
    can = station.can
    station.cell.writer_connected(Requester(0), 0.5)
    station.succeed(plan(placed="object"), 1.0)
    assert station.can is not None
    assert station.can is not can


def test_canopen_can_be_taken_away(tmp_path: Path) -> None:
    station = Station(plan(), tmp_path)
    station.succeed(without_can(), 1.0)
    assert station.can is None
