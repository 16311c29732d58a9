"""The whole node on a real SocketCAN: daemon, master and robot as processes of their own, and an adapter that fails."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest

from tests.e2e.can_plant import NODE, start_master
from tests.e2e.plant import Plant
from tests.e2e.plc import PLC, Plc
from tests.e2e.processes import Daemon, Simulator, wait_for
from tests.kernel.bench import Peer, SerialAdapter, ip
from tests.links.canopen_node.recorder import until

CELL = f"""\
canopen: {{{{channel: {{channel}}, bitrate: 500000, node: {NODE}, autostart: true, heartbeat: 100ms}}}}
writers:
  plc: {{{{modbus: {PLC}}}}}
  master: {{{{canopen: any, node: 1, heartbeat: 1s}}}}
variables:
  command: {{{{robot: input_int_register_0,  modbus: 0, canopen: auto, owner: any, lease: none}}}}
  echo:    {{{{robot: output_int_register_0, modbus: 2, canopen: auto}}}}
"""
NOBODY, THE_MASTER = 0, 2
CAN_BUS, NMT_STATE = 27, 28
"""Words of the status block."""
ABSENT, DOWN, BUS_OFF, PASSIVE, ACTIVE = 1, 2, 3, 4, 6
OPERATIONAL, PRE_OPERATIONAL = 5, 127
HEARTBEAT = 0x700 + NODE
COMMAND, ECHO = "2010:1", "2410:1"
PATIENCE = 20.0

BOOT_UP = "t710100"
EMERGENCY = "t0908"
"""As an adapter writes the frames of this node."""


def _start(plant: Plant, channel: str) -> tuple[Simulator, Path]:
    simulator = plant.simulator(frequency=25)
    text = CELL.format(channel=channel)
    return simulator, plant.mapping(text, simulator.port, frequency=25, stale_after="2s")


def _daemon(plant: Plant, mapping: Path) -> tuple[Daemon, Plc]:
    daemon = plant.daemon(mapping, "--state", plant.directory)
    return daemon, plant.ready_plc()


def _heartbeats(peer: Peer) -> int:
    return sum(frame.can_id == HEARTBEAT for frame in peer.received())


@pytest.mark.timeout(80)
def test_node_lives_and_dies_with_the_daemon_and_the_interface(vcan: str, plant: Plant) -> None:
    simulator, mapping = _start(plant, vcan)
    master = start_master(plant, mapping, "socketcan", vcan)
    peer = Peer(vcan)
    daemon, plc = _daemon(plant, mapping)

    # Boot-up, SDO, PDOs both ways, SYNC.
    master.becomes(OPERATIONAL)
    assert master.ask("heard")["boots"] == 1
    assert (plc.status(CAN_BUS), plc.status(NMT_STATE)) == (ACTIVE, OPERATIONAL)
    assert master.ask("read", 0x1008, 0) == "gatewayd cell"
    assert master.ask("inputs", {COMMAND: 77}) == 1
    wait_for(lambda: master.output(ECHO) == 77, "RPDO -> robot -> TPDO")
    assert plc.integers(0, 2) == [77, 77]
    assert plc.owner(1) == THE_MASTER
    assert master.ask("write", 0x1800, 2, 1) is None
    master.ask("forget")
    assert master.ask("outputs")["received"] == 0
    master.ask("sync")
    wait_for(lambda: master.ask("outputs")["received"] == 1, "SYNC -> TPDO")
    assert master.ask("write", 0x1800, 2, 254) is None

    # The trap: a heartbeat that the kernel sends goes on while the daemon is frozen.
    _heartbeats(peer)
    wait_for(lambda: _heartbeats(peer) > 0, "a heartbeat")
    daemon.signal(signal.SIGSTOP)
    time.sleep(0.1)  # what was under way
    _heartbeats(peer)
    time.sleep(0.6)
    silent = _heartbeats(peer)
    daemon.signal(signal.SIGCONT)
    assert silent == 0
    wait_for(lambda: _heartbeats(peer) > 0, "the heartbeat")

    # The master falls silent: what it held is free, and the robot has the fallback.
    wait_for(lambda: plc.status(CAN_BUS) == ACTIVE, "the daemon")
    master.ask("nmt", "OPERATIONAL")
    master.ask("inputs", {COMMAND: 78})
    wait_for(lambda: plc.owner(1) == THE_MASTER, "the master's lock")
    master.ask("beat", False)
    wait_for(lambda: plc.owner(1) == NOBODY, "the loss of the master")
    assert master.emergency(0x8130)[2] == "0100000000"
    wait_for(lambda: simulator.integer("input_int_register_0") == 0, "the fallback in the robot")
    assert plc.status(NMT_STATE) == PRE_OPERATIONAL
    master.ask("beat", True)
    master.emergency(0)

    # The interface goes down and up; then it is unplugged and plugged in again.
    for lose, bring, state in (
        (("link", "set", vcan, "down"), (("link", "set", vcan, "up"),), DOWN),
        (
            ("link", "delete", vcan),
            (("link", "add", vcan, "type", "vcan"), ("link", "set", vcan, "up")),
            ABSENT,
        ),
    ):
        master.ask("nmt", "OPERATIONAL")
        wait_for(lambda: plc.status(NMT_STATE) == OPERATIONAL, "OPERATIONAL")
        master.ask("inputs", {COMMAND: 79})
        wait_for(lambda: plc.owner(1) == THE_MASTER, "the master's lock")
        ip(*lose)
        wait_for(lambda state=state: plc.status(CAN_BUS) == state, f"bus state {state}")  # type: ignore[misc]
        assert plc.status(NMT_STATE) == PRE_OPERATIONAL
        assert plc.owner(1) == NOBODY
        wait_for(lambda: simulator.integer("input_int_register_0") == 0, "the fallback in the robot")
        assert plc.write_integers(0, 5) == 0, "the other bus goes on"
        assert plc.release(1) == 0
        for words in bring:
            ip(*words)
        wait_for(lambda: plc.status(CAN_BUS) == ACTIVE, "the bus")
        wait_for(lambda: plc.status(NMT_STATE) == OPERATIONAL, "the start by itself")
        master.ask("disconnect")
        master.ask("connect")
        master.becomes(OPERATIONAL)
    peer.close()
    assert "Traceback" not in daemon.text()


@pytest.mark.timeout(60)
async def test_node_on_a_controller_that_fails(adapter: SerialAdapter, plant: Plant) -> None:
    simulator, mapping = _start(plant, adapter.name)
    mapping.write_text(mapping.read_text().replace("bitrate: 500000", "bitrate: 250000"))
    daemon = plant.run(mapping, "--state", plant.directory)
    await until(lambda: BOOT_UP in adapter.lines and daemon.lines("listening for Modbus"), PATIENCE)
    plc = plant.plc()
    await until(lambda: plc.writable, PATIENCE)
    (reported,) = daemon.lines("CAN bit rate is not that of the mapping")
    assert "bitrate=500000 mapping=250000" in reported
    adapter.say("t21044E000000")
    await until(lambda: plc.integers(0) == [78], PATIENCE)
    assert (plc.owner(1), plc.status(NMT_STATE)) == (THE_MASTER, OPERATIONAL)

    # Error-passive: reported, and everything goes on.
    adapter.say("sp130140")
    await until(lambda: plc.status(CAN_BUS) == PASSIVE, PATIENCE)
    await until(lambda: f"{EMERGENCY}2081110000000000" in adapter.lines, PATIENCE)
    assert (plc.owner(1), plc.status(NMT_STATE)) == (THE_MASTER, OPERATIONAL)
    assert plc.good(2)
    adapter.say("sa000000")
    await until(lambda: plc.status(CAN_BUS) == ACTIVE, PATIENCE)
    await until(lambda: f"{EMERGENCY}0000000000000000" in adapter.lines, PATIENCE)

    # Bus-off: what the bus held is free, nothing is sent, the values stay good for the others.
    adapter.say("sb000256")
    await until(lambda: plc.status(CAN_BUS) == BUS_OFF, PATIENCE)
    assert (plc.owner(1), plc.status(NMT_STATE)) == (NOBODY, PRE_OPERATIONAL)
    await until(lambda: simulator.integer("input_int_register_0") == 0, PATIENCE)
    assert plc.good(2)
    assert plc.write_integers(0, 6) == 0
    sent = len(adapter.lines)
    await until(lambda: plc.integers(2) == [6], PATIENCE)
    assert adapter.lines[sent:] == []

    # Down and up recovers it: boot-up, and the story of it.
    await adapter.down()
    await until(lambda: plc.status(CAN_BUS) == DOWN, PATIENCE)
    adapter.lines.clear()
    await adapter.up()
    await until(lambda: plc.status(CAN_BUS) == ACTIVE, PATIENCE)
    await until(lambda: f"{EMERGENCY}4081110000000000" in adapter.lines, PATIENCE)
    frames = [line for line in adapter.lines if line.startswith(("t710", "t090"))]
    assert frames[0] == BOOT_UP
    assert frames[1].startswith(f"{EMERGENCY}4081")
    assert plc.status(NMT_STATE) == OPERATIONAL

    adapter.unplug()
    await until(lambda: plc.status(CAN_BUS) == ABSENT, PATIENCE)
    assert plc.status(NMT_STATE) == PRE_OPERATIONAL
    assert "Traceback" not in daemon.text()
