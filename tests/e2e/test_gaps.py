"""The gateway stands still for a while, at any moment, both buses busy: nothing old is served as good, nothing old is
carried out, nobody living is accused.

SIGSTOP stands for everything that keeps a process from running. Moments and lengths come from a seed. What the robot
held is watched by a second RTDE client, how old a value is by the controller's own clock.
"""

from __future__ import annotations

import random
import signal
import socket
import struct
import threading
import time
from collections.abc import Callable
from contextlib import suppress

import pytest

from tests.e2e.can_plant import NODE, Master, start_bus, start_master
from tests.e2e.plant import Plant
from tests.e2e.plc import BUSY, HMI, PLC, Plc
from tests.e2e.processes import HOST, Daemon, wait_for
from tests.e2e.witness import Witness

CELL = f"""\
canopen:
  interface: slcan
  channel: 'socket://{HOST}:{{port}}'
  bitrate: 1000000
  node: {NODE}
  autostart: true
  heartbeat: 100ms
writers:
  plc: {{{{modbus: {PLC}, timeout: 500ms}}}}
  hmi: {{{{modbus: {HMI}, timeout: 500ms}}}}
  master: {{{{canopen: any, node: 1, heartbeat: 500ms}}}}
variables:
  go:     {{{{robot: input_int_register_0, modbus: 0, owner: plc, lease: none}}}}
  beat:   {{{{robot: input_int_register_1, modbus: 2, owner: hmi, lease: none}}}}
  order:  {{{{robot: input_int_register_2, canopen: auto, owner: master, lease: none}}}}
  moment: {{{{robot: timestamp, modbus: {{{{holding: 10, type: float64}}}}, canopen: auto, on_stale: -1}}}}
"""
GO, BEAT, ORDER = (f"input_int_register_{number}" for number in range(3))
MOMENT, MOMENT_NUMBER, ORDER_OBJECT, MOMENT_OBJECT = 10, 4, "2010:1", "2420:1"
STALE_AFTER = 0.3
TOLERANCE = 0.15
"""Seconds that clients and witness may take on a busy machine."""
OLD = 666
"""What is waiting in a socket from before or amid a gap."""
LIVING = 7
SHORT, LONG = (0.2, 0.6), (1.0, 2.0)


class Cell:
    """Everything that runs: a living PLC (the HMI) and a living master keep both buses busy."""

    def __init__(self, plant: Plant, seed: int) -> None:
        self.chance = random.Random(seed)
        simulator = plant.simulator()
        _, port = start_bus(plant)
        mapping = plant.mapping(
            CELL.format(port=port), simulator.port, stale_after=f"{STALE_AFTER * 1000:g}ms"
        )
        self.master: Master = start_master(plant, mapping, "slcan", f"socket://{HOST}:{port}")
        self.daemon: Daemon = plant.daemon(mapping, "--state", plant.directory)
        self.witness = Witness(HOST, simulator.port, [GO, BEAT, ORDER])
        self.witness.start()
        self.port = plant.modbus
        plant.ready_plc(HMI)
        self.master.becomes(5)
        self.continued: list[float] = []

    def stand_still(self, seconds: float, meanwhile: Callable[[], object] = lambda: None) -> None:
        time.sleep(self.chance.uniform(0.0, 0.1))
        begin = time.monotonic()
        self.daemon.signal(signal.SIGSTOP)
        try:
            meanwhile()
            time.sleep(max(0.0, begin + seconds - time.monotonic()))
        finally:
            self.continued.append(time.monotonic())
            self.daemon.signal(signal.SIGCONT)

    def answered_at(self, asked: float, answered: float) -> float:
        """The earliest moment at which an answer can have been made: one that spans a gap came after it."""
        return max([asked, *(moment for moment in self.continued if moment < answered)])

    def age(self, moment: float, value: float) -> float:
        """How old a value of the controller's clock was at least."""
        return self.witness.timestamp(moment) - value


class BusyPlc(threading.Thread):
    """Writes a counter and reads the controller's clock, quality and age of it, without end."""

    def __init__(self, plc: Plc) -> None:
        super().__init__(daemon=True)
        self._plc = plc
        self._over = threading.Event()
        self.trouble = ""
        self.accepted: list[int] = [0]
        self.codes: set[int] = set()
        self.moments: list[tuple[float, float, float]] = []
        """Asked, answered, value; -1 was not good."""
        self.ages: list[tuple[float, float, float, int]] = []
        """Asked for the age, answered the value, the value and the age: those of a value not newer than this one."""

    def run(self) -> None:
        try:
            while not self._over.is_set():
                self._cycle()
                time.sleep(0.005)
        except (OSError, AssertionError) as error:
            self.trouble = str(error)

    def stop(self) -> None:
        self._over.set()
        self.join(15)
        assert not self.trouble

    def _cycle(self) -> None:
        number = self.accepted[-1] + 1
        code = self._plc.write_integers(2, number)
        self.codes.add(code)
        if not code:
            self.accepted.append(number)
        before = time.monotonic()
        # The age first: what a package between both answers brings is newer than the age says, never older.
        age = self._plc.status(2240 + MOMENT_NUMBER - 1)
        asked = time.monotonic()
        (value,) = self._plc.doubles(MOMENT)
        answered = time.monotonic()
        self.moments.append((asked, answered, value))
        if value != -1 and self._plc.good(MOMENT_NUMBER):
            self.ages.append((before, answered, value, age))


class DeadPlc:
    """Writes as a living PLC does, then once more into a gap, and never again."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection((HOST, port), 10, (PLC, 0))

    def send(self, value: int) -> None:
        self._socket.sendall(struct.pack(">HHHBBHHBi", 1, 0, 11, 1, 16, 0, 2, 4, value))

    def code(self) -> int:
        """The exception code of the next answer, 0 for none."""
        head = self._socket.recv(8, socket.MSG_WAITALL)
        rest = self._socket.recv(head[5] - 2, socket.MSG_WAITALL)
        return rest[0] if head[7] & 0x80 else 0

    def write(self, value: int) -> int:
        self.send(value)
        return self.code()

    def close(self) -> None:
        with suppress(OSError):
            self._socket.close()


@pytest.fixture
def cell(plant: Plant, request: pytest.FixtureRequest) -> Cell:
    return Cell(plant, request.param)


@pytest.mark.parametrize("cell", [8], indirect=True, ids=["seed 8"])
def test_nothing_old_is_good_and_nobody_living_is_accused(plant: Plant, cell: Cell) -> None:
    master, chance = cell.master, cell.chance
    busy = BusyPlc(plant.plc(HMI))
    busy.start()
    master.ask("watch", MOMENT_OBJECT)
    assert master.ask("repeat", {ORDER_OBJECT: LIVING}, 0.02) == 1
    wait_for(lambda: LIVING in cell.witness.held(ORDER), "the living master's value")
    for length in (chance.uniform(*SHORT), chance.uniform(*LONG), 0.2, chance.uniform(*SHORT)):
        cell.stand_still(length)
        number = busy.accepted[-1]
        wait_for(lambda number=number: busy.accepted[-1] > number, "the PLC to write again")  # type: ignore[misc]
        wait_for(lambda: cell.witness.held(ORDER)[-1] == LIVING, "the master's value")
        wait_for(lambda: busy.moments[-1][2] != -1, "good values")
    busy.stop()
    watched = master.ask("watched")
    master.ask("stop_repeating")

    served = [(cell.answered_at(asked, answered), value) for asked, answered, value in busy.moments]
    aged = [(cell.age(at, value), value) for at, value in served if value != -1]
    assert len(aged) > 10
    assert max(aged)[0] <= STALE_AFTER + TOLERANCE, "Modbus: old and good"
    sent = [cell.age(at, value) for at, value in watched if value != -1]
    assert len(sent) > 10
    assert max(sent) <= STALE_AFTER + TOLERANCE, "TPDO: old and good"
    for before, answered, value, age in busy.ages:
        true = cell.age(answered, value) - (answered - before)
        assert true <= age / 1000 + TOLERANCE, f"{true:.3f} s old, said to be {age} ms"

    assert not cell.daemon.lines("writer lost")
    assert not cell.daemon.lines("robot lost")
    assert not [one for one in master.ask("emergencies") if one[0] == 0x8130]
    assert busy.codes <= {0, BUSY}
    assert set(cell.witness.held(BEAT)) <= set(busy.accepted)
    assert set(cell.witness.held(ORDER)) <= {0, LIVING}


@pytest.mark.parametrize("cell", [9], indirect=True, ids=["seed 9"])
def test_a_write_of_a_plc_that_fell_silent_is_not_carried_out_after_the_gap(plant: Plant, cell: Cell) -> None:
    """Whether it fell silent before the gap, amid it, or hung up; and one that came amid a short gap is taken."""
    busy = BusyPlc(plant.plc(HMI))
    busy.start()
    for end in (lambda _plc: None, DeadPlc.close):
        plc = DeadPlc(cell.port)
        assert wait_for(lambda plc=plc: plc.write(LIVING) == 0, "the PLC's turn") >= 0  # type: ignore[misc]
        wait_for(lambda: cell.witness.held(GO)[-1] == LIVING, "its value")
        silent = time.monotonic()

        def last(plc: DeadPlc = plc, end: Callable[[DeadPlc], object] = end) -> None:
            plc.send(OLD)
            end(plc)

        cell.stand_still(cell.chance.uniform(*LONG), last)
        if end is not DeadPlc.close:
            assert plc.code() == BUSY
        wait_for(lambda: cell.witness.held(GO)[-1] == 0, "the fallback")
        assert OLD not in cell.witness.held(GO, silent)
        plc.close()
    fresh = DeadPlc(cell.port)
    wait_for(lambda: fresh.write(LIVING) == 0, "its turn")
    cell.stand_still(0.2, lambda: fresh.send(LIVING + 1))
    assert fresh.code() == 0, "it waited less than its own time-out"
    wait_for(lambda: cell.witness.held(GO)[-1] == LIVING + 1, "its value")
    fresh.close()
    busy.stop()
    assert set(cell.witness.held(BEAT)) <= set(busy.accepted)


@pytest.mark.parametrize("cell", [10], indirect=True, ids=["seed 10"])
def test_an_rpdo_of_a_dead_master_is_not_carried_out_after_the_gap(plant: Plant, cell: Cell) -> None:
    master = cell.master
    busy = BusyPlc(plant.plc(HMI))
    busy.start()
    master.ask("repeat", {ORDER_OBJECT: LIVING}, 0.02)
    wait_for(lambda: LIVING in cell.witness.held(ORDER), "the master's value")

    def die() -> None:
        master.ask("stop_repeating")
        master.ask("inputs", {ORDER_OBJECT: OLD})
        master.ask("beat", False)

    silent = time.monotonic()
    cell.stand_still(cell.chance.uniform(*LONG), die)
    wait_for(lambda: cell.witness.held(ORDER)[-1] == 0, "the fallback")
    cell.daemon.wait_for_line("writer lost", "writer=master")
    assert OLD not in cell.witness.held(ORDER, silent)
    assert not cell.daemon.lines("writer lost", "writer=hmi")
    busy.stop()
