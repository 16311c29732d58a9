from __future__ import annotations

from collections.abc import Callable

from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit
from gatewayd.links.modbus_server.session import UnitAccess
from gatewayd.links.modbus_server.writers import hold_anything, names_of, succeeded, writers_of
from tests.links.modbus_server.conftest import HMI, NOW, PLC


def test_a_peer_that_can_only_read_is_no_writer(unit: Unit) -> None:
    accesses = {1: UnitAccess(unit, Requester(None, "192.0.2.77"))}
    assert writers_of(accesses) == []
    assert names_of(accesses) == ()
    assert not hold_anything(accesses)


def test_a_writer_keeps_the_number_of_its_connection_in_the_cell_that_goes_on(
    unit: Unit, new_cell: Callable[[float], Cell]
) -> None:
    accesses = {1: UnitAccess(unit, Requester(HMI, "192.0.2.21", connection=7))}
    successor = new_cell(NOW)
    assert names_of(accesses) == ("hmi",)
    assert succeeded(writers_of(accesses), {unit.cell: successor}) == [
        (successor, Requester(HMI, "192.0.2.21", connection=7))
    ]


def test_whoever_wrote_holds_something(unit: Unit, index_of: Callable[[str], int]) -> None:
    accesses = {1: UnitAccess(unit, Requester(PLC, connection=7))}
    assert not hold_anything(accesses)
    assert unit.cell.request(accesses[1].requester, index_of("part"), NOW) is None
    assert hold_anything(accesses)
