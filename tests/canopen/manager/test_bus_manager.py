"""The manager of a bus: mandatory devices, starting at once, its own heartbeat and SYNC, coming and going."""

from __future__ import annotations

import pytest

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.manager.bus_manager import ManagerError
from gatewayd.canopen.manager.node import NodeCondition
from gatewayd.canopen.manager.plan import ManagedPdo, ManagerPlan
from gatewayd.canopen.nmt import NmtCommand
from gatewayd.canopen.sync import SyncPlan
from tests.canopen.manager.bench import NEVER, OUTPUT, Bench

START = NmtCommand.START


def _starts(bench: Bench) -> list[int]:
    return [target for command, target in bench.commands() if command == START]


def test_no_device_is_started_while_a_mandatory_one_is_missing() -> None:
    bench = Bench()
    bench.device(5)
    five, _ = bench.attach(pdos=())
    bench.attach(node=6, mandatory=True, pdos=())
    bench.up()
    bench.run(3.0)
    assert _starts(bench) == []
    assert (five.condition, bench.manager.missing) == (NodeCondition.READY, (6,))
    bench.device(6)
    bench.run(1.0)
    assert _starts(bench) == [5, 6]
    assert bench.manager.released


def test_missing_optional_device_holds_up_nobody() -> None:
    bench = Bench()
    bench.device(5)
    bench.attach(pdos=(), mandatory=True)
    bench.attach(node=6, pdos=())
    bench.up()
    bench.run(1.0)
    assert _starts(bench) == [5]


def test_mandatory_device_that_goes_later_stops_nobody_and_comes_back() -> None:
    bench = Bench()
    device = bench.device(5)
    other = bench.device(6)
    bench.attach(pdos=(), mandatory=True)
    six, _ = bench.attach(node=6, pdos=())
    bench.up()
    bench.run(1.0)
    device.silent = True
    bench.run(1.0)
    assert six.running
    other.reboot()
    bench.run(1.0)
    assert six.running
    assert bench.manager.missing == (5,)


def test_start_of_all_at_once_only_where_all_are_ready() -> None:
    plan = ManagerPlan("virtual", "bench", 500_000, start_all=True)
    bench = Bench(plan)
    for node in (5, 6):
        bench.device(node)
        bench.attach(node=node, pdos=())
    bench.up()
    bench.run(1.0)
    # Both were ready one after the other, and nothing is mandatory: the first was alone.
    assert _starts(bench) == [5, 6]
    bench = Bench(plan)
    for node in (5, 6):
        bench.device(node)
        bench.attach(node=node, pdos=(), mandatory=True)
    bench.up()
    bench.run(1.0)
    assert _starts(bench) == [0]
    assert all(node.running for node in bench.manager.nodes.values())


def test_mandatory_device_that_is_given_up_is_waited_for_no_more() -> None:
    bench = Bench()
    bench.device(5)
    bench.attach(pdos=())
    bench.attach(node=6, mandatory=True, pdos=())
    bench.up()
    bench.run(1.0)
    bench.manager.detach(6, "the mapping does not name it", bench.now)
    assert _starts(bench) == [5]


def test_own_heartbeat_needs_the_core_and_sync_a_period() -> None:
    plan = ManagerPlan(
        "virtual", "bench", 500_000, node=127, heartbeat=100, sync=SyncPlan(producer=True, period=10_000)
    )
    bench = Bench(plan)
    assert bench.manager.next_deadline() == NEVER
    bench.up()
    bench.run(1.0)
    beats = [frame.data for frame in bench.sent if frame.can_id == 0x77F]
    assert beats[0] == b"\0"
    assert set(beats[1:]) == {b"\5"}
    assert len(beats) == 10
    assert 98 <= sum(frame.can_id == 0x80 for frame in bench.sent) <= 100
    bench.lives = False
    bench.sent.clear()
    bench.run(1.0)
    assert not any(frame.can_id == 0x77F for frame in bench.sent)
    assert bench.manager.renew(0x77F, bench.now) is None


def test_bus_that_goes_and_comes_back() -> None:
    bench = Bench()
    bench.device()
    node, diary = bench.attach()
    bench.up()
    bench.run(1.0)
    bench.manager.bus_changed(BusState.BUS_OFF, bench.now)
    assert node.condition is NodeCondition.OFFLINE
    assert bench.manager.next_deadline() == NEVER
    bench.up()
    bench.manager.bus_changed(BusState.PASSIVE, bench.now)
    bench.run(1.0)
    assert diary.events == ["started", "ended: the CAN bus is away", "started"]


def test_devices_come_and_go_while_others_run() -> None:
    bench = Bench()
    bench.device()
    five, diary = bench.attach()
    bench.up()
    bench.run(1.0)
    bench.device(6)
    six, _ = bench.attach(node=6, pdos=())
    bench.run(1.0)
    assert six.running
    bench.manager.detach(6, "a reload", bench.now)
    assert 0x706 not in bench.manager.can_ids()
    bench.run(1.0)
    assert five.running
    assert diary.events == ["started"]


def test_clashes_are_refused() -> None:
    bench = Bench(ManagerPlan("virtual", "bench", 500_000, node=1))
    bench.attach()
    for node in (5, 1):
        with pytest.raises(ManagerError, match=f"node {node} is managed already"):
            bench.attach(node=node)
    with pytest.raises(ManagerError, match="node 6 sends with 185h, which is taken"):
        bench.attach(node=6, pdos=(ManagedPdo(1, True, 0x185, (OUTPUT,)),))
    assert list(bench.manager.nodes) == [5]


def test_frames_that_waited_are_made_anew() -> None:
    bench = Bench()
    bench.device()
    node, _ = bench.attach()
    bench.up()
    bench.run(1.0)
    node.write_pdo(1, 0, 3, bench.now)
    assert bench.manager.renew(0x205, bench.now) == Frame(0x205, b"\3")
    assert bench.manager.renew(0x305, bench.now) is None
    bench.manager.bus_changed(BusState.DOWN, bench.now)
    assert bench.manager.renew(0x205, bench.now) is None


def test_frames_of_nobody_are_ignored() -> None:
    bench = Bench()
    bench.up()
    bench.manager.receive(Frame(0x7FF, b"\0"), bench.now)
