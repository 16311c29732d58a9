from __future__ import annotations

import pytest

from gatewayd.canopen.peers import Peers
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Writer
from gatewayd.core.events import EventKind


@pytest.fixture
def cell() -> Cell:
    return Cell(CellDefinition("test", 1, (), (), (Writer("line", timeout=1.0), Writer("tool")), 0.1))


def test_one_connection_however_often_it_is_heard(cell: Cell) -> None:
    peers = Peers(cell)
    for now in range(3):
        peers.heard(0, "RPDO", float(now))
        peers.connect(0, "RPDO", float(now))
    assert cell.writers.connections == [1, 0]
    peers.lose(0, "bus off", 3.0)
    peers.lose(0, "bus off", 3.0)
    assert (cell.writers.alive, cell.writers.connections) == ([False, False], [0, 0])
    assert [event.kind for event in cell.events] == [EventKind.WRITER_CONNECTED, EventKind.WRITER_LOST]


def test_a_lost_writer_comes_back(cell: Cell) -> None:
    peers = Peers(cell)
    peers.heard(1, "SDO", 0.0)
    peers.lose_all("bus down", 1.0)
    peers.heard(1, "SDO", 2.0)
    assert cell.writers.alive == [False, True]


def test_heartbeat_feeds_a_writer_but_makes_none(cell: Cell) -> None:
    peers = Peers(cell)
    peers.heartbeat(0, 0.0)
    assert cell.writers.alive == [False, False]
    peers.heard(0, "RPDO", 0.0)
    peers.heartbeat(0, 0.9)
    cell.tick(1.5)
    assert cell.writers.alive == [True, False]
    cell.tick(2.0)
    assert cell.writers.alive == [False, False]


def test_nobody_is_no_writer(cell: Cell) -> None:
    peers = Peers(cell)
    peers.heard(None, "SDO", 0.0)
    peers.connect(None, "RPDO", 0.0)
    peers.heartbeat(None, 0.0)
    peers.lose(None, "bus off", 0.0)
    assert cell.events.count == 0
