"""What the probes measure, and that they do so through reloads without counting twice."""

from __future__ import annotations

import asyncio
import time
from contextlib import suppress

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction
from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal import Reason
from gatewayd.core.requester import Requester
from gatewayd.links.contract import SourceLink
from gatewayd.service.cell_runtime import CellRuntime
from gatewayd.service.daemon import Daemon
from gatewayd.web.probes import CellProbe, Probes
from tests.web.press import PLC, START


class Link(SourceLink):
    def __init__(self) -> None:
        self.sent_listeners = []

    def send(self) -> None:
        for listener in self.sent_listeners:
            listener()


def test_events_before_and_after_attaching_are_counted_once(cell: Cell, probes: Probes) -> None:
    probe = probes.of(cell)
    before = probe.events[EventKind.REFUSED]
    assert (before, probe.refusals[Reason.NOT_WRITABLE]) == (1, 1)
    probes.look(time.monotonic())
    cell.events.append(Event(1.0, EventKind.REFUSED, reason=Reason.HELD, repeats=4))
    assert probe.events[EventKind.REFUSED] == before + 5
    assert probe.refusals[Reason.HELD] == 5


def test_a_successor_with_the_old_ring_is_not_counted_again(cell: Cell) -> None:
    probe, link = CellProbe(), Link()
    probe.attach(cell, link)
    counted = probe.events.total()
    successor = Cell(cell.definition)
    successor.events = cell.events
    probe.attach(successor, link)
    assert probe.events.total() == counted
    successor.events.append(Event(1.0, EventKind.FRESH))
    assert probe.events.total() == counted + 1
    assert len(link.sent_listeners) == 1


def test_a_successor_with_a_new_ring_is_counted_whole(cell: Cell) -> None:
    probe = CellProbe()
    probe.attach(cell, Link())
    counted = probe.events.total()
    successor = Cell(cell.definition)
    successor.events.append(Event(1.0, EventKind.FRESH))
    probe.attach(successor, Link())
    assert probe.events.total() == counted + 1


def test_each_package_is_measured_once(cell: Cell, probes: Probes) -> None:
    measured = probes.of(cell).package_to_image
    before = measured.count
    now = time.monotonic()
    cell.package_arrived(2.0, now)
    cell.outputs_written(now)
    for listener in cell.listeners:
        listener(Direction.OUTPUT)
    assert measured.count == before + 1
    assert 0 <= measured.total < 5


def test_a_write_is_measured_until_it_is_sent(cell: Cell) -> None:
    probe, link = CellProbe(), Link()
    probe.attach(cell, link)
    link.send()
    assert probe.write_to_package.count == 0
    assert cell.write(Requester(PLC), [Change(START, False)], time.monotonic() - 0.01) is None
    assert cell.write(Requester(PLC), [Change(START, True)], time.monotonic()) is None
    link.send()
    link.send()
    assert probe.write_to_package.count == 1
    assert probe.write_to_package.total >= 0.01


def test_a_write_that_the_robot_never_saw_is_not_measured(cell: Cell) -> None:
    probe, link = CellProbe(), Link()
    probe.attach(cell, link)
    cell.write(Requester(PLC), [Change(START, False)], time.monotonic())
    cell.robot_lost("cable", time.monotonic())
    link.send()
    assert probe.write_to_package.count == 0


async def test_a_blocked_loop_shows_as_lag(probes: Probes) -> None:
    running = asyncio.create_task(probes.run())
    await asyncio.sleep(0.05)
    time.sleep(0.2)  # noqa: ASYNC251 - the very thing to be seen
    await asyncio.sleep(0.05)
    running.cancel()
    with suppress(asyncio.CancelledError):
        await running
    assert probes.lag.total > 0.1


def test_a_part_that_stands_still_is_late(runtime: CellRuntime, daemon: Daemon) -> None:
    probes, now = Probes(daemon), time.monotonic()
    for step in range(4):
        runtime.cell.health.heartbeat += 1
        probes.look(now + step / 2)
    assert "robot link of press" in probes.late
    assert "core of press" not in probes.late


def test_troubles_are_those_of_the_start_and_of_the_listeners(daemon: Daemon) -> None:
    probes = Probes(daemon, lambda: ["1 mapping file not served"])
    assert probes.troubles() == ["1 mapping file not served", "not listening on 127.0.0.1:15020"]


def test_troubles_of_audit_and_log_are_troubles(runtime: CellRuntime, daemon: Daemon) -> None:
    assert runtime in daemon.runtimes
    probes = Probes(daemon, lambda: ["1 mapping file not served"], lambda: ["nobody has read the log"])
    assert {"1 mapping file not served", "nobody has read the log"} <= set(probes.troubles())
    _, answer = probes.readiness(time.monotonic())
    reasons = answer["reasons"]
    assert isinstance(reasons, list)
    assert {"1 mapping file not served", "nobody has read the log"} <= set(reasons)
