"""Who answers to the unit ids 0 and 255, and who would lose them. The reload itself: tests/service/test_reload.py."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from ipaddress import ip_address, ip_network
from itertools import product

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.objection import ObjectionKind
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.default_unit import NamedPlan, default_cell, losing, lost
from gatewayd.links.modbus_server.functions import Unit
from gatewayd.links.modbus_server.plan import ModbusPlan, default_of
from gatewayd.links.modbus_server.session import ModbusSession, UnitAccess

from .conftest import NOW, PLC

HERE = ip_address("192.0.2.1")


@pytest.mark.parametrize(
    "defaults", [defaults for count in range(4) for defaults in product((False, True), repeat=count)]
)
def test_it_is_the_one_that_a_session_answers_for(
    defaults: tuple[bool, ...], new_cell: Callable[[float], Cell], plan_of: Callable[..., ModbusPlan]
) -> None:
    cells = [new_cell(NOW) for _each in defaults]
    for number, cell in enumerate(cells):
        cell.definition = replace(cell.definition, name=f"cell-{number}")
    units = [
        Unit(replace(plan_of(number), default_unit=default), cell)
        for number, (default, cell) in enumerate(zip(defaults, cells, strict=True), 1)
    ]
    accesses = {unit.plan.unit: UnitAccess(unit, Requester(PLC)) for unit in units}
    session = ModbusSession()
    session.serve(accesses)
    found = default_of([(unit.cell.definition.name, unit.plan) for unit in units])
    assert session.cell_of(0) == session.cell_of(255) == found
    default = default_cell(accesses)
    assert (None if default is None else default.definition.name) == found


@pytest.fixture
def named(plan_of: Callable[..., ModbusPlan]) -> Callable[..., NamedPlan]:
    def make(name: str, allow: str = "", *, default: bool = False) -> NamedPlan:
        networks = tuple(map(ip_network, allow.split()))
        return name, replace(plan_of(1), allow=networks, default_unit=default)

    return make


def test_a_second_cell_takes_them_from_a_sole_one_but_not_from_a_declared_one(
    named: Callable[..., NamedPlan],
) -> None:
    a, b = named("a"), named("b")
    assert lost([a], [a, b], ()) == {"a": None}
    assert lost([a], [a, named("b", default=True)], ()) == {"a": "b"}, "another robot"
    assert lost([a], [named("a", default=True), b], ()) == {}
    assert lost([a, b], [a, b, named("c")], ()) == {}
    assert lost([a, b], [a], ()) == {}


def test_a_cell_that_goes_loses_more_than_them_unless_another_robot_would_answer(
    named: Callable[..., NamedPlan],
) -> None:
    assert lost([named("a")], [], ()) == {}
    assert lost([named("a")], [named("b")], ()) == {"a": "b"}
    assert lost([named("a", default=True), named("b")], [named("b")], ()) == {"a": "b"}


def test_it_hangs_on_what_a_client_may_reach(named: Callable[..., NamedPlan]) -> None:
    a, b = named("a", "192.0.2.0/24"), named("b", "198.51.100.0/24")
    assert lost([a], [a, b], ()) == {}
    assert lost([a], [a, named("b")], ()) == {"a": None}
    assert lost([a, b], [a, b, named("c", "198.51.100.7")], [HERE]) == {"b": None}
    assert lost([a, b], [a, named("b", "192.0.2.0/23")], [HERE]) == {"a": None}
    assert lost([named("a")], [a], ()) == {}, "who may not connect any more is another matter"


def test_the_objection_names_what_owners_would_lose(cell: Cell, index_of: Callable[[str], int]) -> None:
    weaker = losing(cell, None, ())
    assert weaker.kind is ObjectionKind.WEAKENING
    assert weaker.text == (
        "clients that ask for the unit ids 0 and 255 would find nobody; `default_unit: true` keeps them"
    )
    plc = Requester(PLC, "192.0.2.1", 7)
    cell.writer_connected(plc, NOW)
    assert losing(cell, "b", [plc]).kind is ObjectionKind.WEAKENING, "nothing is owned"
    assert cell.write(plc, [Change(index_of("part"), 1)], NOW) is None
    owned = losing(cell, "b", [plc])
    assert owned.kind is ObjectionKind.RELEASE
    assert owned.text.startswith("clients that ask for the unit ids 0 and 255 would be answered by b;")
    assert owned.text.endswith("`part` is owned by such a client and would be released")
