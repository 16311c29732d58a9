"""What is looked at of a CANopen device."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gatewayd.canopen.interface import Interface, InterfaceReader
from gatewayd.links.devices.canopen import doctor
from gatewayd.links.devices.canopen.doctor import EXAMINATION
from gatewayd.links.examination import Outcome
from tests.links.devices.canopen.cells import planned, the_device


async def seen(*running: Any) -> list[tuple[str, Outcome]]:
    plan = planned()
    around: Any = SimpleNamespace(running=running)
    return [
        (found.text, found.outcome)
        async for found in EXAMINATION.examine(the_device(plan), plan.cell, around)
    ]


async def test_running_gateway_is_asked_first() -> None:
    bus = the_device(planned()).bus.address
    elsewhere = SimpleNamespace(
        name="press", status={"encoder": {"state": "good", "address": "socketcan:can7"}}
    )
    good = SimpleNamespace(name="press", status={"encoder": {"state": "good", "address": bus}})
    lost = SimpleNamespace(
        name="press", status={"encoder": {"state": "lost", "address": bus, "reason": "B no answer"}}
    )
    assert await seen(good) == [("the running gateway has it: good", Outcome.OK)]
    assert await seen(lost) == [("the running gateway has it: lost", Outcome.PROBLEM)]
    assert await seen() == await seen(elsewhere) == []


@pytest.mark.parametrize(
    "found, text",
    [
        (None, "there is no CAN interface can1"),
        (Interface(1, False, True, True), "there is no CAN interface can1"),
        (Interface(1, True, False, True), "can1 is down"),
        (
            Interface(1, True, True, True, bitrate=250_000),
            "can1 runs at 250000 bit/s, the mapping says 500000",
        ),
        (Interface(1, True, True, True, bitrate=500_000), "can1 is up"),
    ],
)
def test_interface_of_the_kernel(found: Interface | None, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(InterfaceReader, "read", lambda _self, _name: found)
    observation = doctor.interface("can1", 500_000)
    assert observation.text == text
    assert (observation.outcome is Outcome.OK) == (text == "can1 is up")
