"""What devices take of their bus."""

from __future__ import annotations

import pytest

from gatewayd.canopen.manager.plan import ManagerPlan
from gatewayd.canopen.sync import SyncPlan
from gatewayd.links.devices.canopen.bus_load import device_shares, manager_shares
from gatewayd.links.devices.expand import devices_of
from gatewayd.links.devices.sections import DeviceSpec
from tests.links.devices.canopen.cells import VARIABLES, expanded


def shares(more: str = "") -> dict[str, float]:
    cell = expanded(VARIABLES, more)
    device = cell.document.parts(DeviceSpec)["encoder"]
    return {each.what: each.rate for each in device_shares(cell, device, devices_of(cell).of("encoder"))}


def test_pdos_heartbeat_and_repeated_reads() -> None:
    found = shares()
    rate = expanded(VARIABLES).settings.rate
    assert found == {
        "device encoder: TPDO 1": rate,
        "device encoder: RPDO 1": rate,
        "device encoder: heartbeat": pytest.approx(1 / 3),
        "device encoder: reads of 2000h": pytest.approx(50.0),
    }


def test_what_the_manager_sends() -> None:
    bus = ManagerPlan("virtual", "can1", 500_000, 127, 200, SyncPlan(producer=True, period=10_000))
    assert {each.what: each.rate for each in manager_shares(bus)} == {
        "SYNC": 100.0,
        "the manager: heartbeat": 5.0,
    }
    assert list(manager_shares(ManagerPlan("virtual", "can1", 500_000))) == []
