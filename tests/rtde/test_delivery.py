"""Packages that came together: their order, which of them are handed on, a clock that went back."""

from __future__ import annotations

import struct
from typing import cast

import pytest

from gatewayd.rtde.delivery import BEGINNING, OutputDelivery, SteadyOutput
from gatewayd.rtde.handler import ClientHandler
from gatewayd.rtde.messages import ControllerVersion
from gatewayd.rtde.pace import Statistics
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.session import Session
from gatewayd.rtde.types import DataType


class Listener:
    def __init__(self) -> None:
        self.packages: list[float] = []

    def earlier(self, values: tuple[Scalar, ...], _now: float) -> bool:
        self.packages.append(values[0])
        return True

    def values(self, values: tuple[Scalar, ...], _now: float) -> None:
        self.packages.append(values[0])


def delivery(name: str, *, every: bool) -> tuple[OutputDelivery, Listener, Statistics]:
    outputs = Recipe((name,), (DataType.DOUBLE,))
    session = Session(ControllerVersion(5, 12, 0, 0), None, 2, 0.002, outputs, {}, ())
    listener, statistics = Listener(), Statistics()
    made = OutputDelivery(session, cast("ClientHandler", listener), statistics, 0.0, every=every)
    return made, listener, statistics


def packages(*times: float) -> list[bytes]:
    return [struct.pack(">d", time) for time in times]


@pytest.mark.parametrize(
    "name, every, count",
    [("timestamp", True, 100), ("timestamp", False, 65), ("payload", True, 100), ("payload", False, 1)],
)
def test_every_package_is_handed_on_where_that_is_wanted(name: str, every: bool, count: int) -> None:
    made, listener, statistics = delivery(name, every=every)
    times = [100 + step * 0.002 for step in range(100)]
    assert made.deliver(packages(*times), 1.0, lambda: False) is None
    assert listener.packages == times[-count:]
    assert statistics.overtaken == 100 - count


def test_a_clock_that_goes_back_ends_it() -> None:
    made, listener, _ = delivery("timestamp", every=True)
    text = made.deliver(packages(50.0, 50.002, 0.0, 0.002), 1.0, lambda: False)
    assert text == "the controller's clock went from 50.002 s to 0.0 s: its RTDE service has restarted"
    assert listener.packages == [50.0, 50.002]


def test_nothing_follows_the_end() -> None:
    made, listener, _ = delivery("timestamp", every=True)
    assert made.deliver(packages(1.0, 1.002, 1.004), 1.0, lambda: bool(listener.packages)) is None
    assert listener.packages == [1.0]


def test_what_is_to_come_is_known_by_its_size_and_its_beginning() -> None:
    steady = SteadyOutput()
    assert steady.size == 0
    steady.expect(b"\x00\x0cU\x07", 8)
    assert (steady.size, steady.beginning) == (12, BEGINNING.unpack(b"\x00\x0cU\x07")[0])
    steady.taken += 24
    assert steady.stop() == 24
    assert (steady.size, steady.stop()) == (0, 0)
