from __future__ import annotations

import pytest

from gatewayd.canopen.frame import Frame
from gatewayd.canopen.gap import Waiting
from gatewayd.canopen.heartbeat import Consumer, HeartbeatConsumer
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Writer
from gatewayd.core.events import EventKind
from gatewayd.links.canopen_node.peers import Peers
from gatewayd.links.canopen_node.promise import Promises

LINE, TOOL, FREE = range(3)
NODE = 7
PROMISES = (Consumer(NODE, 500, LINE), Consumer(NODE, 500, TOOL), Consumer(9, 500, None))


class Bench:
    """Peers, of whom two have promised the heartbeat of one node, and the watch over it."""

    def __init__(self) -> None:
        writers = (Writer("line", timeout=1.0), Writer("tool"), Writer("free"))
        self.cell = Cell(CellDefinition("test", 1, (), (), writers, 0.1))
        self.watch = HeartbeatConsumer(
            PROMISES,
            lost=self._lost,
            back=lambda _node, _now: None,
            changed=lambda: None,
        )
        self.promises = Promises(PROMISES, also=self.watch.time, broken=self._lost, booted=self._lost)
        self.waiting = Waiting()
        self.peers = Peers(self.cell, self.promises, self.watch, self.waiting)

    def _lost(self, node: int, now: float) -> None:
        for writer in self.promises.of(node):
            self.peers.lose(writer, "silent", now)

    def heartbeat(self, now: float) -> None:
        self.peers.heartbeat(Frame(0x700 + NODE, b"\5"), now)

    def rpdo(self, writer: int, now: float) -> bool:
        """Whether the writer of an RPDO is believed."""
        self.promises.write(writer, now)
        return self.peers.connect(writer, "RPDO", now)

    def tick(self, now: float) -> None:
        self.watch.tick(now)
        self.promises.tick(now)

    @property
    def alive(self) -> list[bool]:
        return self.cell.writers.alive

    @property
    def reported(self) -> list[EventKind]:
        return [event.kind for event in self.cell.events]


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_one_connection_however_often_it_is_heard(bench: Bench) -> None:
    for now in range(3):
        bench.peers.heard(FREE, "RPDO", float(now))
        assert bench.peers.connect(FREE, "RPDO", float(now))
    assert bench.cell.writers.connections == [0, 0, 1]
    bench.peers.lose(FREE, "bus off", 3.0)
    bench.peers.lose(FREE, "bus off", 3.0)
    assert (bench.alive, bench.cell.writers.connections) == ([False] * 3, [0] * 3)
    assert bench.reported == [EventKind.WRITER_CONNECTED, EventKind.WRITER_LOST]


def test_a_lost_writer_comes_back(bench: Bench) -> None:
    bench.peers.heard(FREE, "SDO", 0.0)
    bench.peers.lose_all("bus down", 1.0)
    bench.peers.heard(FREE, "SDO", 2.0)
    assert bench.alive == [False, False, True]


def test_heartbeat_feeds_a_writer_but_makes_none(bench: Bench) -> None:
    bench.heartbeat(0.0)
    assert bench.alive == [False] * 3
    bench.peers.heard(LINE, "RPDO", 0.0)
    bench.heartbeat(0.9)
    bench.cell.tick(1.5)
    assert bench.alive == [True, False, False]
    bench.cell.tick(2.0)
    assert bench.alive == [False] * 3


def test_nobody_is_no_writer(bench: Bench) -> None:
    bench.peers.heard(None, "SDO", 0.0)
    assert bench.peers.connect(None, "RPDO", 0.0)
    assert bench.peers.believed(None)
    bench.peers.lose(None, "bus off", 0.0)
    assert bench.cell.events.count == 0


def test_a_promise_is_believed_for_one_heartbeat_time_and_then_only_while_it_is_kept(bench: Bench) -> None:
    assert bench.rpdo(LINE, 0.0)
    bench.tick(0.4)
    assert bench.rpdo(LINE, 0.4)
    bench.tick(0.5)
    assert bench.alive == [False] * 3
    assert not bench.peers.believed(LINE)
    assert not bench.rpdo(LINE, 0.6)
    bench.peers.heard(LINE, "SDO", 0.7)
    assert (bench.alive, bench.cell.writers.connections) == ([False] * 3, [0] * 3)
    bench.heartbeat(1.0)
    assert bench.peers.believed(LINE)
    assert bench.rpdo(LINE, 1.1)
    assert bench.alive == [True, False, False]


def test_a_sign_of_one_writer_is_that_of_its_node(bench: Bench) -> None:
    """Two writers that promise the heartbeat of one node are lost with it together."""
    assert bench.rpdo(LINE, 0.0)
    assert bench.peers.connect(TOOL, "SDO", 0.3)
    bench.tick(0.5)
    assert bench.reported.count(EventKind.WRITER_LOST) == 2
    assert not bench.peers.connect(TOOL, "SDO", 0.6)
    assert bench.peers.connect(FREE, "SDO", 0.6), "who promised nothing is believed"


def test_a_read_makes_a_writer_alive_and_binds_it_to_nothing(bench: Bench) -> None:
    bench.peers.heard(LINE, "SDO", 0.0)
    bench.tick(9.0)
    assert bench.alive == [True, False, False]
    assert bench.peers.asking(LINE, 9.0).trusted
    bench.tick(9.5)
    assert (bench.alive, bench.peers.requester(LINE).trusted) == ([False] * 3, False)


def test_what_is_no_longer_watched_is_promised_all_the_same(bench: Bench) -> None:
    for entry in bench.watch._entries:
        entry.write(bytes(4))
    bench.watch.tick(0.0)
    assert bench.watch.nodes == frozenset()
    assert bench.rpdo(LINE, 0.0)
    bench.tick(0.5)
    assert not bench.rpdo(LINE, 0.6)


def test_requests_that_waited_say_so(bench: Bench) -> None:
    bench.waiting.gap(1.0, 3.5)
    assert bench.peers.requester(FREE).waited == 2.5
    bench.waiting.caught_up()
    assert bench.peers.requester(FREE) is bench.peers.requester(FREE)
