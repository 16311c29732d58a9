"""The audit sees the first write, its trouble is shown, and the control socket comes and goes with the gateway."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pytest

from gatewayd.control.api import Moment
from gatewayd.control.client import Client
from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Lock, ValueKind, Variable, Writer
from gatewayd.core.requester import Requester
from gatewayd.loop import clock
from gatewayd.report.verdict import ServedCell
from gatewayd.service.operator import JUST_NOW, OperatorAccess, Standstill
from tests.works import finished


class Gateway:
    """A daemon with one cell that is in no runtime."""

    def __init__(self) -> None:
        number = Variable(1, "number", Direction.INPUT, ValueKind.INT, "input_int_register_0", lock=0)
        self.cell = Cell(
            CellDefinition("press", 1, (number,), (Lock("number", (0,), (0,)),), (Writer("plc"),), 1.0)
        )
        self.cell.robot_connected(0.0)
        self.cell.adopt({0: 0}, 0.0)

    @property
    def cells(self) -> list[Cell]:
        return [self.cell]

    @property
    def runtimes(self) -> Sequence[ServedCell]:
        return ()

    def trace(self, tap_of: object) -> None:
        """Nothing passes here."""

    def observe(self, observer: Callable[[Cell], None]) -> None:
        observer(self.cell)

    def progress(self) -> Mapping[str, int]:
        return {"core": 1}

    def troubles(self) -> Sequence[str]:
        return ()


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(10):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.005)


async def test_the_first_write_is_in_the_file_at_the_end(tmp_path: Path) -> None:
    gateway = Gateway()
    access = OperatorAccess(gateway, None, tmp_path / "audit.jsonl")
    assert gateway.cell.write(Requester(0), [Change(0, 7)], 1.0) is None
    task = asyncio.create_task(access.run())
    await asyncio.sleep(0)
    task.cancel()
    await asyncio.wait((task,))
    lines = (tmp_path / "audit.jsonl").read_text().splitlines()
    assert ['"write accepted"' in line for line in lines] == [False, True]


async def test_a_file_that_cannot_be_written_makes_the_gateway_unhealthy_and_nothing_else(
    tmp_path: Path,
) -> None:
    gateway = Gateway()
    access = OperatorAccess(gateway, None, tmp_path / "missing" / "audit.jsonl")
    assert gateway.cell.write(Requester(0), [Change(0, 7)], 1.0) is None
    moment = Moment(1.0, 2.0)
    await until(lambda: not finished(access.api.status(moment))["healthy"])
    assert finished(access.api.status(moment))["problems"] == [
        "the audit file cannot be written: No such file or directory"
    ]
    assert finished(access.api.audit({}, moment))["records"][-1]["new"] == 7


async def test_the_socket_comes_and_goes(tmp_path: Path) -> None:
    path = tmp_path / "control.sock"
    task = asyncio.create_task(OperatorAccess(Gateway(), path, None).run())
    await until(path.exists)
    assert (await asyncio.to_thread(Client(path).get, "/v1/version"))["api"] == 1
    task.cancel()
    await asyncio.wait((task,))
    assert not await asyncio.to_thread(path.exists)


def test_a_standstill_counts_for_a_moment(monkeypatch: pytest.MonkeyPatch) -> None:
    standstill = Standstill()
    assert standstill.seconds() == 0.0
    now = clock.now()
    standstill.gap(clock.Gap(now - 4.8, now))
    assert standstill.seconds() == pytest.approx(4.8)
    monkeypatch.setattr(clock, "now", lambda: now + JUST_NOW + 0.01)
    assert standstill.seconds() == 0.0


def test_gaps_between_which_little_could_be_served_are_one(monkeypatch: pytest.MonkeyPatch) -> None:
    standstill, now = Standstill(), clock.now()
    monkeypatch.setattr(clock, "now", lambda: now)
    standstill.gap(clock.Gap(now - 5.0, now - 0.2))
    standstill.gap(clock.Gap(now - 0.17, now - 0.1))
    standstill.gap(clock.Gap(now - 0.06, now))
    assert standstill.seconds() == pytest.approx(5.0)
    monkeypatch.setattr(clock, "now", lambda: now + 0.05)
    assert standstill.seconds() == 0.0, "awake for 0.12 s"
    standstill.gap(clock.Gap(now + 0.04, now + 0.1))
    monkeypatch.setattr(clock, "now", lambda: now + 0.1)
    assert standstill.seconds() == pytest.approx(0.06)
