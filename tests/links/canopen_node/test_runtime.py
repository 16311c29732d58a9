"""The link in a running loop: its bus, its timer, its life and its end. What the node does is shown elsewhere."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from datetime import UTC, datetime
from uuid import uuid4

import can
import pytest

from gatewayd.canopen import pythoncan, socketcan
from gatewayd.canopen.bus import BusState
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.interface import Interface
from gatewayd.canopen.nmt import NmtState
from gatewayd.canopen.pythoncan import PythonCanBus
from gatewayd.canopen.supervision import BusSignal
from gatewayd.core.cell import Cell
from gatewayd.core.succession import succeed
from gatewayd.links.canopen_node import runtime as link_module
from gatewayd.links.canopen_node.communication_errors import DOUBLED_TIME
from gatewayd.links.canopen_node.declaration import KIND
from gatewayd.links.canopen_node.plan import CanopenPlan, canopen_of
from gatewayd.links.canopen_node.runtime import LOSS_INTERVAL, CanLink
from gatewayd.links.canopen_node.store import Store
from gatewayd.links.contract import Level
from gatewayd.logs.events import EventLog
from gatewayd.logs.merging import EACH, PERIOD
from gatewayd.loop import clock
from tests.links.canopen_node.conformance.bench import compiled
from tests.links.canopen_node.recorder import until
from tests.logs.written import written_log

HEARTBEAT = 0x705


class Station:
    """A link on a virtual bus, its cell with a core that counts, and a peer."""

    def __init__(self, channel: str, **changes: object) -> None:
        compiled_plan = compiled()
        assert canopen_of(compiled_plan) is not None
        settings = {"channel": channel, "heartbeat": 10, **changes}
        plan: CanopenPlan = replace(compiled_plan.the(CanopenPlan), **settings)  # type: ignore[arg-type]
        self.names = {one.name: index for index, one in enumerate(compiled_plan.cell.variables)}
        self.cell = Cell(replace(compiled_plan.cell, stale_after=1e9))
        now = time.monotonic()
        self.cell.robot_connected(now)
        self.cell.adopt({self.names["ints_in[0]"]: 0, self.names["ints_in[1]"]: 0}, now)
        self.cell.package_arrived(1.0, now)
        self.cell.outputs_written(now)
        self.link = CanLink(plan, self.cell, Store())
        self.peer = can.Bus(channel, interface="virtual")
        self.heard: list[Frame] = []
        self.beating = True

    async def count(self) -> None:
        """The core's heartbeat."""
        while True:
            if self.beating:
                self.cell.health.heartbeat += 1
            await asyncio.sleep(0.01)

    def send(self, can_id: int, data: bytes = b"") -> None:
        self.peer.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    def frames(self, can_id: int) -> list[bytes]:
        """All frames of an identifier so far."""
        while (message := self.peer.recv(0)) is not None:
            self.heard.append(Frame(message.arbitration_id, bytes(message.data)))
        return [frame.data for frame in self.heard if frame.can_id == can_id]

    def forget(self) -> None:
        self.frames(0)
        self.heard.clear()


@asynccontextmanager
async def running(station: Station) -> AsyncIterator[asyncio.Task[None]]:
    core = asyncio.create_task(station.count())
    task = asyncio.create_task(station.link.run())
    try:
        yield task
    finally:
        for one in (task, core):
            one.cancel()
            with suppress(asyncio.CancelledError):
                await one


@pytest.fixture
def station() -> Station:
    return Station(str(uuid4()))


async def test_values_go_both_ways(station: Station) -> None:
    async with running(station):
        await until(lambda: station.frames(HEARTBEAT))
        station.send(0x000, b"\1\5")
        await until(lambda: station.cell.health.words["nmt_state"] == NmtState.OPERATIONAL)
        station.send(0x305, b"\7\0\0\0\x08\0\0\0")
        await until(lambda: station.cell.image.values[station.names["ints_in[1]"]] == 8)
        station.cell.image.values[station.names["ints_out[0]"]] = 9
        station.cell.outputs_written(time.monotonic())
        await until(lambda: b"\x09" + bytes(7) in station.frames(0x285))
        assert station.cell.health.words["can_bus"] == BusState.ACTIVE + 1


async def test_two_nodes_share_a_bus() -> None:
    channel = str(uuid4())
    one, other = Station(channel), Station(channel, node=6)
    async with running(one), running(other):
        await until(lambda: one.frames(0x705) and one.frames(0x706))
        one.send(0x000, b"\1\6")
        await until(lambda: b"\5" in one.frames(0x706))
        assert b"\5" not in one.frames(0x705)


async def test_heartbeat_stops_with_the_core_and_comes_back_with_it(station: Station) -> None:
    async with running(station):
        await until(lambda: len(station.frames(HEARTBEAT)) > 3)
        station.beating = False
        await asyncio.sleep(link_module.CORE_TIME + 0.05)
        station.forget()
        await asyncio.sleep(0.1)
        assert station.frames(HEARTBEAT) == []
        station.send(0x605, bytes.fromhex("4000100000000000"))
        await until(lambda: station.frames(0x585))
        station.beating = True
        await until(lambda: station.frames(HEARTBEAT))


async def test_link_that_is_started_again_keeps_time(station: Station) -> None:
    """The daemon starts a link again after a defect; its timer must not wait for a moment that is over."""
    async with running(station):
        await until(lambda: len(station.frames(HEARTBEAT)) > 3)
    station.forget()
    await asyncio.sleep(0.03)
    assert station.frames(HEARTBEAT) == []
    async with running(station):
        await until(lambda: len(station.frames(HEARTBEAT)) > 3)
        station.send(0x605, bytes.fromhex("4000100000000000"))
        await until(lambda: station.frames(0x585))


async def test_nothing_runs_on_after_the_end(station: Station) -> None:
    async with running(station):
        await until(lambda: station.frames(HEARTBEAT))
    assert station.link._timer is None
    station.cell.outputs_written(time.monotonic())
    station.cell.image.values[station.names["ints_out[0]"]] = 3
    station.forget()
    await asyncio.sleep(0.05)
    assert station.heard == []
    assert station.cell.health.words["can_bus"] == BusState.DOWN + 1


async def test_a_bus_that_cannot_be_used_is_reported_once_and_shown_as_absent(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(link_module, "RETRY", 0.01)
    station = Station(str(uuid4()), interface="nosuchinterface")
    assert station.cell.health.words["can_bus"] == BusState.ABSENT + 1, (
        "not 0, which says that there is no CANopen"
    )

    def reported() -> list[str]:
        return [record.levelname for record in caplog.records if "nosuchinterface" in record.message]

    async with running(station) as task:
        await until(lambda: bool(reported()))
        await asyncio.sleep(0.05)
        assert not task.done()
        assert station.cell.health.words["can_bus"] == BusState.ABSENT + 1
    assert reported() == ["ERROR"]


async def test_bit_rate_is_switched_once_whatever_comes_at_once(station: Station) -> None:
    """Two activations in one batch of frames open one bus."""
    async with running(station):
        await until(lambda: station.frames(HEARTBEAT))
        activate = Frame(0x7E5, bytes([0x15, 20, 0]).ljust(8, b"\0"))
        now = time.monotonic()
        station.link.on_frames([Frame(0x7E5, b"\4\1".ljust(8, b"\0")), activate, activate], now)
        station.forget()
        await asyncio.sleep(0.025)
        assert station.frames(HEARTBEAT) == []
        await until(lambda: station.frames(HEARTBEAT))
        await asyncio.sleep(0.06)
        station.forget()
        station.send(0x605, bytes.fromhex("4000100000000000"))
        await until(lambda: station.frames(0x585))
        await asyncio.sleep(0.02)
        assert len(station.frames(0x585)) == 1, "two buses would answer twice"


async def test_end_while_the_bit_rate_is_switched(station: Station) -> None:
    async with running(station):
        await until(lambda: station.frames(HEARTBEAT))
        station.send(0x7E5, b"\4\1".ljust(8, b"\0"))
        station.send(0x7E5, bytes([0x15, 20, 0]).ljust(8, b"\0"))
        await until(lambda: station.cell.health.words["can_bus"] == BusState.DOWN + 1)
    station.forget()
    await asyncio.sleep(0.08)
    assert station.frames(HEARTBEAT) == []
    assert station.cell.health.words["can_bus"] == BusState.DOWN + 1


async def test_lost_frames_are_reported_seldom_and_all_counted(
    station: Station, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    async with running(station):
        await until(lambda: station.frames(HEARTBEAT))
        begin = time.monotonic()
        for number in range(100):
            station.link.on_lost(3, begin + number * LOSS_INTERVAL / 50)
    reported = [record for record in caplog.records if record.message == "CAN frames lost"]
    assert len(reported) == 2
    assert station.link.node.counters.overruns == 300


async def test_another_cell_takes_over_unnoticed_by_the_bus(station: Station) -> None:
    """A reload that changes nothing of the node: no boot-up, the same state and parameters, the lock stays."""
    async with running(station):
        await until(lambda: station.frames(HEARTBEAT))
        station.send(0x000, b"\1\5")
        station.send(0x605, b"\x2b\x17\x10\x00\x14\x00\0\0")  # heartbeat every 20 ms
        station.send(0x305, b"\7\0\0\0\x08\0\0\0")
        number = station.names["ints_in[1]"]
        await until(lambda: station.cell.image.values[number] == 8 and station.frames(0x585))
        former, now = station.cell, time.monotonic()
        station.cell = succeed(former, former.definition, now).cell
        former.listeners.clear()
        plan = station.link.node.plan
        assert KIND.fits(plan, plan, former.definition, station.cell.definition)
        station.forget()
        station.link.rebind(plan, station.cell, now)
        await until(lambda: len(station.frames(HEARTBEAT)) > 2)
        assert set(station.frames(HEARTBEAT)) == {b"\5"}
        station.send(0x605, b"\x40\x17\x10\x00\0\0\0\0")
        await until(lambda: station.frames(0x585))
        assert station.frames(0x585) == [b"\x4b\x17\x10\x00\x14\x00\0\0"]
        lock = station.cell.definition.variables[number].lock
        assert lock is not None
        assert station.cell.ownership.owners[lock] is not None
        station.send(0x305, b"\7\0\0\0\x09\0\0\0")
        await until(lambda: station.cell.image.values[number] == 9)
        assert former.image.values[number] == 8
        station.link.node.lose_writers("done", time.monotonic())
        assert station.cell.ownership.owners[lock] is None


def test_a_node_with_another_bit_rate_is_another_node(station: Station) -> None:
    plan = station.link.node.plan
    definition = station.cell.definition
    assert not KIND.fits(plan, replace(plan, bitrate=11), definition, definition)


async def test_what_waited_through_a_gap_is_read_before_anything_else_and_only_that(station: Station) -> None:
    waited: list[float] = []
    async with running(station):
        await until(lambda: station.frames(HEARTBEAT))
        node = station.link.node
        receive = node.nmt.receive

        def observed(frame: Frame, now: float) -> None:
            waited.append(node._waiting.seconds)
            receive(frame, now)

        node._routes.handlers[0] = observed
        now = clock.now()
        for _ in range(200):
            station.send(0x000, b"\x80\5")
        station.link.gap(now - 4.0, now)
        turn = asyncio.get_running_loop().create_future()
        asyncio.get_running_loop().call_soon(turn.set_result, None)
        await turn
        assert waited == [pytest.approx(4.0)] * 200, "all of them in the turn after the gap"
        station.send(0x000, b"\x80\5")
        await until(lambda: len(waited) == 201)
    assert waited[-1] == 0.0


async def test_more_than_is_read_in_one_go_has_waited_all_the_same(
    station: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pythoncan, "CATCH_UP", 0.0)
    waited: list[float] = []
    async with running(station):
        await until(lambda: station.frames(HEARTBEAT))
        node = station.link.node
        node._routes.handlers[0] = lambda _frame, _now: waited.append(node._waiting.seconds)
        for _ in range(1000):
            station.send(0x000, b"\x80\5")
        now = clock.now()
        station.link.gap(now - 4.0, now)
        station.link.gap(now, now + 0.1)
        await until(lambda: len(waited) == 1000)
        assert min(waited) >= 4.0
        await until(lambda: node._waiting.seconds == 0.0)


def test_a_pdo_that_a_gap_kept_from_being_sent_shows_what_is_so_after_it(station: Station) -> None:
    """Stopped between a package of the robot and the PDO that it leads to."""

    async def main() -> None:
        cell, number = station.cell, station.names["ints_out[0]"]

        def stood_still(gap: clock.Gap) -> None:
            cell.image.values[number] = 3  # as the core does with what has become stale
            cell.outputs_written(gap.until)
            station.link.gap(gap.since, gap.until)

        async with running(station):
            await until(lambda: station.frames(HEARTBEAT))
            station.send(0x000, b"\1\5")
            await until(lambda: len(station.frames(0x285)) > 0)
            clock.on_gap(stood_still)
            clock.judged_now()
            cell.image.values[number] = 2
            time.sleep(2 * clock.GAP)  # noqa: ASYNC251 - the process stands still
            cell.outputs_written(clock.now())
            await until(lambda: b"\x03" + bytes(7) in station.frames(0x285))
        assert b"\x02" + bytes(7) not in station.frames(0x285)

    with asyncio.Runner(loop_factory=clock.ClockedLoop) as runner:
        runner.run(main())


async def test_a_link_that_does_not_run_has_nothing_that_waits(station: Station) -> None:
    station.link.gap(0.0, 4.0)
    assert station.link.node._waiting.seconds == 0.0


async def test_a_bus_that_was_stuck_for_seconds_gets_nothing_old(station: Station) -> None:
    """Real time and a driver without room: SYNC producer, heartbeat, an event-driven TPDO and EMCYs."""
    sync = replace(station.link.node.plan.sync, producer=True, period=10_000)
    stuck = Station(str(uuid4()), sync=sync, autostart=True)
    async with running(stuck):
        await until(lambda: stuck.frames(HEARTBEAT) and stuck.frames(0x080))
        bus, now = stuck.link._bus, clock.now()
        assert isinstance(bus, PythonCanBus)
        bus._full = True  # what a driver says while nothing goes out
        stuck.forget()
        for number in range(1, 100):
            stuck.cell.image.values[stuck.names["ints_out[0]"]] = number
            stuck.cell.outputs_written(now)
            await asyncio.sleep(0.01)
        count = stuck.link.node.sync.count
        stuck.link.node.frames_lost(1, clock.now())
        assert stuck.heard == []
        assert stuck.link.node.sync.count == count
        bus._report_room()
        await asyncio.sleep(0)
        first = {can_id: stuck.frames(can_id) for can_id in (0x080, HEARTBEAT, 0x085, 0x285)}
        assert len(first[0x080]) <= 1
        assert len(first[HEARTBEAT]) <= 2
        assert [int.from_bytes(data[:2], "little") for data in first[0x085]] == [0x8110]
        assert first[0x285] == [b"\x63" + bytes(7)]


def test_a_can_bus_is_well_only_when_active(station: Station) -> None:
    node = station.link.node
    node.nmt.state = NmtState.OPERATIONAL
    found = {}
    for node.bus in BusState:
        found[node.bus] = station.link.health()
    assert [state for state, health in found.items() if health.level is Level.GOOD] == [BusState.ACTIVE]
    assert [state for state, health in found.items() if not health.problems] == [BusState.ACTIVE]
    assert found[BusState.BUS_OFF].problems == ("CAN bus bus-off",)


def test_an_active_can_bus_is_not_well_until_a_master_starts_the_node(station: Station) -> None:
    node, plan = station.link.node, station.link.node.plan
    node.bus, node.nmt.state = BusState.ACTIVE, NmtState.PRE_OPERATIONAL
    health = station.link.health()
    assert (health.name, health.level) == (f"CAN {plan.channel}", Level.WARN)
    assert health.detail == f"node {plan.node}, pre-operational"
    assert health.words == "active, but pre-operational: no PDOs until a master starts the node"
    node.bus = BusState.ABSENT
    assert station.link.health().words == "absent: no such interface"


async def test_why_a_bus_cannot_be_used_is_in_the_health() -> None:
    """The reason that the log has: no interface, no SocketCAN, a wrong name."""
    station = Station("none")
    station.link = CanLink(replace(station.link.node.plan, interface="there-is-none"), station.cell, Store())
    async with running(station):
        await until(lambda: station.link.health().problems != ("CAN bus absent",))
        health = station.link.health()
    assert "there-is-none" in health.words
    assert health.problems == (f"CAN bus absent: {health.figures['reason']}",)
    assert health.level is Level.BAD


async def test_an_absent_interface_is_logged_once_and_shown_with_a_remedy(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """However often it is looked for. The kernel is asked in earnest; only CAN sockets it may not have."""
    monkeypatch.setattr(socketcan, "_probe", lambda: None)
    monkeypatch.setattr(socketcan, "LOOK", 0.001)
    looks: list[str] = []
    seen = socketcan.seen

    def look(name: str, interface: Interface | None) -> tuple[BusSignal, str]:
        looks.append(name)
        return seen(name, interface)

    monkeypatch.setattr(socketcan, "seen", look)
    station = Station("nocan7", interface="socketcan")
    caplog.set_level(logging.INFO)
    async with running(station):
        await until(lambda: len(looks) > 20)
        health = station.link.health()
    lines = [
        record
        for record in caplog.records
        if record.name == "gatewayd.canopen" and "absent" in record.message
    ]
    assert [(line.levelname, line.message) for line in lines] == [("WARNING", "CAN bus absent")]
    reason = vars(lines[0])["fields"]["reason"]
    assert "there is no interface nocan7; plug in its adapter, or correct `channel`" in reason
    assert (health.name, health.level) == ("CAN nocan7", Level.BAD)
    assert health.problems == (f"CAN bus absent: {reason}",)


def test_a_master_that_toggles_nmt_states_and_a_node_that_flaps_do_not_fill_the_log(
    station: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A line in `PERIOD` for each thing that is said, with the number of those that it stands for."""
    now, node = 1000.0, station.link.node
    with written_log(monkeypatch) as log:
        station.cell.events.listeners.append(EventLog(station.cell))
        node.bus_changed(BusState.ACTIVE, now)
        node.start(now)
        node.receive(Frame(0x605, bytes.fromhex("2316100132000900")), now)
        node.tick(now)
        for _ in range(3600):
            now += 1.0
            log.now = now
            node.receive(Frame(0x709, b"\5"), now)
            node.receive(Frame(0x000, b"\1\5"), now)
            node.tick(now + 0.1)  # the heartbeat of node 9 is lost
            for command in (b"\2\5", b"\x80\5"):
                node.receive(Frame(0x000, command), now + 0.2)
            for hour in (1, 2):  # two masters whose clocks differ
                station.link.time_received(datetime(2026, 11, 29, hour, tzinfo=UTC), now)
            log.flush()
        log.close()
        clocks = [line for line in log.lines() if line["event"] == "network time"]
        changes = [line for line in log.lines() if line["event"].startswith("CANopen node")]
    texts = {line["event"] for line in changes}
    assert texts == {f"CANopen node {state}" for state in ("operational", "pre-operational", "stopped")}
    assert len(changes) <= len(texts) * (EACH + 3600 / PERIOD + 2)
    assert sum(line.get("merged", 1) for line in changes) >= 4 * 3600, "none is lost uncounted"
    assert EACH <= len(clocks) <= EACH + 3600 / PERIOD + 2


def test_a_bit_rate_that_is_not_the_mapping_s_is_a_problem(
    station: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(station.link, "_other_bit_rate", 250_000)
    node = station.link.node
    node.bus, node.nmt.state = BusState.ACTIVE, NmtState.OPERATIONAL
    health = station.link.health()
    assert health.level is Level.WARN
    assert "250000 bit/s, but the mapping says 500000" in health.problems[0]


async def test_another_node_with_our_id_is_a_problem_until_it_is_gone(
    station: Station, caplog: pytest.LogCaptureFixture
) -> None:
    async with running(station):
        await until(lambda: station.frames(HEARTBEAT))
        for _ in range(3):
            station.send(HEARTBEAT, b"\5")
        await until(lambda: station.frames(0x085))
        assert station.frames(0x085)[0][:2] == b"\x50\x81"
        assert any("node-ID 5 too" in problem for problem in station.link.health().problems)
        node = station.link.node
        node.errors.tick(time.monotonic() + DOUBLED_TIME)
        assert not any("too" in problem for problem in station.link.health().problems)
    assert sum("another node" in record.getMessage() for record in caplog.records) == 1
