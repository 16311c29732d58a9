"""The errors by themselves; what they do to writers and services is in test_node.py."""

from __future__ import annotations

import math

import pytest

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.emergency import Emergency, ErrorCode
from gatewayd.canopen.nmt import NmtCommand, NmtSlave, NmtState
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.links.canopen_node.communication_errors import OVERRUN_TIME, CommunicationErrors
from gatewayd.links.canopen_node.observer import NodeCounters
from gatewayd.links.canopen_node.pdo.receive import Fault
from gatewayd.links.canopen_node.pdo.transmit import TransmitEngine
from tests.links.canopen_node.wire import Wire

NODE = 5


class Bench:
    """A node in OPERATIONAL, as far as its errors know it."""

    def __init__(self) -> None:
        wire = Wire()
        self.lost: list[str] = []
        self.counters = NodeCounters()
        self.emergency = Emergency(wire.send, NODE, lambda: True)
        self.nmt = NmtSlave(
            wire.send, lambda: NODE, lambda *_states: None, lambda *_command: None, autostart=True
        )
        self.nmt.boot(0.0)
        self.errors = CommunicationErrors(
            self.emergency,
            self.nmt,
            TransmitEngine(Cell(CellDefinition("test", 1, (), (), (), 0.1)), wire.send),
            self.counters,
            lose_node=lambda reason, node, _now: self.lost.append(reason.format(node)),
            lose_rpdo=lambda _number, reason, _now: self.lost.append(reason),
        )


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_a_lost_heartbeat_is_a_communication_error_and_costs_the_node_its_writers(bench: Bench) -> None:
    bench.errors.heartbeat_lost(7, 1.0)
    assert bench.emergency.active(ErrorCode.HEARTBEAT, 7)
    assert (bench.lost, bench.counters.communication_errors) == (["no heartbeat of node 7"], 1)
    assert bench.nmt.state is NmtState.PRE_OPERATIONAL
    bench.errors.heartbeat_back(7, 2.0)
    assert not bench.emergency.active(ErrorCode.HEARTBEAT, 7)


def test_only_a_deadline_costs_the_rpdo_its_writer(bench: Bench) -> None:
    bench.errors.fault_raised(Fault.SHORT, 1, 1.0)
    assert bench.lost == []
    bench.errors.fault_raised(Fault.TIMEOUT, 1, 1.0)
    assert (bench.lost, bench.nmt.state) == (["RPDO 1 is missing"], NmtState.OPERATIONAL)


@pytest.mark.parametrize("state", [NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL])
def test_a_bus_that_is_back_starts_the_node_anew_if_it_had_ended_operational(
    bench: Bench, state: NmtState
) -> None:
    if state is not NmtState.OPERATIONAL:
        bench.nmt.command(NmtCommand.ENTER_PRE_OPERATIONAL, 0.5)
    bench.errors.bus_lost(1.0)
    assert bench.nmt.state is NmtState.PRE_OPERATIONAL
    bench.errors.bus_back(2.0)
    assert bench.nmt.state is state


def test_a_controller_is_passive_while_it_is_seen_so(bench: Bench) -> None:
    for state in (BusState.PASSIVE, BusState.WARNING):
        bench.errors.bus_seen(state, 1.0)
        assert bench.emergency.active(ErrorCode.PASSIVE) is (state is BusState.PASSIVE)


def test_an_overrun_ends_after_a_time_without_loss(bench: Bench) -> None:
    for now in (1.0, 1.5):
        bench.errors.frames_lost(2, now)
    assert (bench.counters.overruns, bench.errors.next_deadline(1.5)) == (4, 1.5 + OVERRUN_TIME)
    bench.errors.tick(1.0 + OVERRUN_TIME)
    assert bench.emergency.active(ErrorCode.OVERRUN)
    bench.errors.tick(1.5 + OVERRUN_TIME)
    assert not bench.emergency.active(ErrorCode.OVERRUN)
    assert bench.errors.next_deadline(9.0) == math.inf
