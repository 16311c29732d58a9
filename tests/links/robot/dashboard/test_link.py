"""The link at a simulated robot: commands, states, losses, reloads. End to end: tests/e2e/test_dashboard.py."""

from __future__ import annotations

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.events import EventKind
from gatewayd.core.image import Quality
from gatewayd.core.refusal import Reason
from gatewayd.core.succession import succeed
from gatewayd.links.contract import Level, Passage
from gatewayd.links.robot.dashboard import link as module
from gatewayd.links.robot.dashboard.link import DashboardLink
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from gatewayd.links.robot.dashboard.results import CommandResult
from gatewayd.loop import clock
from tests.links.robot.dashboard.cells import (
    HALT,
    LOADED,
    MODE,
    PLC,
    PROGRAM,
    REMOTE,
    RESULT,
    START,
    STATE,
    UP,
    planned,
    rigged,
)


async def test_a_command_is_sent_once_and_its_answer_shown() -> None:
    async with rigged() as rig:
        assert (rig.value(MODE), rig.value(STATE), rig.value(LOADED), rig.value(REMOTE)) == (7, 2, 1, True)
        rig.give(HALT)
        assert rig.value(RESULT) == CommandResult.UNDER_WAY
        await rig.result(CommandResult.DONE)
        assert rig.details(EventKind.COMMANDED) == ["stop"]
        assert rig.details(EventKind.COMMAND_DONE) == ["Stopped"]
        assert rig.server.heard.count("stop") == 1
        figures = rig.link.health().figures
        assert (figures["commands"], figures["result"], figures["answer"]) == (1, "carried out", "Stopped")
        assert rig.cell.health.words == {"dashboard_state": 3, "dashboard_result": 2}


async def test_known_obstacles_are_not_sent() -> None:
    async with rigged() as rig:
        rig.write(START, True)
        assert rig.value(RESULT) == CommandResult.NOT_CLEARED
        rig.server.polyscope.loaded = None
        await rig.until(lambda: rig.value(LOADED) == 0)
        rig.give(START)
        assert rig.value(RESULT) == CommandResult.NO_PROGRAM
        rig.server.polyscope.remote = False
        await rig.until(lambda: rig.value(REMOTE) is False)
        rig.give(HALT)
        assert rig.value(RESULT) == CommandResult.LOCAL_CONTROL
        assert rig.cell.health.words["dashboard_state"] == 2
        assert rig.link.health().words == "local control"
        assert not {"play", "stop"}.intersection(rig.server.heard)
        assert rig.link.health().figures["refused"] == {
            "local_control": 1,
            "no_program": 1,
            "not_cleared": 1,
        }
        assert len(rig.details(EventKind.COMMAND_REFUSED)) == 3


async def test_the_robots_own_refusals_have_their_words() -> None:
    async with rigged() as rig:
        rig.give(PROGRAM, 2)
        await rig.result(CommandResult.FILE_NOT_FOUND)
        assert rig.details(EventKind.COMMAND_REFUSED) == [
            "the controller does not have the program (File not found: none.urp)"
        ]


async def test_one_command_at_a_time() -> None:
    async with rigged() as rig:
        rig.give(HALT)
        rig.give(START)
        assert rig.value(RESULT) == CommandResult.BUSY
        await rig.result(CommandResult.DONE)
        assert "play" not in rig.server.heard


async def test_without_the_server_commands_are_refused_and_states_stale() -> None:
    async with rigged() as rig:
        port = rig.server.port
        await rig.server.stop()
        await rig.until(lambda: rig.value(UP) is False)
        refusal = rig.cell.write(PLC, [Change(START, value=False)], clock.now())
        assert refusal is not None
        assert refusal.reason is Reason.CLAIMED_ELSEWHERE
        assert rig.cell.image.quality[MODE] is Quality.STALE
        assert rig.good(RESULT)
        assert rig.good(UP)
        await rig.until(lambda: rig.link.health().level is Level.BAD and bool(rig.link.health().problems))
        assert "connection" in rig.link.health().problems[0]
        assert rig.server.port == port
        await rig.server.start()
        await rig.until(lambda: rig.value(UP) is True and rig.good(MODE))
        rig.write(START, True)
        assert rig.value(RESULT) == CommandResult.NOT_CLEARED


async def test_states_of_a_silent_server_are_stale(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MIN_STALE_AFTER", 0.1)
    monkeypatch.setattr(module, "STALE_PERIODS", 1)
    async with rigged() as rig:
        rig.server.silent = True
        await rig.until(lambda: rig.cell.image.quality[MODE] is Quality.STALE)
        assert rig.good(RESULT)


async def test_a_silent_robot_starts_nothing() -> None:
    async with rigged() as rig:
        rig.write(START, False)
        rig.robot.controller.faults.freeze = True
        rig.cell.freshness.tick(clock.now() + 10)
        rig.write(START, True)
        assert rig.value(RESULT) == CommandResult.ROBOT_AWAY
        assert "play" not in rig.server.heard


async def test_a_reload_goes_on_by_the_same_connection_and_forgets_what_was_written() -> None:
    async with rigged() as rig:
        rig.give(HALT)
        await rig.result(CommandResult.DONE)
        rig.write(START, False)
        plan = planned(
            dashboard=f", dashboard: {{port: {rig.server.port}, poll: 100ms, programs: {{5: pick.urp}}}}"
        )
        now = clock.now()
        later = succeed(rig.cell, plan.cell, now).cell
        rig.link.rebind(plan.the(DashboardPlan), later, now)
        rig.cell = later
        assert rig.value(RESULT) == CommandResult.DONE
        assert rig.value(LOADED) == 5
        rig.write(START, True)
        assert rig.value(RESULT) == CommandResult.NOT_CLEARED
        assert rig.server.heard.count("play") == 0
        assert rig.link.client.connections == 1


async def test_a_reload_without_a_connection_offers_nothing() -> None:
    plan = planned()
    cell = Cell(plan.cell)
    link = DashboardLink(plan.the(DashboardPlan), cell)
    later = succeed(cell, plan.cell, 1.0).cell
    link.rebind(plan.the(DashboardPlan), later, 1.0)
    assert not later.image.available[START]


async def test_a_trace_shows_lines() -> None:
    passed: list[Passage] = []
    async with rigged() as rig:
        rig.link.trace(passed.append)
        await rig.until(lambda: len(passed) > 1)
        rig.link.trace(None)
    assert {passage.outgoing for passage in passed} == {True, False}
    assert passed[0].peer == f"127.0.0.1:{rig.server.port}"
