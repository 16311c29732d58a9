"""Simulator, daemon, Modbus client and CANopen master as processes of their own, on a bus between processes."""

from __future__ import annotations

import math
import signal
import struct
import subprocess
import sys
from pathlib import Path

from tests.e2e.can_plant import NODE, Master, start_bus, start_master
from tests.e2e.plant import Plant
from tests.e2e.plc import BUSY, FAILED, PLC, Plc
from tests.e2e.processes import HOST, Daemon, Process, Simulator, wait_for

HEAD = f"""\
canopen:
  interface: slcan
  channel: 'socket://{HOST}:{{port}}'
  bitrate: 1000000
  node: {NODE}
  autostart: true
  heartbeat: 100ms
  pdo: {{{{inhibit: 50ms}}}}
  cob_ids: {{{{tpdo: 0x680..0x6A0, rpdo: 0x6A1..0x6C1}}}}
writers:
  plc: {{{{modbus: {PLC}}}}}
  master: {{{{canopen: any, node: 1, heartbeat: 1s}}}}
"""
FULL = (
    HEAD
    + """\
groups:
  bits: {{lease: none}}  # one group: else whole registers would take no bit that the master may own too
variables:
  bits_in:     {{robot: input_bit_register_0..63,     modbus: 0.0,    canopen: auto, group: bits}}
  ints_in:     {{robot: input_int_register_0..23,     modbus: 100,    canopen: auto, lease: none}}
  reals_in:    {{robot: input_double_register_0..23,  modbus: 200,    canopen: auto, lease: none}}
  bits_out:    {{robot: output_bit_register_0..63,    modbus: 1000.0, canopen: auto}}
  ints_out:    {{robot: output_int_register_0..23,    modbus: 1100,   canopen: auto}}
  reals_out:   {{robot: output_double_register_0..23, modbus: 1200,   canopen: auto}}
"""
)
SMALL = (
    HEAD
    + """\
groups:
  first: {{owner: [plc, master], takeover: false, lease: none}}
  second: {{owner: [plc, master], takeover: false, lease: none}}
variables:
  command:   {{robot: input_int_register_0,    modbus: 0,   canopen: auto, group: first}}
  setpoint:  {{robot: input_double_register_0, modbus: 2,   canopen: auto, group: second, on_release: -1.5}}
  kept:      {{robot: input_int_register_1,    modbus: 6,   canopen: auto, owner: master, on_release: hold}}
  cleared:   {{robot: output_int_register_0,   modbus: 20,  canopen: auto}}
  held:      {{robot: output_int_register_1,   modbus: 22,  canopen: auto, on_stale: hold}}
  valued:    {{robot: output_double_register_0, modbus: 24, canopen: auto, on_stale: 7.25}}
  excepted:  {{robot: output_double_register_1, modbus: 28, canopen: auto, on_stale: exception}}
"""
)
COMMAND, SETPOINT, KEPT, CLEARED, HELD, VALUED, EXCEPTED = (
    "2010:1",
    "2020:1",
    "2010:2",
    "2410:1",
    "2410:2",
    "2420:1",
    "2420:2",
)
NOBODY, THE_PLC, THE_MASTER = 0, 1, 2
CAN_BUS, NMT_STATE, HEARTBEAT, REFUSED, MASTER_ALIVE = 27, 28, 4, 23, 128 + THE_MASTER - 1
"""Words of the status block."""
ABSENT, ACTIVE = 1, 6
OPERATIONAL, PRE_OPERATIONAL = 5, 127
LOCAL_CONTROL, DEVICE_STATE = "08000021", "08000022"


class Cell:
    """Everything that runs."""

    def __init__(self, plant: Plant, text: str, *, beats: bool = True) -> None:
        """Without `beats` nobody has heard the master yet."""
        self.plant = plant
        self.bus, self.port = start_bus(plant)
        self.simulator: Simulator = plant.simulator()
        self.mapping: Path = plant.mapping(text.format(port=self.port), self.simulator.port)
        self.master: Master = start_master(plant, self.mapping, "slcan", f"socket://{HOST}:{self.port}")
        self.master.ask("beat", beats)
        self.daemon: Daemon = plant.daemon(self.mapping, "--state", plant.directory)
        self.plc: Plc = plant.ready_plc()
        self.master.becomes(OPERATIONAL)

    def robot(self, *names: str) -> list[float]:
        return [self.simulator.number(name) for name in names]

    def cut(self) -> None:
        """The bus is gone."""
        self.bus.kill()

    def mend(self) -> Process:
        """It is back, and the master on it."""
        self.bus, _ = start_bus(self.plant, self.port)
        self.master.ask("disconnect")
        self.master.ask("connect")
        return self.bus


def test_every_register_both_ways_on_both_buses(plant: Plant) -> None:
    """All 112 + 112 variables: Modbus -> robot -> CANopen, then CANopen -> robot -> Modbus, bit for bit."""
    cell = Cell(plant, FULL)
    master, plc = cell.master, cell.plc
    wait_for(lambda: master.ask("outputs")["received"] == 37, "all TPDOs")

    words = [0x8001, 0x1234, 0xFFFF, 0xA55A]
    integers = [(number + 1) * 0x01010101 * (-1) ** number % 2**31 for number in range(23)] + [-(2**31)]
    reals = [(number + 1) * math.pi * 10.0**number for number in range(22)] + [
        -1.7976931348623157e308,
        5e-324,
    ]
    assert plc.write(0, words) == 0
    assert plc.write_integers(100, *integers) == 0
    assert plc.write_doubles(200, *reals) == 0
    pattern = sum(word << 16 * place for place, word in enumerate(words))
    wait_for(
        lambda: master.output("2420:24") == reals[-1] and master.output("2410:24") == integers[-1], "TPDOs"
    )
    wait_for(lambda: _bits(master) == pattern, "the bits")
    values = master.ask("outputs")["values"]
    assert [values[f"2410:{number}"] for number in range(1, 25)] == integers
    assert _image(values[f"2420:{number}"] for number in range(1, 25)) == _image(reals)
    assert master.ask("read", 0x2410, 24) == integers[-1]
    assert master.ask("read", 0x2020, 3) == reals[2]
    assert master.ask("read", 0x2000, 1) is True

    assert plc.release(0xFFFF) == 0
    wait_for(lambda: plc.doubles(1200, 2) == [0.0, 0.0], "the release fallbacks")
    sent: dict[str, object] = {f"2000:{bit + 1}": bool(~pattern >> bit & 1) for bit in range(64)}
    sent |= {f"2010:{number + 1}": ~value for number, value in enumerate(integers)}
    sent |= {f"2020:{number + 1}": -value for number, value in enumerate(reals)}
    assert master.ask("inputs", sent) == 37
    wait_for(lambda: plc.doubles(1292) == [-reals[-1]], "the last real")
    wait_for(lambda: plc.read(1000, 4) == [~word & 0xFFFF for word in words], "the bits")
    assert plc.integers(1100, 24) == plc.integers(100, 24) == [~value for value in integers]
    assert _image(plc.doubles(1200, 24)) == _image(plc.doubles(200, 24)) == _image(-value for value in reals)
    assert cell.simulator.integer("input_int_register_23") == 2**31 - 1
    assert {plc.owner(number) for number in range(1, 113)} == {THE_MASTER}
    assert (plc.status(CAN_BUS), plc.status(NMT_STATE)) == (ACTIVE, OPERATIONAL)
    assert master.ask("emergencies") == []
    assert "Traceback" not in cell.daemon.text()


def test_parameters_saved_by_the_master_survive_the_daemon(plant: Plant) -> None:
    """And a daemon that is stopped leaves the robot with the release fallbacks of what the master held."""
    cell = Cell(plant, SMALL)
    master = cell.master
    master.ask("inputs", {COMMAND: 7, KEPT: 8, SETPOINT: 2.5})
    wait_for(lambda: cell.robot("input_int_register_0", "input_double_register_0") == [7, 2.5], "the values")
    master.ask("nmt", "PRE-OPERATIONAL")
    master.becomes(PRE_OPERATIONAL)
    wait_for(lambda: cell.simulator.integer("input_int_register_0") == 0, "fallbacks outside OPERATIONAL")
    assert master.ask("write", 0x1017, 0, 150) is None
    assert master.ask("write", 0x1010, 1, 0x6576_6173) is None
    master.ask("nmt", "OPERATIONAL")
    master.becomes(OPERATIONAL)
    master.ask("inputs", {COMMAND: 9, KEPT: 10, SETPOINT: 3.5})
    wait_for(lambda: cell.robot("input_int_register_0", "input_double_register_0") == [9, 3.5], "the values")

    code, _ = cell.daemon.stop()
    assert code == 0
    assert cell.robot("input_int_register_0", "input_double_register_0") == [0, -1.5]
    assert cell.simulator.integer("input_int_register_1") == 10, "on_release: hold"
    boots = master.ask("heard")["boots"]
    plant.daemon(cell.mapping, "--state", plant.directory)
    wait_for(lambda: master.ask("heard")["boots"] == boots + 1, "the boot-up")
    master.becomes(OPERATIONAL)
    assert master.ask("read", 0x1017, 0) == 150


def _bits(master: Master) -> int:
    values = master.ask("outputs")["values"]
    return sum(bool(values[f"2400:{bit + 1}"]) << bit for bit in range(64))


def _image(values: object) -> list[bytes]:
    return [struct.pack("<d", value) for value in values]  # type: ignore[attr-defined]


def test_one_writer_at_a_time_on_both_buses(plant: Plant) -> None:
    cell = Cell(plant, SMALL)
    master, plc = cell.master, cell.plc
    assert plc.write_integers(0, 11) == 0
    wait_for(lambda: master.ask("read", 0x2010, 1) == 11, "the value")
    assert master.ask("read", 0x5F10, 1) == THE_PLC

    # The PLC holds it.
    assert master.ask("inputs", {COMMAND: 22, KEPT: 5}) == 1
    assert master.emergency(0xFF01)[:2] == (0xFF01, 0x81)
    assert master.ask("write", 0x2010, 1, 22) == LOCAL_CONTROL
    assert plc.integers(0) == [11]
    assert plc.integers(6) == [0], "an RPDO is applied whole or not at all"
    assert plc.refusal[:2] == (3, 1)
    cell.daemon.wait_for_line("write refused", "variable=command", "writer=master", "holder=plc")
    assert cell.simulator.integer("input_int_register_0") == 11

    # It gives it back: the same RPDO is taken, and the master holds it.
    assert plc.release(1) == 0
    wait_for(lambda: cell.simulator.integer("input_int_register_0") == 0, "the release fallback")
    assert master.ask("inputs", {COMMAND: 22, KEPT: 5}) == 1
    assert master.emergency(0)[0] == 0
    wait_for(lambda: plc.integers(0) == [22], "the master's value")
    wait_for(lambda: cell.simulator.integer("input_int_register_1") == 5, "the other value of the same RPDO")
    assert plc.write_integers(0, 33) == BUSY
    assert plc.refusal == (3, 1, THE_PLC, THE_MASTER)
    assert (plc.owner(1), plc.owner(2)) == (THE_MASTER, NOBODY)

    # Locks over SDO: requested, refused to the other, and given back.
    assert master.ask("write", 0x5F00, 26, 0) is None
    request, release = _lock_words()
    assert master.ask("write", 0x5F00, request, 2) is None
    assert plc.write_doubles(2, 1.0) == BUSY
    assert master.ask("write", 0x5F00, release, 2) is None
    wait_for(lambda: cell.simulator.number("input_double_register_0") == -1.5, "its release fallback")
    assert plc.write_doubles(2, 1.0) == 0
    assert master.ask("write", 0x5F00, request, 2) == LOCAL_CONTROL
    assert master.ask("write", 0x2020, 1, 2.0) == LOCAL_CONTROL


def _lock_words() -> tuple[int, int]:
    """Sub-indices of `request` and `release`: words are only appended to the record, so these stay."""
    return 26, 27


def test_everything_that_can_be_lost_is_lost_and_comes_back(plant: Plant) -> None:
    """In one run: the robot, the master, the daemon (frozen), the bus."""
    cell = Cell(plant, SMALL)
    master, plc, simulator = cell.master, cell.plc, cell.simulator
    for name in ("output_int_register_0", "output_int_register_1"):
        wait_for(lambda name=name: simulator.integer(name) == 0, name)  # type: ignore[misc]
    assert master.ask("inputs", {COMMAND: 7, KEPT: 8, SETPOINT: 2.5}) == 2
    wait_for(
        lambda: [master.output(key) for key in (CLEARED, HELD, VALUED)] == [7, 8, 2.5], "the robot's echo"
    )

    # The robot.
    simulator.kill()
    wait_for(lambda: master.output(CLEARED) == 0 and master.output(VALUED) == 7.25, "the policies on TPDOs")
    assert master.output(HELD) == 8
    assert master.emergency(0xFF10)[1] == 0x81, "the robot is lost; 1029h has no part in it"
    assert plc.status(NMT_STATE) == OPERATIONAL
    assert master.ask("read", 0x2420, 2) == DEVICE_STATE
    assert master.ask("write", 0x2010, 1, 9) == DEVICE_STATE
    master.ask("inputs", {COMMAND: 9})
    assert master.emergency(0xFF03)[1] == 0x81
    assert plc.write_integers(0, 9) in (BUSY, FAILED)
    assert master.ask("read", 0x5F40, 4) == 1, "stale, as the status block says on both buses"
    cell.simulator = simulator = plant.simulator(port=simulator.port)
    wait_for(lambda: plc.writable, "the robot")
    master.ask("inputs", {COMMAND: 9, KEPT: 10, SETPOINT: 2.5})
    master.emergency(0)
    wait_for(lambda: [master.output(key) for key in (CLEARED, HELD, VALUED)] == [9, 10, 2.5], "good values")

    # The master.
    assert plc.owner(1) == THE_MASTER
    master.process.signal(signal.SIGSTOP)
    took = wait_for(lambda: plc.owner(1) == NOBODY, "the loss of the master")
    print(f"master frozen, heartbeat time 1 s -> lost: {took * 1000:.0f} ms")
    wait_for(lambda: cell.robot("input_int_register_0", "input_double_register_0") == [0, -1.5], "fallbacks")
    assert simulator.integer("input_int_register_1") == 10, "on_release: hold"
    assert plc.status(NMT_STATE) == PRE_OPERATIONAL
    cell.daemon.wait_for_line("writer lost", "writer=master", "no heartbeat of node 1")
    assert plc.write_integers(0, 1) == 0
    assert plc.release(1) == 0
    master.process.signal(signal.SIGCONT)
    assert master.emergency(0x8130) == (0x8130, 0x11, "0100000000")
    master.emergency(0)
    master.ask("nmt", "OPERATIONAL")
    wait_for(lambda: plc.status(NMT_STATE) == OPERATIONAL, "the master's start")
    master.ask("inputs", {COMMAND: 3})
    wait_for(lambda: simulator.integer("input_int_register_0") == 3, "the master's value again")

    # The daemon: nobody else tells its heartbeat.
    master.becomes(OPERATIONAL)
    cell.daemon.signal(signal.SIGSTOP)
    wait_for(lambda: master.ask("heard")["age"] > 0.6, "a heartbeat of 100 ms that is silent")
    cell.daemon.signal(signal.SIGCONT)
    wait_for(lambda: master.ask("heard")["age"] < 0.1, "the heartbeat")
    wait_for(lambda: plc.status(CAN_BUS) == ACTIVE and plc.writable, "everything as before")

    # The bus.
    boots = master.ask("heard")["boots"]
    master.ask("nmt", "OPERATIONAL")
    wait_for(lambda: plc.status(NMT_STATE) == OPERATIONAL, "OPERATIONAL")
    master.ask("inputs", {COMMAND: 4})
    wait_for(lambda: simulator.integer("input_int_register_0") == 4, "the master's value")
    cell.cut()
    wait_for(lambda: plc.status(CAN_BUS) == ABSENT, "the loss of the bus")
    wait_for(lambda: plc.owner(1) == NOBODY, "the release of what its writers held")
    wait_for(lambda: simulator.integer("input_int_register_0") == 0, "the fallback in the robot")
    assert plc.status(NMT_STATE) == PRE_OPERATIONAL
    assert plc.write_integers(0, 6) == 0, "the other bus goes on"
    assert plc.release(1) == 0
    cell.mend()
    wait_for(lambda: plc.status(CAN_BUS) == ACTIVE, "the bus")
    wait_for(lambda: plc.status(NMT_STATE) == OPERATIONAL, "the start by itself")
    master.becomes(OPERATIONAL)
    assert master.ask("heard")["boots"] >= boots
    master.ask("inputs", {COMMAND: 5})
    wait_for(lambda: simulator.integer("input_int_register_0") == 5, "the master's value again")
    wait_for(lambda: master.output(CLEARED) == 5, "its echo")
    assert "Traceback" not in cell.daemon.text()


def _stays_locked_out(cell: Cell) -> None:
    """While 50 RPDOs are refused, nothing of the master is seen: no value, no owner, no life, no fallback."""
    plc, told = cell.plc, len(cell.daemon.lines("fallback applied", "variable=command"))
    first, seen = plc.status(REFUSED), set()

    def refused() -> bool:
        seen.add((cell.robot("input_int_register_0")[0], plc.owner(1), plc.status(MASTER_ALIVE)))
        return plc.status(REFUSED) >= first + 50

    took = wait_for(refused, "50 refused RPDOs")
    print(f"locked out for {took:.1f} s, {len(seen)} pictures seen")
    assert seen == {(0, NOBODY, 0)}
    assert len(cell.daemon.lines("fallback applied", "variable=command")) == told
    assert plc.refusal == (8, 1, THE_MASTER, NOBODY)


def test_a_master_is_believed_only_while_its_promised_heartbeat_is_heard(plant: Plant) -> None:
    cell = Cell(plant, SMALL, beats=False)
    master, plc, simulator = cell.master, cell.plc, cell.simulator

    # It never tells a heartbeat: one RPDO, and the lock without a lease is not its own for ever.
    assert master.ask("inputs", {COMMAND: 7, KEPT: 8}) == 1
    wait_for(lambda: simulator.integer("input_int_register_0") == 7, "its value")
    took = wait_for(lambda: plc.owner(1) == NOBODY, "the loss of the master")
    print(f"first sign, heartbeat time 1 s -> lost: {took * 1000:.0f} ms")
    wait_for(lambda: simulator.integer("input_int_register_0") == 0, "the fallback")
    assert simulator.integer("input_int_register_1") == 8, "on_release: hold"
    cell.daemon.wait_for_line("writer lost", "writer=master", "no heartbeat of node 1")
    assert plc.status(NMT_STATE) == OPERATIONAL, "1029h is about heartbeats that end"

    # It goes on. Nothing is taken; reading is allowed.
    assert master.ask("repeat", {COMMAND: 9, KEPT: 10}, 0.02) == 1
    assert master.emergency(0xFF06)[1] == 0x81
    _stays_locked_out(cell)
    assert master.ask("write", 0x2010, 1, 9) == DEVICE_STATE
    request, release = _lock_words()
    assert master.ask("write", 0x5F00, request, 2) == DEVICE_STATE
    assert master.ask("write", 0x5F00, release, 0xFFFF) == DEVICE_STATE
    assert master.ask("read", 0x2010, 1) == 0
    cell.daemon.wait_for_line(
        "write refused", "variable=command", "writer=master", "its heartbeat is missing"
    )
    assert plc.write_integers(0, 1) == 0, "others go on"
    assert plc.release(1) == 0

    # Heard, it writes. Then its heartbeat stops, and its RPDOs do not.
    assert master.ask("write", 0x1029, 1, 1) is None
    master.ask("beat", True)
    wait_for(lambda: cell.robot("input_int_register_0", "input_int_register_1") == [9, 10], "its values")
    master.emergency(0)
    assert (plc.owner(1), plc.status(MASTER_ALIVE)) == (THE_MASTER, 1)
    master.ask("beat", False)
    took = wait_for(lambda: plc.owner(1) == NOBODY, "the loss of the master")
    print(f"heartbeat stops, RPDOs go on -> lost: {took * 1000:.0f} ms")
    wait_for(lambda: simulator.integer("input_int_register_0") == 0, "the fallback")
    assert plc.status(NMT_STATE) == OPERATIONAL, "1029h = 1"
    master.emergency(0xFF06)
    _stays_locked_out(cell)
    master.ask("beat", True)
    wait_for(lambda: cell.robot("input_int_register_0") == [9], "its value again")
    master.emergency(0)
    assert plc.owner(1) == THE_MASTER
    assert "Traceback" not in cell.daemon.text()


NOWHERE = """\
canopen: {interface: socketcan, channel: nocan7, bitrate: 250000, node: 16}
variables:
  part: {robot: output_int_register_0, modbus: 0, canopen: auto}
"""


def test_a_can_interface_that_is_not_there_at_the_start_is_named_with_a_remedy(plant: Plant) -> None:
    """In the log once and in `gatewayd status`, whether the kernel knows CAN or not; the rest of the cell serves."""
    simulator = plant.simulator()
    socket = plant.directory / "control.sock"
    daemon = plant.daemon(plant.mapping(NOWHERE, simulator.port), "--control", socket)
    daemon.wait_for_line("listening for control")
    line = daemon.wait_for_line("socketcan:nocan7")
    remedies = ("plug in its adapter, or correct `channel`", "load the kernel modules can and can_raw")
    remedy = next(remedy for remedy in remedies if remedy in line)
    command = [sys.executable, "-m", "gatewayd", "status", "--socket", str(socket)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=30)
    said = next(line for line in done.stdout.splitlines() if "CAN bus absent" in line)
    assert "nocan7" in said
    assert remedy in said
    assert len(daemon.lines("socketcan:nocan7")) == 1
