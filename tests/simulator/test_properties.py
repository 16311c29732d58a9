"""READ_PROPERTIES at the simulator: from 5.26 and 10.15, silence before."""

from __future__ import annotations

import struct
from collections.abc import Callable

import pytest

from gatewayd.rtde.fields import Series, SoftwareVersion
from gatewayd.rtde.messages import PropertiesReply, ReadProperties
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.properties import answer_properties
from gatewayd.simulator.server import SimulatedController


async def test_a_client_gets_types_and_values_in_its_order(client: Callable[..., object]) -> None:
    controller = Controller(Series.X, SoftwareVersion(10, 15))
    async with SimulatedController(controller) as served, client(served.port) as one:  # type: ignore[attr-defined]
        assert await one.negotiate()
        one.send(ReadProperties(("v1.control_box.type", "v1.software.version")))
        reply = await one.receive(PropertiesReply)
    assert reply.types == ("UINT32", "UINT64")
    assert struct.unpack(">IQ", reply.payload)[1] == 10 << 48 | 15 << 32


def test_one_unknown_name_keeps_all_values_back() -> None:
    reply = answer_properties(("v1.software.version", "v9"), SoftwareVersion(5, 27))
    assert reply == PropertiesReply(("UINT64", "NOT_FOUND"), b"")


@pytest.mark.parametrize(
    "series, version",
    [
        (Series.CB3, SoftwareVersion(3, 15)),
        (Series.E, SoftwareVersion(5, 25, 9)),
        (Series.X, SoftwareVersion(10, 14)),
    ],
)
def test_older_software_says_nothing(series: Series, version: SoftwareVersion) -> None:
    assert Controller(series, version).properties(("v1.software.version",)) is None
