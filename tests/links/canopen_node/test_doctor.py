"""What a machine with or without CAN answers; tests/kernel/test_doctor.py has a bus."""

from __future__ import annotations

import errno
import os
from collections.abc import AsyncIterator
from dataclasses import replace

import pytest

from gatewayd.canopen.bus import BusError
from gatewayd.canopen.interface import Interface
from gatewayd.core.definition import CellDefinition
from gatewayd.links.canopen_node import doctor
from gatewayd.links.canopen_node.declaration import KIND
from gatewayd.links.canopen_node.diagnosis import Heard
from gatewayd.links.canopen_node.doctor import EXAMINATION
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.examination import Observation, Outcome, RunningCell, Surroundings
from tests.links.canopen_node.test_diagnosis import WELL, plan


def cell() -> CellDefinition:
    return None  # type: ignore[return-value]


async def look(found: CanopenPlan | None = None, *running: RunningCell) -> list[Observation]:
    examined: AsyncIterator[Observation] = EXAMINATION.examine(found or plan(), cell(), Surroundings(running))
    return [seen async for seen in examined]


@pytest.fixture
def bus(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """A kernel with CAN, an interface as it should be, and a node on the bus."""

    async def listen(_channel: str, seconds: float) -> Heard:
        return Heard(seconds, 3, {0x710})

    monkeypatch.setattr(doctor, "_look", lambda _channel: WELL)
    monkeypatch.setattr(doctor, "listen", listen)
    return monkeypatch


async def test_interfaces_of_python_can_are_not_opened() -> None:
    (found,) = await look(replace(plan(), interface="slcan", channel="/dev/ttyUSB0"))
    assert found.outcome is Outcome.SKIPPED
    assert found.text.startswith("slcan:/dev/ttyUSB0 is python-can's")


async def test_a_kernel_without_can_says_what_to_load(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_channel: str) -> Interface:
        raise OSError(errno.EAFNOSUPPORT, os.strerror(errno.EAFNOSUPPORT))

    monkeypatch.setattr(doctor, "_look", refuse)
    (found,) = await look()
    assert found.text.startswith("this machine offers no SocketCAN")
    assert found.remedy.startswith("load the kernel modules can and can_raw")


async def test_a_sandbox_says_what_to_allow(bus: pytest.MonkeyPatch) -> None:
    def refuse(_channel: str) -> Interface:
        raise BusError("cannot ask the kernel; allow AF_NETLINK")

    bus.setattr(doctor, "_look", refuse)
    (found,) = await look()
    assert (found.text, found.remedy) == ("cannot ask the kernel", "allow AF_NETLINK")


@pytest.mark.parametrize(
    "number, text",
    [
        (errno.ERANGE, "there is no interface can0"),
        (errno.ENOMEM, "cannot look at can0: Cannot allocate memory"),
    ],
)
async def test_what_the_kernel_says_of_a_name_is_no_lack_of_can(
    monkeypatch: pytest.MonkeyPatch, number: int, text: str
) -> None:
    """A name of more than 15 bytes is ERANGE."""

    class Refusing:
        def read(self, _channel: str) -> Interface:
            raise OSError(number, "the kernel does not describe the interface")

        def close(self) -> None: ...

    monkeypatch.setattr(doctor, "InterfaceReader", Refusing)
    monkeypatch.setattr("socket.socket", lambda *_: Refusing())
    (found,) = await look()
    assert found.text == text


async def test_an_absent_interface_ends_the_look(bus: pytest.MonkeyPatch) -> None:
    bus.setattr(doctor, "_look", lambda _channel: None)
    (found,) = await look()
    assert found.text == "there is no interface can0"


@pytest.mark.parametrize("change", [{"up": False}, {"carrier": False}, {"is_can": False}])
async def test_a_bus_that_carries_nothing_is_not_listened_to(
    bus: pytest.MonkeyPatch, change: dict[str, bool]
) -> None:
    bus.setattr(doctor, "_look", lambda _channel: replace(WELL, **change))  # type: ignore[arg-type]
    assert "traffic" not in [seen.check for seen in await look()]


@pytest.mark.usefixtures("bus")
async def test_another_node_with_our_number_is_heard() -> None:
    assert [seen.check for seen in await look() if seen.outcome.is_finding] == ["node-ID"]


@pytest.mark.parametrize("channel, findings", [("socketcan:can0", 0), ("socketcan:can1", 1)])
@pytest.mark.usefixtures("bus")
async def test_the_node_of_the_gateway_on_this_machine_is_our_own(channel: str, findings: int) -> None:
    status = {"links": [{"name": "canopen", "title": KIND.title}], "canopen": {"channel": channel}}
    found = await look(None, RunningCell("/run/s", status))
    assert sum(seen.outcome.is_finding for seen in found) == findings


async def test_an_interface_that_goes_meanwhile_is_no_crash(bus: pytest.MonkeyPatch) -> None:
    async def gone(_channel: str, _seconds: float) -> Heard:
        raise OSError(errno.ENETDOWN, "Network is down")

    bus.setattr(doctor, "listen", gone)
    assert (await look())[-1].text == "can0: Network is down"
