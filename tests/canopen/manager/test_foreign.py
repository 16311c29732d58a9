"""The manager and devices by others, each a process of its own: python-canopen's LocalNode, and durand."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator

import pytest

from gatewayd.canopen.manager.plan import ExpectedIdentity
from gatewayd.loop import clock
from tests.canopen.manager.foreign import NODES, PATIENCE, Foreign, care, managing
from tests.e2e.processes import HOST, Process, free_port
from tests.links.canopen_node.recorder import until

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def channel(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A CAN bus between processes."""
    port = free_port()
    words = [sys.executable, "-m", "tests.e2e.can_broker", HOST, str(port)]
    broker = Process(words, tmp_path_factory.mktemp("bus") / "broker.log")
    assert broker.answer() == "carrying"
    yield f"socket://{HOST}:{port}"
    broker.kill()


@pytest.fixture(scope="module")
def devices(channel: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Foreign]]:
    """Both devices, started together."""
    directory = tmp_path_factory.mktemp("devices")
    made = {kind: Foreign(kind, channel, directory / f"{kind}.log") for kind in NODES}
    for device in made.values():
        assert device.answer() == "booted", device.text()
    yield made
    for device in made.values():
        device.kill()


@pytest.fixture(params=NODES)
def device(request: pytest.FixtureRequest, devices: dict[str, Foreign]) -> Foreign:
    return devices[request.param]


async def test_boot_values_emergencies_reboot_and_loss(channel: str, device: Foreign) -> None:
    device.do("set", 0x6004, 0, 7)
    async with managing(channel) as manager:
        node, diary = care(manager, device)
        await until(lambda: node.running, PATIENCE)
        assert device.do("get", 0x2000, 0) == 0x1234
        assert device.do("get", 0x1017, 0) == 100
        await until(lambda: device.do("state") == "OPERATIONAL", PATIENCE)
        await until(lambda: 7 in diary.values + diary.read, PATIENCE)

        # Values in both directions, and by SDO.
        device.do("set", 0x6004, 0, 0xFFFF_FFFE)
        await until(lambda: diary.values[-1:] == [0xFFFF_FFFE], PATIENCE)
        node.write_pdo(1, 0, 200, clock.now())
        manager.schedule(clock.now())
        await until(lambda: device.do("get", 0x6200, 0) == 200, PATIENCE)
        node.write_object(0x2000, 0, b"\x78\x56", clock.now())
        await until(lambda: diary.read[-1:] == [0x5678], PATIENCE)

        device.do("emcy", 0x4210, 9, "0102")
        await until(lambda: diary.emergencies, PATIENCE)
        assert str(diary.emergencies[0]).startswith("4210h device temperature too high, error register 09h")

        # It reboots in the middle of it all.
        diary.events.clear()
        device.do("boot")
        await until(lambda: "started" in diary.events, PATIENCE)
        assert diary.events[0] == "ended: the device has booted"
        await until(lambda: device.do("state") == "OPERATIONAL", PATIENCE)

        # It stands still, and comes back.
        diary.events.clear()
        device.signal(signal.SIGSTOP)
        await until(lambda: diary.events, PATIENCE)
        assert diary.events[:2] == ["ended: heartbeat lost", "E: silent for 0.5 s"]
        device.signal(signal.SIGCONT)
        await until(lambda: node.running, PATIENCE)
        # What was sent to it must have arrived before another test has it.
        await until(lambda: device.do("state") == "OPERATIONAL", PATIENCE)


async def test_wrong_vendor_and_missing_mandatory_device(channel: str, devices: dict[str, Foreign]) -> None:
    """Nothing is started while one is missing, though the other is ready."""
    right, wrong = devices["canopen"], devices["durand"]
    for device in devices.values():
        device.do("boot")
    async with managing(channel) as manager:
        one, _ = care(manager, right)
        other, diary = care(manager, wrong, expected=ExpectedIdentity(vendor=1), mandatory=True)
        await until(lambda: diary.events and one.condition.name == "READY", PATIENCE)
        assert diary.events == ["D: 1018h:01: is 000001F0h instead of 00000001h"]
        assert manager.bus_manager.missing == (wrong.node,)
        assert (right.do("state"), wrong.do("state")) == ("PRE-OPERATIONAL", "PRE-OPERATIONAL")
        manager.detach(wrong.node, "given up")
        assert one.running
        await until(lambda: right.do("state") == "OPERATIONAL", PATIENCE)
        assert not other.running


async def test_device_in_operation_is_kept(channel: str, device: Foreign) -> None:
    """L, by one manager after the other: the device is neither reset nor configured a second time."""
    device.do("set", 0x6004, 0, 7)
    async with managing(channel) as manager:
        node, _ = care(manager, device)
        await until(lambda: node.running and device.do("state") == "OPERATIONAL", PATIENCE)
    device.do("set", 0x2000, 0, 99)
    async with managing(channel) as manager:
        node, diary = care(manager, device, keep=True)
        await until(lambda: node.running, PATIENCE)
        assert node.boot.letter is not None
        assert (node.boot.letter.value, node.counters.boot_ups) == ("L", 0)
        assert diary.events == ["started"]
        assert device.do("get", 0x2000, 0) == 99
