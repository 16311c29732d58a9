"""The manager on a real SocketCAN, with devices by others as processes, which fail, and an interface that does."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from gatewayd.canopen.bus import BusState
from gatewayd.loop import clock
from tests.canopen.manager.foreign import Foreign, care, managing
from tests.kernel.bench import Peer, ip
from tests.links.canopen_node.recorder import until

PATIENCE = 20.0


@pytest.mark.timeout(80)
async def test_devices_are_managed_through_everything(vcan: str, tmp_path: Path) -> None:
    devices = [Foreign(kind, vcan, tmp_path / f"{kind}.log", "socketcan") for kind in ("canopen", "durand")]
    peer = Peer(vcan)
    try:
        for device in devices:
            assert device.answer() == "booted", device.text()
            device.do("set", 0x6004, 0, 7)
        async with managing(vcan, "socketcan") as manager:
            cared = [care(manager, device) for device in devices]
            await until(lambda: all(node.running for node, _ in cared), PATIENCE)
            for device, (node, diary) in zip(devices, cared, strict=True):
                await until(lambda device=device: device.do("state") == "OPERATIONAL", PATIENCE)  # type: ignore[misc]
                device.do("set", 0x6004, 0, 99)
                await until(lambda diary=diary: diary.values[-1:] == [99], PATIENCE)  # type: ignore[misc]
                node.write_pdo(1, 0, 200, clock.now())
                manager.schedule(clock.now())
                await until(lambda device=device: device.do("get", 0x6200, 0) == 200, PATIENCE)  # type: ignore[misc]
                device.do("emcy", 0x8130, 17, "05")
                await until(lambda diary=diary: diary.emergencies, PATIENCE)  # type: ignore[misc]

            # Our heartbeat is on the bus, and no task of the kernel sends it: it ends with the manager.
            peer.received()
            await until(lambda: any(frame.can_id == 0x77F for frame in peer.received()), PATIENCE)

            # A device reboots, and one stands still: its heartbeat is its own, not the kernel's.
            _, durand = devices
            node, diary = cared[1]
            durand.do("boot")
            await until(lambda: node.counters.boots == 2, PATIENCE)
            durand.signal(signal.SIGSTOP)
            await until(lambda: diary.events[-1:] == ["E: silent for 0.5 s"], PATIENCE)
            durand.signal(signal.SIGCONT)
            await until(lambda: node.running, PATIENCE)

            # The interface goes down and up.
            ip("link", "set", vcan, "down")
            await until(lambda: manager.bus is BusState.DOWN, PATIENCE)
            assert not node.running
            ip("link", "set", vcan, "up")
            await until(lambda: node.running, PATIENCE)
        assert manager.nodes[devices[0].node].condition.name == "OFFLINE"
    finally:
        for device in devices:
            device.kill()
