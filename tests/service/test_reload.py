"""Reloading in one process: what is refused, what the old mapping survives, which links stay up. Rest: tests/e2e."""

from __future__ import annotations

import asyncio
import logging
import socket
import struct
import time
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.events import EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.objection import ObjectionKind
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.listeners import Listeners
from gatewayd.mapping.compiled import Compiled
from gatewayd.mapping.worker import compile_files
from gatewayd.service import reload as reload_module
from gatewayd.service import startup as startup_module
from gatewayd.service.cell_runtime import CellRuntime
from gatewayd.service.compilation import Compilation
from gatewayd.service.daemon import Daemon
from gatewayd.service.reload import Reloader, ReloadOutcome, Result
from gatewayd.service.startup import load_plans
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.program import DEMO, parse
from gatewayd.simulator.server import SimulatedController

HEAD = """\
gatewayd: 1
cell: {name}
robot: {{host: 127.0.0.1, port: {robot}, stale_after: 5s{options}}}
modbus: {{listen: '127.0.0.1:{port}', unit: {unit}}}
writers: {{plc: {{modbus: 127.0.0.1}}, hmi: {{modbus: 127.0.0.3}}}}
variables:
"""
VARIABLES = """\
  bit:    {robot: input_bit_register_3, modbus: 0.3, owner: plc}
  number: {robot: input_int_register_0, modbus: 1, owner: [plc, hmi], limits: [0, 100]}
  real:   {robot: input_double_register_0, modbus: 3, on_release: -1.5}
  echo:   {robot: output_int_register_0, modbus: 100}
  lamp:   {robot: output_bit_register_3, modbus: 102.3}
"""
MORE = "  again:  {robot: output_int_register_0, modbus: 110}\n"
NEW_FIELD = "  fresh:  {robot: output_int_register_7, modbus: 112}\n"
PLC = 0


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def listeners(daemon: Daemon) -> list[ModbusListener]:
    shared = daemon.shared.of("modbus")
    assert isinstance(shared, Listeners)
    return shared.listeners


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(10):
        while not condition():  # noqa: ASYNC110  what is waited for is somebody else's state
            await asyncio.sleep(0.002)


@dataclass
class Rig:
    robot: SimulatedController
    daemon: Daemon
    reloader: Reloader
    directory: Path
    port: int
    outcomes: list[ReloadOutcome]

    def write(
        self,
        variables: str = VARIABLES,
        name: str = "press",
        options: str = "",
        port: int | None = None,
        unit: int = 1,
    ) -> None:
        text = HEAD.format(
            name=name,
            robot=self.robot.port,
            options=options,
            port=self.port if port is None else port,
            unit=unit,
        )
        (self.directory / f"{name}.yaml").write_text(text + variables)

    @property
    def runtime(self) -> CellRuntime:
        return self.daemon.runtimes[0]

    @property
    def cell(self) -> Cell:
        return self.runtime.cell

    def set(self, variable: str, value: float) -> None:
        names = [one.name for one in self.cell.definition.variables]
        refusal = self.cell.write(Requester(PLC), [Change(names.index(variable), value)], time.monotonic())
        assert refusal is None, refusal

    def value(self, variable: str) -> object:
        names = [one.name for one in self.cell.definition.variables]
        return self.cell.image.values[names.index(variable)]

    def owners(self) -> dict[str, str]:
        definition = self.cell.definition
        return {
            lock.name: definition.writers[owner].name
            for lock, owner in zip(definition.locks, self.cell.ownership.owners, strict=True)
            if owner is not None
        }

    def happened(self, kind: EventKind) -> int:
        return sum(event.kind is kind for event in self.cell.events)


class CompiledHere(Compilation):
    """In this process, which takes a tenth of the time; tests/e2e/test_reload.py has the other one."""

    def __init__(self, names: Iterable[Path]) -> None:
        self._names = [str(name) for name in names]

    def __exit__(self, *_exception: object) -> None:
        pass

    def result(self, _given_up: Callable[[], bool] = lambda: False) -> Compiled:
        return compile_files(self._names)


@pytest.fixture(autouse=True)
def _here(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (reload_module, startup_module):
        monkeypatch.setattr(module, "Compilation", CompiledHere)


Rigged = Callable[[], AbstractAsyncContextManager[Rig]]


@pytest.fixture
def rigged(tmp_path: Path) -> Rigged:
    """A daemon for the directory, running against a controller, its robot writable."""

    @asynccontextmanager
    async def run() -> AsyncIterator[Rig]:
        async with SimulatedController(Controller(program=parse(DEMO))) as robot:
            outcomes: list[ReloadOutcome] = []
            rig = Rig(robot, Daemon([], tmp_path), None, tmp_path, free_port(), outcomes)  # type: ignore[arg-type]
            rig.write()
            rig.daemon = Daemon(load_plans([tmp_path]).plans, tmp_path)
            rig.reloader = Reloader(rig.daemon, [tmp_path], ended=outcomes.append)
            stop = asyncio.Event()
            running = asyncio.create_task(rig.daemon.run(stop))
            try:
                await until(lambda: rig.cell.accepts_writes and listeners(rig.daemon)[0].listening)
                yield rig
            finally:
                stop.set()
                async with asyncio.timeout(5):
                    await running

    return run


async def read(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, address: int, count: int) -> bytes:
    """The registers, or the function code and exception."""
    writer.write(struct.pack(">HHHBBHH", 7, 0, 6, 1, 3, address, count))
    head = await asyncio.wait_for(reader.readexactly(7), 5)
    body = await asyncio.wait_for(reader.readexactly(struct.unpack(">HHHB", head)[2] - 1), 5)
    return body[2:] if body[0] == 3 else body


async def write(
    reader: asyncio.StreamReader, writer: asyncio.StreamWriter, address: int, value: int, unit: int = 1
) -> bytes:
    """Function 16 with an int32: the function code, or that and the exception."""
    writer.write(struct.pack(">HHHBBHHBi", 7, 0, 11, unit, 16, address, 2, 4, value))
    head = await asyncio.wait_for(reader.readexactly(7), 5)
    body = await asyncio.wait_for(reader.readexactly(struct.unpack(">HHHB", head)[2] - 1), 5)
    return body[:1] if body[0] == 16 else body


async def test_nothing_changed_touches_nothing(rigged: Rigged) -> None:
    async with rigged() as rig:
        cell = rig.cell
        outcome = await rig.reloader.reload()
        assert (outcome.result, outcome.exit_code, outcome.notes) == (Result.UNCHANGED, 0, ())
        assert rig.cell is cell


async def test_a_new_place_for_a_known_field_keeps_every_link(rigged: Rigged) -> None:
    async with rigged() as rig:
        reader, writer = await asyncio.open_connection("127.0.0.1", rig.port)
        rig.set("number", 42)
        rig.write(VARIABLES + MORE)
        link = rig.runtime.source
        outcome = await rig.reloader.reload()
        print(f"swap {outcome.swap * 1000:.2f} ms")
        assert outcome.text == "reloaded: press: 1 variable added"
        assert rig.runtime.source is link
        assert rig.cell.health.sessions == 1
        assert rig.owners() == {"number": "plc"}
        assert rig.cell.writers.connections == [1, 0]
        await until(lambda: rig.robot.get("output_int_register_0") == 42)
        await until(lambda: rig.value("again") == 42)
        assert await read(reader, writer, 110, 2) == b"\x00\x00\x00\x2a"
        rig.set("number", 43)
        await until(lambda: rig.robot.get("input_int_register_0") == 43)
        writer.close()
        await until(lambda: rig.owners() == {})
        await until(lambda: rig.robot.get("input_int_register_0") == 0)


async def test_a_new_field_needs_another_session(rigged: Rigged) -> None:
    """It is announced, what was owned stays owned, and what the robot holds is taken over again."""
    async with rigged() as rig:
        _reader, writer = await asyncio.open_connection("127.0.0.1", rig.port)
        await until(lambda: rig.cell.writers.alive[PLC])
        rig.set("number", 42)
        rig.write(VARIABLES + NEW_FIELD)
        packages = rig.cell.health.packages
        outcome = await rig.reloader.reload()
        assert outcome.result is Result.APPLIED
        assert rig.cell.freshness.state is Source.LOST
        start = time.monotonic()
        await until(lambda: rig.cell.accepts_writes)
        print(f"robot back after {(time.monotonic() - start) * 1000:.0f} ms")
        assert rig.owners() == {"number": "plc"}
        assert rig.value("number") == 42
        assert rig.happened(EventKind.ROBOT_CONNECTED) == 2
        assert rig.happened(EventKind.UNAVAILABLE) == 0, "the old session was over before the new one claimed"
        assert rig.cell.health.packages > packages
        writer.close()


async def test_a_removed_output_keeps_the_session_and_its_return_too(rigged: Rigged) -> None:
    async with rigged() as rig:
        rig.write(VARIABLES.replace("  lamp:   {robot: output_bit_register_3, modbus: 102.3}\n", ""))
        assert (await rig.reloader.reload()).result is Result.APPLIED
        rig.write(VARIABLES)
        assert (await rig.reloader.reload()).result is Result.APPLIED
        assert rig.cell.health.sessions == 1


async def test_a_removed_input_gets_its_fallback_and_leaves_the_rest(rigged: Rigged) -> None:
    async with rigged() as rig:
        rig.set("real", 9.5)
        rig.set("bit", value=True)
        await until(lambda: rig.robot.get("input_double_register_0") == 9.5)
        rig.write("".join(line for line in VARIABLES.splitlines(keepends=True) if "real:" not in line))
        refused = await rig.reloader.reload()
        assert refused.result is Result.REFUSED
        assert refused.text == (
            "reload refused, the old mapping runs on: press: `real` is owned by plc now and would be removed "
            "[release] (gatewayd reload --accept release applies it anyway)"
        )
        assert refused.exit_code == 1
        assert rig.value("real") == 9.5
        assert (await rig.reloader.reload(force=True)).result is Result.APPLIED
        await until(lambda: rig.robot.get("input_double_register_0") == -1.5)
        await until(lambda: rig.cell.accepts_writes)
        assert rig.robot.get("input_bit_registers0_to_31") == 8
        assert rig.owners() == {"bit": "plc"}


@pytest.mark.parametrize("policy, after", [("hold", 17), ("clear", 0)])
async def test_a_renamed_input_goes_on_with_what_the_robot_was_given_last(
    rigged: Rigged, policy: str, after: int
) -> None:
    """Its lock is released with the old fallback, because it is another one; the session stays."""
    async with rigged() as rig:
        variables = VARIABLES.replace("limits: [0, 100]", f"limits: [0, 100], on_release: {policy}")
        rig.write(variables)
        assert (await rig.reloader.reload(force=True)).result.is_good
        rig.set("number", 17)
        rig.write(variables.replace("number:", "count: "))
        assert (await rig.reloader.reload(force=True)).result is Result.APPLIED
        assert (rig.cell.health.sessions, rig.value("count"), rig.owners()) == (1, after, {})
        await until(lambda: rig.robot.get("input_int_register_0") == after)
        rig.set("count", 6)
        await until(lambda: rig.robot.get("input_int_register_0") == 6)


@pytest.mark.parametrize("broken, said", [
    ("  echo: {robot: output_int_register_0, modbus: 100}\n  lamp: {robot: nothing, modbus: 101}\n", "GW3"),
    ("  echo: [\n", "press.yaml:"),
    ("  echo: {robot: output_int_registr_0, modbus: 100}\n", "did you mean `output_int_register_0`"),
])  # fmt: skip
async def test_a_broken_file_changes_nothing(rigged: Rigged, broken: str, said: str) -> None:
    async with rigged() as rig:
        cell = rig.cell
        rig.write(broken)
        outcome = await rig.reloader.reload(force=True)
        assert (outcome.result, outcome.exit_code) == (Result.FAILED, 1)
        assert said in outcome.text
        assert outcome.notes == (outcome.text,)
        assert rig.cell is cell
        assert rig.outcomes == [outcome] == [rig.reloader.last]


async def test_a_missing_or_empty_directory_changes_nothing(rigged: Rigged) -> None:
    async with rigged() as rig:
        (rig.directory / "press.yaml").unlink()
        outcome = await rig.reloader.reload(force=True)
        assert outcome.result is Result.FAILED
        assert "no mapping file" in outcome.text
        assert len(rig.daemon.runtimes) == 1


async def test_cells_come_and_go_with_their_files(rigged: Rigged) -> None:
    async with rigged() as rig:
        first = rig.cell
        rig.write("  count: {robot: output_int_register_5, modbus: 0}\n", name="stamp", unit=2)
        outcome = await rig.reloader.reload(accept=[ObjectionKind.WEAKENING])
        assert outcome.text == "reloaded: stamp: new cell, 1 variable"
        assert rig.cell is first, "who did not change is not touched"
        stamp = rig.daemon.runtimes[1]
        await until(lambda: stamp.cell.freshness.state is Source.FRESH)
        await until(lambda: rig.robot.clients == 2)
        rig.set("real", 9.5)
        await until(lambda: rig.robot.get("input_double_register_0") == 9.5)
        (rig.directory / "press.yaml").unlink()
        outcome = await rig.reloader.reload()
        assert outcome.result is Result.REFUSED
        assert "press: the whole cell would be gone" in outcome.text
        assert (await rig.reloader.reload(force=True)).result is Result.APPLIED
        assert [runtime.plan.cell.name for runtime in rig.daemon.runtimes] == ["stamp"]
        await until(lambda: rig.robot.get("input_double_register_0") == -1.5)
        assert stamp.cell.health.sessions == 1


async def test_a_second_cell_takes_the_unit_ids_0_and_255_from_nobody_unasked(rigged: Rigged) -> None:
    """Who writes by them would be answered 0B and own what it drives for ever, or drive another robot."""
    async with rigged() as rig:
        wires = await asyncio.open_connection("127.0.0.1", rig.port)
        for unit, value in ((255, 40), (0, 41)):
            assert await write(*wires, 1, value, unit=unit) == b"\x10"
        rig.write("  count: {robot: output_int_register_5, modbus: 0}\n", name="stamp", unit=2)
        outcome = await rig.reloader.reload()
        assert outcome.kinds == (ObjectionKind.RELEASE,)
        (reason,) = outcome.reasons
        assert reason == (
            "press: clients that ask for the unit ids 0 and 255 would find nobody; `default_unit: true` keeps them; "
            "`number` is owned by such a client and would be released [release]"
        )
        assert rig.owners() == {"number": "plc"}
        path = rig.directory / "press.yaml"
        path.write_text(path.read_text().replace("unit: 1}", "unit: 1, default_unit: true}"))
        assert (await rig.reloader.reload()).result is Result.APPLIED
        assert await write(*wires, 1, 42, unit=255) == b"\x10"
        rig.write()
        assert (await rig.reloader.reload()).kinds == (ObjectionKind.RELEASE,)
        assert (await rig.reloader.reload(accept=[ObjectionKind.RELEASE])).result is Result.APPLIED
        await until(lambda: rig.robot.get("input_int_register_0") == 0)
        assert rig.owners() == {}
        assert await write(*wires, 1, 43, unit=255) == b"\x90\x0b"
        assert await write(*wires, 1, 44) == b"\x10", "it may write by the cell's own"
        wires[1].close()


async def test_who_writes_over_gaps_is_not_refused_unasked(rigged: Rigged) -> None:
    """A whole block would be answered with 02 from then on, and its owner fall back by its time-out."""
    async with rigged() as rig:
        path = rig.directory / "press.yaml"
        strict = path.read_text()
        path.write_text(strict.replace("unit: 1}", "unit: 1, write_gaps: ignore}"))
        assert (await rig.reloader.reload()).result is Result.APPLIED
        path.write_text(strict)
        assert not (await rig.reloader.reload()).kinds, "nobody has written over any"
        path.write_text(strict.replace("unit: 1}", "unit: 1, write_gaps: ignore}"))
        assert (await rig.reloader.reload()).result is Result.APPLIED
        wires = await asyncio.open_connection("127.0.0.1", rig.port)
        wires[1].write(struct.pack(">HHHBBHHBid2H", 7, 0, 23, 1, 16, 1, 8, 16, 7, 0.5, 1, 1))
        assert (await asyncio.wait_for(wires[0].readexactly(12), 5))[7] == 16
        path.write_text(strict)
        outcome = await rig.reloader.reload()
        assert outcome.kinds == (ObjectionKind.RELEASE,)
        assert "press: who writes blocks that cover gaps would be refused with 02" in outcome.text
        assert (await rig.reloader.reload(accept=outcome.kinds)).result is Result.APPLIED
        wires[1].close()


async def test_cells_are_checked_together(rigged: Rigged) -> None:
    async with rigged() as rig:
        rig.write("  count: {robot: output_int_register_5, modbus: 0}\n", name="stamp", unit=1)
        outcome = await rig.reloader.reload(force=True)
        assert "GW206" in outcome.text
        assert len(rig.daemon.runtimes) == 1


async def test_a_listener_moves(rigged: Rigged) -> None:
    """The old port closes after the new one is open; whoever was connected loses the connection, and its locks."""
    async with rigged() as rig:
        reader, _writer = await asyncio.open_connection("127.0.0.1", rig.port)
        await until(lambda: rig.cell.writers.alive[PLC])
        rig.set("number", 42)
        port = free_port()
        rig.write(port=port)
        outcome = await rig.reloader.reload()
        assert "`number` is owned by plc now and would be released: modbus moves: listen" in outcome.text
        assert (await rig.reloader.reload(force=True)).result is Result.APPLIED
        assert await asyncio.wait_for(reader.read(), 5) == b""
        assert rig.owners() == {}
        new_reader, new_writer = await asyncio.open_connection("127.0.0.1", port)
        async with asyncio.timeout(10):  # the fallback goes out to the robot, and comes back as its echo
            while await read(new_reader, new_writer, 100, 2) != b"\x00\x00\x00\x00":
                pass
        with pytest.raises(ConnectionError):
            await asyncio.open_connection("127.0.0.1", rig.port)
        assert [listener.name for listener in listeners(rig.daemon)] == [f"127.0.0.1:{port}"]
        assert rig.cell.health.sessions == 1
        new_writer.close()


async def test_a_port_that_is_taken_changes_nothing(rigged: Rigged) -> None:
    async with rigged() as rig:
        with socket.create_server(("127.0.0.1", 0)) as other:
            rig.write(port=other.getsockname()[1])
            outcome = await rig.reloader.reload()
        assert outcome.result is Result.FAILED
        assert "cannot listen on" in outcome.text
        assert "another program listens there" in outcome.text
        assert listeners(rig.daemon)[0].address == ("127.0.0.1", rig.port)


async def test_a_wildcard_takes_the_place_of_its_own_port(rigged: Rigged) -> None:
    """It cannot be opened before the present listener is closed."""
    async with rigged() as rig:
        rig.write()
        path = rig.directory / "press.yaml"
        path.write_text(
            path.read_text().replace("listen: '127.0.0.1:", "allow: [127.0.0.0/8], listen: '0.0.0.0:")
        )
        outcome = await rig.reloader.reload()
        assert outcome.result is Result.APPLIED, outcome.text
        await until(lambda: listeners(rig.daemon)[0].listening)
        assert listeners(rig.daemon)[0].address[0] == "0.0.0.0"


async def test_a_writer_whose_peers_change_is_another_one(rigged: Rigged) -> None:
    """Who was connected under the old address is the writer no more, and owns nothing any more."""
    async with rigged() as rig:
        _reader, writer = await asyncio.open_connection("127.0.0.1", rig.port)
        await until(lambda: rig.cell.writers.alive[PLC])
        rig.set("number", 42)
        path = rig.directory / "press.yaml"
        path.write_text(path.read_text().replace("plc: {modbus: 127.0.0.1}", "plc: {modbus: 127.0.0.7}"))
        said = (await rig.reloader.reload()).text
        assert (
            "`number` is owned by plc now and would be released: 127.0.0.1 is no writer in the new mapping"
            in said
        )
        assert (await rig.reloader.reload(force=True)).result is Result.APPLIED
        assert rig.owners() == {}
        assert rig.cell.writers.alive == [False, False]
        await until(lambda: rig.robot.get("input_int_register_0") == 0)
        writer.close()


@pytest.mark.parametrize("early", [True, False])
@pytest.mark.parametrize("grace", ["", ", grace: 5s"])
async def test_what_a_writer_owned_is_not_handed_to_its_new_address_whoever_connected_first(
    rigged: Rigged, early: bool, grace: str
) -> None:
    """The new station was connected before the old one, or after it: it owns nothing in either case."""
    async with rigged() as rig:
        path = rig.directory / "press.yaml"
        path.write_text(
            path.read_text().replace("plc: {modbus: 127.0.0.1}", f"plc: {{modbus: 127.0.0.1{grace}}}")
        )
        assert (await rig.reloader.reload(force=True)).result.is_good
        wires = {}
        for host in ("127.0.0.7", "127.0.0.1") if early else ("127.0.0.1", "127.0.0.7"):
            wires[host] = await asyncio.open_connection("127.0.0.1", rig.port, local_addr=(host, 0))
            await until(lambda: listeners(rig.daemon)[0].connections == len(wires))
        assert await write(*wires["127.0.0.1"], 1, 42) == b"\x10"
        assert await write(*wires["127.0.0.7"], 1, 43) == b"\x90\x02"
        path.write_text(path.read_text().replace("plc: {modbus: 127.0.0.1", "plc: {modbus: 127.0.0.7"))
        assert (await rig.reloader.reload()).kinds == (ObjectionKind.RELEASE,)
        assert rig.owners() == {"number": "plc"}
        assert (await rig.reloader.reload(accept=[ObjectionKind.RELEASE])).result is Result.APPLIED
        assert rig.owners() == {}
        assert rig.cell.writers.connections == [1, 0]
        await until(lambda: rig.robot.get("input_int_register_0") == 0)
        assert await write(*wires["127.0.0.1"], 1, 44) == b"\x90\x02"
        assert await write(*wires["127.0.0.7"], 1, 45) == b"\x10"
        assert rig.owners() == {"number": "plc"}
        for _reader, writer in wires.values():
            writer.close()


async def test_a_shorter_idle_time_out_and_time_out_take_nothing_from_who_was_silent_for_longer(
    rigged: Rigged,
) -> None:
    async with rigged() as rig:
        reader, writer = await asyncio.open_connection("127.0.0.1", rig.port)
        assert await write(reader, writer, 1, 42) == b"\x10"
        await asyncio.sleep(0.3)  # silence is what this is about
        path = rig.directory / "press.yaml"
        short = path.read_text().replace(
            "plc: {modbus: 127.0.0.1}", "plc: {modbus: 127.0.0.1, timeout: 250ms}"
        )
        path.write_text(short.replace("modbus: {listen", "modbus: {idle_timeout: 250ms, listen"))
        outcome = await rig.reloader.reload()
        assert (outcome.result, outcome.kinds) == (Result.APPLIED, ()), outcome.text
        rig.cell.tick(time.monotonic())
        assert rig.owners() == {"number": "plc"}
        await until(lambda: rig.owners() == {})
        assert rig.happened(EventKind.WRITER_LOST) == 1
        writer.close()


async def test_asking_twice_before_it_begins_is_asking_once(rigged: Rigged) -> None:
    async with rigged() as rig:
        task = asyncio.create_task(rig.reloader.run())
        rig.write(VARIABLES + MORE)
        rig.reloader.ask()
        rig.reloader.ask()
        await until(lambda: len(rig.outcomes) == 1)
        rig.reloader.ask()
        await until(lambda: len(rig.outcomes) == 2)
        assert [one.result for one in rig.outcomes] == [Result.APPLIED, Result.UNCHANGED]
        task.cancel()


async def test_reloads_follow_each_other(rigged: Rigged) -> None:
    async with rigged() as rig:
        rig.write(VARIABLES + MORE)
        outcomes = await asyncio.gather(*(rig.reloader.reload() for _ in range(3)))
        assert [one.result for one in outcomes] == [Result.APPLIED, Result.UNCHANGED, Result.UNCHANGED]


async def test_a_defect_is_told_and_changes_nothing(
    rigged: Rigged, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(_paths: object) -> None:
        raise RuntimeError("a defect")

    async with rigged() as rig:
        monkeypatch.setattr(reload_module, "Compilation", fail)
        with caplog.at_level(logging.ERROR):
            outcome = await rig.reloader.reload()
        assert (
            outcome.text == "reload failed, the old mapping runs on: internal error: RuntimeError('a defect')"
        )
        assert rig.cell.accepts_writes


async def test_after_the_end_nothing_is_swapped(rigged: Rigged) -> None:
    async with rigged() as rig:
        rig.write(VARIABLES + MORE)
    outcome = await rig.reloader.reload()
    assert outcome.result is Result.FAILED
    assert "the gateway stops" in outcome.text


async def test_without_a_robot_it_says_what_could_not_be_given(rigged: Rigged) -> None:
    async with rigged() as rig:
        rig.set("real", 9.5)
        await rig.robot.stop()
        await until(lambda: not rig.cell.accepts_writes)
        rig.write("".join(line for line in VARIABLES.splitlines(keepends=True) if "real:" not in line))
        outcome = await rig.reloader.reload(force=True)
        assert outcome.text == (
            "reloaded: press: 1 variable removed, settings of robot changed "
            "(but the robot keeps what it holds in press: real)"
        )
        assert outcome.notes == (outcome.text,)


async def test_many_reloads_leave_no_tasks_behind(rigged: Rigged) -> None:
    async with rigged() as rig:
        for number in range(4):
            rig.write(VARIABLES + (NEW_FIELD if number % 2 else MORE))
            assert (await rig.reloader.reload()).result is Result.APPLIED
            await until(lambda: rig.cell.accepts_writes)
        # Core, robot link and listeners.
        await until(lambda: len(rig.daemon._tasks) == 3)
