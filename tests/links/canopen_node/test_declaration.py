"""Which changes of a mapping are another node for the bus."""

from __future__ import annotations

import pytest

from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.links.canopen_node.declaration import KIND
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan

HEAD = (
    "gatewayd: 1\ncell: press-3\nrobot: {host: 127.0.0.9%s}\n"
    "canopen: {channel: c, bitrate: 500000, node: 16, identity: {%s}}\n"
)
FORCE = "variables:\n  force: {robot: output_double_register_0, canopen: auto}\n"
MORE = FORCE + "  cycles: {robot: output_int_register_0, canopen: auto}\n"


def plan(identity: str = "", variables: str = FORCE, robot: str = "") -> Plan:
    loaded = load((HEAD % (robot, identity) + variables).encode(), "a.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def objections(old: Plan, new: Plan) -> list[Objection]:
    return [*KIND.disturbs(old.links["canopen"], new.links["canopen"], old.cell, new.cell)]


def fits(old: Plan, new: Plan) -> bool:
    return KIND.fits(old.links["canopen"], new.links["canopen"], old.cell, new.cell)


@pytest.mark.parametrize(
    "old, new, changes",
    [
        (plan(), plan("vendor: 0x319"), "vendor 0x00000000 -> 0x00000319"),
        (
            plan("revision: 1, serial: 1"),
            plan("revision: 2, serial: 3"),
            "revision 0x00000001 -> 0x00000002, serial",
        ),
        (plan("serial: fingerprint"), plan("serial: fingerprint", robot=", frequency: 10"), "serial"),
        (plan("revision: auto"), plan("revision: auto", MORE), "revision"),
    ],
)
def test_another_identity_is_an_objection_and_another_node(old: Plan, new: Plan, changes: str) -> None:
    (found,) = objections(old, new)
    assert found.kind is ObjectionKind.IDENTITY
    assert changes in found.text
    assert "LSS selects by it" in found.text
    assert not fits(old, new)


@pytest.mark.parametrize(
    "old, new",
    [
        (plan(), plan(robot=", frequency: 10")),
        (plan(), plan("product: 0x47574401")),
        (plan("revision: auto"), plan("revision: auto", robot=", frequency: 10")),
    ],
)
def test_the_same_identity_is_none_whatever_else_the_mapping_says(old: Plan, new: Plan) -> None:
    assert objections(old, new) == []
    assert fits(old, new)


def test_more_at_the_end_under_a_declared_identity_is_the_same_node() -> None:
    behind = FORCE + "  torque: {robot: output_double_register_1, canopen: auto}\n"
    assert objections(plan(), plan(variables=behind)) == []
    assert fits(plan(), plan(variables=behind))
    assert not fits(plan(variables=behind), plan())


def test_what_moves_other_pdos_is_another_node_and_no_objection_of_this_kind() -> None:
    assert objections(plan(), plan(variables=MORE)) == []
    assert not fits(plan(), plan(variables=MORE))
