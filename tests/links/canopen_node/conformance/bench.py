"""A device under test and the raw frames of a conformance tester.

The device is one cell with its node. It stands either at the end of a wire in memory, where time is what the tester
lets pass and is exact, or in a link of its own on a bus of python-can, where everything is as in the daemon.
"""

from __future__ import annotations

import asyncio
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import TypeVar
from uuid import uuid4

import can

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.frame import Frame, Priority
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, Value
from gatewayd.links.canopen_node.node import Node
from gatewayd.links.canopen_node.plan import CanopenPlan, canopen_of
from gatewayd.links.canopen_node.runtime import CanLink
from gatewayd.links.canopen_node.store import Store
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan

NODE = 5
MAPPING = """\
gatewayd: 1
cell: dut
robot: {host: 127.0.0.1, frequency: 50, stale_after: 60s}
canopen: {interface: virtual, channel: dut, bitrate: 500000, node: 5, heartbeat: none}
writers: {master: {canopen: any}}
variables:
  bits_in:    {robot: input_bit_register_0..15,    canopen: auto}
  ints_in:    {robot: input_int_register_0..3,     canopen: auto}
  real_in:    {robot: input_double_register_0,     canopen: auto}
  ranged:     {robot: input_int_register_4,        canopen: object, limits: [-100, 100]}
  small:      {robot: input_int_register_5,        canopen: {pdo: none, type: INTEGER16}, limits: [-500, 500]}
  bits_out:   {robot: output_bit_register_0..15,   canopen: auto}
  ints_out:   {robot: output_int_register_0..3,    canopen: auto}
  real_out:   {robot: output_double_register_0,    canopen: auto}
"""
PATIENCE = 5.0
"""Seconds for an answer on a real bus: the machine may be busy."""
TICK = 0.02
ASK = 0.002

T = TypeVar("T")


def little(value: int, size: int) -> bytes:
    """A number as it lies on the bus."""
    return value.to_bytes(size, "little", signed=value < 0)


@cache
def compiled(text: str = MAPPING) -> Plan:
    """The plan of a mapping without errors."""
    loaded = load(text.encode(), "dut.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


class Device(ABC):
    """One node with a fresh robot; `store` outlives a power cycle."""

    exact = False
    """Whether time is exact."""

    def __init__(self, plan: Plan | None = None) -> None:
        self.plan = plan if plan is not None else compiled()
        assert canopen_of(self.plan) is not None
        self.canopen: CanopenPlan = self.plan.the(CanopenPlan)
        self.store = Store()
        self.variables = {one.name: index for index, one in enumerate(self.plan.cell.variables)}

    def _new_cell(self, now: float) -> Cell:
        cell = Cell(replace(self.plan.cell, stale_after=1e9))
        cell.robot_connected(now)
        inputs = {
            index: one.kind.zero
            for index, one in enumerate(cell.definition.variables)
            if one.direction is Direction.INPUT
        }
        cell.adopt(inputs, now)
        cell.package_arrived(1.0, now)
        cell.outputs_written(now)
        return cell

    @property
    @abstractmethod
    def now(self) -> float:
        """The device's time."""

    @abstractmethod
    def power_on(self) -> None:
        """Start."""

    @abstractmethod
    def power_off(self) -> None:
        """Stop."""

    @abstractmethod
    def send(self, frame: Frame) -> None:
        """A frame of the tester."""

    @abstractmethod
    def next(self, deadline: float) -> tuple[float, Frame] | None:
        """The next frame of the device, with its time; None if there is none until the deadline."""

    @abstractmethod
    def do(self, act: Callable[[Node, Cell, float], T]) -> T:
        """Do something to the device that is no frame."""


class WireDevice(Device):
    """In memory: time stands still but for what the tester waits for."""

    exact = True

    def __init__(self, plan: Plan | None = None) -> None:
        super().__init__(plan)
        self._now = 100.0
        self._sent: deque[tuple[float, Frame]] = deque()

    @property
    def now(self) -> float:
        return self._now

    def power_on(self) -> None:
        self._cell = self._new_cell(self._now)
        self._node = Node(self.canopen, self._cell, self._send, self.store, lambda _now: True)
        self._cell.listeners.append(lambda direction: self._node.image_changed(direction, self._now))
        self._node.bus_changed(BusState.ACTIVE, self._now)
        self._node.start(self._now)

    def power_off(self) -> None:
        self._sent.clear()

    def _send(self, frame: Frame, _priority: Priority) -> bool:
        self._sent.append((self._now, frame))
        return True

    def send(self, frame: Frame) -> None:
        self._node.receive(frame, self._now)

    def next(self, deadline: float) -> tuple[float, Frame] | None:
        for _ in range(100_000):
            if self._sent:
                return self._sent.popleft()
            due = max(self._now, self._node.next_deadline(self._now))
            if due > deadline:
                self._now = max(self._now, deadline)
                return None
            self._now = due
            self._node.tick(due)
        raise AssertionError("the node is never done")

    def do(self, act: Callable[[Node, Cell, float], T]) -> T:
        return act(self._node, self._cell, self._now)


class LinkDevice(Device):
    """In its own link and loop, on python-can's virtual bus."""

    def __init__(self, plan: Plan | None = None) -> None:
        super().__init__(plan)
        self.channel = str(uuid4())
        self.canopen = replace(self.canopen, channel=self.channel)
        self._bus = can.Bus(self.channel, interface="virtual")

    @property
    def now(self) -> float:
        return time.monotonic()

    def power_on(self) -> None:
        self._cell = self._new_cell(time.monotonic())
        self._link = CanLink(self.canopen, self._cell, self.store)
        started = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._live(started)))
        self._thread.start()
        assert started.wait(PATIENCE)

    async def _live(self, started: threading.Event) -> None:
        self._loop = asyncio.get_running_loop()
        self._off = asyncio.Event()
        link = asyncio.create_task(self._link.run())
        clock = asyncio.create_task(self._tick())
        # What is sent before the bus is open, nobody hears.
        while self._cell.health.words["can_bus"] != BusState.ACTIVE + 1:  # noqa: ASYNC110 - the link reports it to nobody
            await asyncio.sleep(0.001)
        started.set()
        await self._off.wait()
        for task in (link, clock):
            task.cancel()
        await asyncio.gather(link, clock, return_exceptions=True)

    async def _tick(self) -> None:
        while True:
            self._cell.tick(time.monotonic())
            await asyncio.sleep(TICK)

    def power_off(self) -> None:
        self._loop.call_soon_threadsafe(self._off.set)
        self._thread.join()
        while self._bus.recv(0) is not None:
            pass

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()

    def send(self, frame: Frame) -> None:
        self._bus.send(
            can.Message(
                arbitration_id=frame.can_id,
                is_extended_id=False,
                is_remote_frame=frame.remote,
                dlc=frame.length if frame.remote else len(frame.data),
                data=None if frame.remote else frame.data,
            )
        )

    def next(self, deadline: float) -> tuple[float, Frame] | None:
        message = self._bus.recv(max(0.0, deadline - time.monotonic()))
        if message is None:
            return None
        return time.monotonic(), Frame(message.arbitration_id, bytes(message.data))

    def do(self, act: Callable[[Node, Cell, float], T]) -> T:
        done: list[T] = []
        event = threading.Event()

        def work() -> None:
            done.append(act(self._link.node, self._cell, time.monotonic()))
            event.set()

        self._loop.call_soon_threadsafe(work)
        assert event.wait(PATIENCE)
        return done[0]


class Tester:
    """What a conformance tester does, in the words of its cases."""

    __test__ = False  # for pytest: the name alone makes no test of it

    def __init__(self, device: Device) -> None:
        self.device = device
        self.node = NODE
        self._heard: deque[tuple[float, Frame]] = deque()

    # -- frames --------------------------------------------------------------------------------------------------

    def send(self, can_id: int, data: bytes = b"", *, remote: bool = False, length: int = 0) -> None:
        self.device.send(Frame(can_id, data, remote, length))

    def frames(self, seconds: float) -> list[tuple[float, Frame]]:
        """Everything that comes from now until so many seconds later, and what has come before."""
        deadline = self.device.now + seconds
        while (one := self.device.next(deadline)) is not None:
            self._heard.append(one)
        found = list(self._heard)
        self._heard.clear()
        return found

    def of(self, can_id: int, seconds: float) -> list[tuple[float, bytes]]:
        """The frames of one identifier, as by `frames`; the others are forgotten."""
        return [(moment, frame.data) for moment, frame in self.frames(seconds) if frame.can_id == can_id]

    def expect(self, can_id: int, seconds: float = PATIENCE) -> bytes:
        """The next frame of this identifier; those of others are kept."""
        return self.timed(can_id, seconds)[1]

    def timed(self, can_id: int, seconds: float = PATIENCE) -> tuple[float, bytes]:
        """As `expect`, with its time."""
        for one in self._heard:
            if one[1].can_id == can_id:
                self._heard.remove(one)
                return one[0], one[1].data
        deadline = self.device.now + seconds
        while (one_more := self.device.next(deadline)) is not None:
            if one_more[1].can_id == can_id:
                return one_more[0], one_more[1].data
            self._heard.append(one_more)
        raise AssertionError(f"no frame {can_id:03X}h, but {[frame for _, frame in self._heard]}")

    def flush(self) -> None:
        """Forget what has come so far: everything before the answer to a request that came after it."""
        self.sdo(b"\x40\x00\x10\x00")
        self._heard.clear()

    def wait(self, seconds: float) -> None:
        """Let time pass; what comes meanwhile is kept."""
        self._heard.extend(self.frames(seconds))

    # -- SDO -----------------------------------------------------------------------------------------------------

    def sdo(self, request: bytes) -> bytes:
        """One request, one answer."""
        self.send(0x600 + self.node, request.ljust(8, b"\0"))
        answer = self.expect(0x580 + self.node)
        assert len(answer) == 8
        return answer

    def unanswered(self, request: bytes, seconds: float = 0.05) -> None:
        """A request that gets no answer."""
        self.send(0x600 + self.node, request.ljust(8, b"\0"))
        assert self.of(0x580 + self.node, seconds) == []

    def upload(self, index: int, subindex: int = 0) -> bytes | int:
        """The value, expedited or segmented; an int is an abort code."""
        answer = self.sdo(b"\x40" + little(index, 2) + bytes([subindex]))
        if answer[0] == 0x80:
            return int.from_bytes(answer[4:], "little")
        assert answer[1:4] == little(index, 2) + bytes([subindex])
        if answer[0] & 2:
            return answer[4 : 8 - (answer[0] >> 2 & 3)]
        data, toggle = b"", 0
        while True:
            segment = self.sdo(bytes([0x60 | toggle]))
            assert segment[0] & 0xF0 == toggle, segment.hex()
            data += segment[1 : 8 - (segment[0] >> 1 & 7)]
            if segment[0] & 1:
                assert len(data) == int.from_bytes(answer[4:], "little")
                return data
            toggle ^= 0x10

    def read(self, index: int, subindex: int = 0) -> int:
        """An unsigned number."""
        data = self.upload(index, subindex)
        assert isinstance(data, bytes), f"{index:04X}h:{subindex:02X} aborts with {data:08X}h"
        return int.from_bytes(data, "little")

    def download(self, index: int, subindex: int, data: bytes) -> int:
        """Write, expedited or segmented; 0, or the abort code."""
        head = little(index, 2) + bytes([subindex])
        if 1 <= len(data) <= 4:
            answer = self.sdo(bytes([0x23 | 4 - len(data) << 2]) + head + data)
            return self._confirmed(answer)
        code = self._confirmed(self.sdo(b"\x21" + head + little(len(data), 4)))
        toggle = 0
        while not code:
            part, data = data[:7], data[7:]
            command = toggle | 7 - len(part) << 1 | (not data)
            code = self._confirmed(self.sdo(bytes([command]) + part))
            toggle ^= 0x10
            if not data:
                break
        return code

    def _confirmed(self, answer: bytes) -> int:
        assert answer[0] in (0x60, 0x20, 0x30, 0x80), answer.hex()
        return int.from_bytes(answer[4:], "little") if answer[0] == 0x80 else 0

    def write(self, index: int, subindex: int, value: int, size: int) -> int:
        """Write a number of so many bytes; 0, or the abort code."""
        return self.download(index, subindex, little(value, size))

    def set(self, index: int, subindex: int, value: int, size: int) -> None:
        """Write a number, which is taken."""
        code = self.write(index, subindex, value, size)
        assert code == 0, f"{index:04X}h:{subindex:02X} = {value:X}h aborts with {code:08X}h"

    # -- NMT -----------------------------------------------------------------------------------------------------

    def nmt(self, command: int, node: int | None = None) -> None:
        self.send(0x000, bytes([command, self.node if node is None else node]))

    def start(self) -> None:
        self.nmt(1)

    def stop(self) -> None:
        self.nmt(2)

    def pre_operational(self) -> None:
        self.nmt(128)

    def reset(self, command: int = 129) -> float:
        """Reset, and wait for the boot-up; returns when it came."""
        self.nmt(command)
        return self.reaches(0)

    def heartbeats(self, milliseconds: int = 20) -> None:
        """Let the node send its state."""
        self.set(0x1017, 0, milliseconds, 2)

    def reaches(self, state: int) -> float:
        """Heartbeats of the former state are followed by one of this one; 0 is the boot-up. Returns when it came."""
        deadline = self.device.now + PATIENCE
        while (heard := self.timed(0x700 + self.node))[1] != bytes([state]):
            assert self.device.now < deadline, f"the node is in state {heard[1].hex()}"
        return heard[0]

    def stays(self, state: int) -> None:
        """What was sent so far has not changed the state."""
        self.flush()
        assert self.expect(0x700 + self.node) == bytes([state])

    def guard(self) -> bytes:
        """The answer to a guarding request."""
        self.send(0x700 + self.node, remote=True, length=1)
        return self.expect(0x700 + self.node)

    # -- PDO -----------------------------------------------------------------------------------------------------

    def sync(self, counter: int | None = None, can_id: int = 0x080) -> None:
        self.send(can_id, b"" if counter is None else bytes([counter]))

    def disable(self, communication: int) -> int:
        """Set the valid bit of a PDO to "invalid"; the COB-ID as it was."""
        cob_id = self.read(communication, 1)
        self.set(communication, 1, cob_id | 0x8000_0000, 4)
        return cob_id

    def transmission(self, communication: int, kind: int, **others: int) -> None:
        """Set a PDO to a transmission type, with `inhibit`, `event` and `sync_start` if they are given."""
        cob_id = self.disable(communication)
        self.set(communication, 2, kind, 1)
        for name, subindex, size in (("inhibit", 3, 2), ("event", 5, 2), ("sync_start", 6, 1)):
            if name in others:
                self.set(communication, subindex, others[name], size)
        self.set(communication, 1, cob_id, 4)

    def remap(self, communication: int, *mapped: int) -> None:
        """Map a PDO anew in the order of CiA 301."""
        mapping = communication + 0x200
        cob_id = self.disable(communication) & 0x7FFF_FFFF
        self.set(mapping, 0, 0, 1)
        for number, one in enumerate(mapped, 1):
            self.set(mapping, number, one, 4)
        self.set(mapping, 0, len(mapped), 1)
        self.set(communication, 1, cob_id, 4)

    # -- the robot -----------------------------------------------------------------------------------------------

    def robot(self, **values: Value) -> None:
        """The robot reports values, in one package. `ints_out__0` stands for `ints_out[0]`."""
        names = {self._name(name): value for name, value in values.items()}

        def report(_node: Node, cell: Cell, now: float) -> None:
            for name, value in names.items():
                cell.image.values[self.device.variables[name]] = value
            cell.outputs_written(now)

        self.device.do(report)

    def value(self, name: str) -> Value:
        """What the cell holds."""
        index = self.device.variables[name]
        return self.device.do(lambda _node, cell, _now: cell.image.values[index])

    def becomes(self, name: str, value: Value, seconds: float = PATIENCE) -> None:
        """The cell comes to hold this value."""
        deadline = self.device.now + seconds
        while self.value(name) != value:
            assert self.device.now < deadline, f"{name} is {self.value(name)!r}"
            self.wait(ASK)

    @staticmethod
    def _name(name: str) -> str:
        stem, _, member = name.partition("__")
        return f"{stem}[{member}]" if member else stem


def powered(device: Device) -> Iterator[Tester]:
    """The device, switched on and waiting in PRE-OPERATIONAL; switched off at the end."""
    device.power_on()
    tester = Tester(device)
    try:
        tester.reaches(0)
        yield tester
    finally:
        device.power_off()
        if isinstance(device, LinkDevice):
            device.close()
