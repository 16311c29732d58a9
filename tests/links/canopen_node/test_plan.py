"""What makes two plans the same node: names, not the numbers that a mapping happens to give them."""

from __future__ import annotations

from gatewayd.links.canopen_node.description import by_name
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan

HEAD = "gatewayd: 1\ncell: a\nrobot: {host: r}\ncanopen: {channel: c, bitrate: 500000, node: 16}\n"
WRITERS = "writers: {line: {canopen: any}}\n"
FIRST = "variables:\n%s  one: {robot: input_int_register_0, canopen: auto, owner: line%s}\n"
OTHER = "  two: {robot: output_int_register_0, modbus: 5}\n"


def plan(before: str = "", more: str = "", modbus: str = "") -> Plan:
    loaded = load((HEAD + modbus + WRITERS + FIRST % (before, more)).encode(), "a.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def node(of: Plan) -> dict[str, str]:
    assert of.the(CanopenPlan) is not None
    return by_name(of.the(CanopenPlan), of.cell)


def test_other_numbers_and_policies_are_the_same_node() -> None:
    shifted = plan(
        before=OTHER, modbus="modbus: {listen: '127.0.0.1:1502'}\n", more=", on_release: hold, lease: 9s"
    )
    assert shifted.the(CanopenPlan) != plan().the(CanopenPlan)
    assert node(shifted) == node(plan())


def test_another_object_is_another_node() -> None:
    more = "  three: {robot: output_int_register_1, canopen: auto}\n"
    assert node(plan(before=more)) != node(plan())


def test_the_quality_of_another_variable_is_another_node() -> None:
    """The object is the same: that of the first variable, whichever it is."""
    pdos = "canopen: {channel: c, bitrate: 500000, node: 16, pdos: {state: {status: quality of %s}}}"
    head, lines = HEAD.replace("canopen: {channel: c, bitrate: 500000, node: 16}", pdos), []
    for first, second in (("one", "two"), ("two", "one")):
        variables = f"  {first}: {{robot: robot_mode}}\n  {second}: {{robot: safety_mode}}\n"
        loaded = load((head % first + "variables:\n" + variables).encode(), "a.yaml")
        assert loaded.plan is not None, loaded.diagnostics
        lines.append(loaded.plan)
    places = [[(one.index, one.subindex) for one in plan.the(CanopenPlan).pdos[0].entries] for plan in lines]
    assert places[0] == places[1]
    assert node(lines[0]) != node(lines[1])
