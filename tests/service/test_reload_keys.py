"""Every key of the mapping language, changed in a running cell in which two owners drive a value each.

`plc` owns `number` by Modbus, `line` owns `speed` by an RPDO. For each change: which kinds of objections there were,
and, once these were accepted, who still owns what it owned. What an owner keeps the robot keeps, and what it loses
falls back there. A key of the language that stands in no row fails: decide what a reload does with it.
"""

from __future__ import annotations

import asyncio
import json
import re
import socket
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager, closing, suppress
from copy import deepcopy
from itertools import chain
from pathlib import Path
from typing import Any
from uuid import uuid4

import can
import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.events import EventKind
from gatewayd.core.objection import ObjectionKind
from gatewayd.links.modbus_server.listeners import Listeners
from gatewayd.mapping.worker import compile_files
from gatewayd.service import reload as reload_module
from gatewayd.service.daemon import Daemon
from gatewayd.service.reload import Reloader, Result
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.server import SimulatedController
from tests.contracts import language
from tests.links.modbus_server.secured import make_certificates
from tests.service.reload_table import (
    BASE,
    BOTH,
    CHANNEL,
    LINE,
    MODBUS_PORT,
    NEXT_TLS,
    OTHER_PORT,
    PLC,
    REMOVED,
    ROBOT_PORT,
    ROWS,
    SECURED_SECTION,
    TLS_PORT,
    TRUST,
    Changes,
    Row,
)
from tests.service.test_reload import CompiledHere


def put(mapping: dict[str, Any], changes: Changes) -> None:
    """Set keys by their paths."""
    for path, value in changes.items():
        *above, last = path.split(".")
        place = mapping
        for part in above:
            place = place.setdefault(part, {})
        if value is REMOVED:
            del place[last]
        else:
            place[last] = deepcopy(value)


class Rig:
    """A daemon with one cell, its robot, its PLC and its CAN peer."""

    def __init__(self, directory: Path, robot: SimulatedController) -> None:
        self.robot = robot
        self.file = directory / "press.yaml"
        self.trust = directory / "trust"
        self.ports = {name: _free_port() for name in (MODBUS_PORT, OTHER_PORT, TLS_PORT, NEXT_TLS)}
        self.channel = str(uuid4())
        self.write({})
        self.daemon = Daemon(compile_files([str(self.file)]).plans, directory)
        self.reloader = Reloader(self.daemon, [directory])
        self.peer = can.Bus(self.channel, interface="virtual")
        self.wire: asyncio.StreamWriter | None = None

    def write(self, *changes: Changes) -> None:
        mapping = deepcopy(BASE)
        for each in changes:
            put(mapping, each)
        text = re.sub(r'"(0x[0-9A-F.x]+)"', r"\1", json.dumps(mapping))  # COB-IDs are written so
        text = text.replace(f'"{ROBOT_PORT}"', str(self.robot.port))
        for name, port in self.ports.items():
            text = text.replace(name, f"127.0.0.1:{port}")
        self.file.write_text(text.replace(CHANNEL, self.channel).replace(TRUST, str(self.trust)))

    @property
    def cell(self) -> Cell:
        return self.daemon.runtimes[0].cell

    def owners(self) -> str:
        """Who owns what it drove: `plc line`."""
        definition, owners = self.cell.definition, self.cell.ownership.owners
        pairs = zip(definition.locks, owners, strict=True)
        held = {lock.name: definition.writer_name(owner) for lock, owner in pairs if owner is not None}
        return " ".join(filter(None, (held.get("motion") or held.get("number"), held.get("speed"))))

    async def drive(self) -> None:
        """Both own what they drive, and the robot has it."""
        await until(lambda: self.cell.accepts_writes and self._listening())
        if self.wire is not None:
            self.wire.close()
        _reader, self.wire = await asyncio.open_connection("127.0.0.1", self.ports[MODBUS_PORT])
        self.wire.write(bytes.fromhex("0001 0000 000b 01 10 0001 0002 04 0000 004d"))

        def commanded() -> bool:
            """The node may have to boot before it hears."""
            self.send(0x707, b"\5")
            self.send(0x205, b"\x37\0\0\0")
            return self.owners() == BOTH

        await until(commanded)
        await until(lambda: self.in_robot() == (77, 55))

    def _listening(self) -> bool:
        shared = self.daemon.shared.of("modbus")
        assert isinstance(shared, Listeners)
        return bool(shared.listeners) and all(listener.listening for listener in shared.listeners)

    def send(self, can_id: int, data: bytes) -> None:
        self.peer.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    def in_robot(self) -> tuple[object, object]:
        return self.robot.get("input_int_register_0"), self.robot.get("input_int_register_1")

    async def judge(self, each: Row) -> tuple[str, str]:
        """Kinds of objections, and who keeps what it owns; the robot is as it should be by that."""
        self.write(each.given)
        assert (await self.reloader.reload(force=True)).result.is_good, self.reloader.last
        try:
            await self.drive()
        except TimeoutError:
            raise AssertionError(f"{each.changes}: {self.owners()}, {self.in_robot()}") from None
        before = self.cell.events.count
        self.write(each.given, each.changes)
        outcome = await self.reloader.reload()
        kinds = outcome.kinds
        if outcome.result is Result.REFUSED:
            assert (self.owners(), self.in_robot()) == (BOTH, (77, 55)), "the old mapping runs on"
            outcome = await self.reloader.reload(accept=kinds)
        if not outcome.result.is_good:
            return "failed", outcome.text
        kept = self.owners()
        values = (77 if PLC in kept else 0, 55 if LINE in kept else 0)
        try:
            await until(lambda: self.in_robot() == values)
        except TimeoutError:
            return "robot", f"{kept}: {self.in_robot()}"
        await asyncio.sleep(0.05)
        assert self.owners() == kept, "what time brings"
        if kept != BOTH and outcome.result is Result.APPLIED and self.cell.definition.name == "press":
            events = list(self.cell.events)[before - self.cell.events.count :]
            assert any(event.kind is EventKind.RELEASED for event in events), "it is seen"
        return " ".join(kinds), kept


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(5):
        while not condition():  # noqa: ASYNC110  what is waited for is somebody else's state
            await asyncio.sleep(0.002)


def _free_port() -> int:
    with closing(socket.create_server(("127.0.0.1", 0))) as probe:
        return int(probe.getsockname()[1])


@asynccontextmanager
async def rigged(directory: Path) -> AsyncIterator[Rig]:
    async with SimulatedController(Controller()) as robot:
        rig, stop = Rig(directory, robot), asyncio.Event()
        running = asyncio.create_task(rig.daemon.run(stop))
        try:
            yield rig
        finally:
            rig.peer.shutdown()
            if rig.wire is not None:
                rig.wire.close()
            stop.set()
            async with asyncio.timeout(5):
                with suppress(asyncio.CancelledError):
                    await running


def _rows() -> Iterable[Row]:
    return chain.from_iterable(ROWS.values())


@pytest.mark.parametrize("section", ROWS)
async def test_a_changed_key(section: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reload_module, "Compilation", CompiledHere)
    wrong = []
    if section == SECURED_SECTION:
        make_certificates(tmp_path / "trust")
    async with rigged(tmp_path) as rig:
        for each in ROWS[section]:
            found = await rig.judge(each)
            if found != (each.kinds, each.kept):
                wrong.append(f"{each.changes}: {found} {rig.reloader.last and rig.reloader.last.reasons}")
    assert not wrong, "\n".join(wrong)


def test_every_key_of_the_language_is_decided() -> None:
    known = language()
    assert isinstance(known, dict)
    assert known.keys() - {key for each in _rows() for key in each.key.split()} == set(), (
        "add a row to reload_table.py: what does a reload do?"
    )


def test_every_kind_of_objection_is_raised() -> None:
    elsewhere = {ObjectionKind.LEFT, ObjectionKind.NUMBERS}  # test_objections.py, tests/report/test_diff.py
    raised = {kind for each in _rows() for kind in each.kinds.split()}
    assert set(ObjectionKind) - elsewhere == raised
