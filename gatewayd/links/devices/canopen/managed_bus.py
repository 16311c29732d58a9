"""The manager of a bus, from what the devices on it say of it."""

from __future__ import annotations

from typing import Final

from gatewayd.canopen.manager.plan import ManagerPlan
from gatewayd.canopen.sync import SyncPlan
from gatewayd.links.devices.sections import DeviceSpec
from gatewayd.mapping.document import Document

BEATS: Final = 3
"""Heartbeats in the time without one after which a device is lost: one may get lost on the bus."""


def bus_of(document: Document, spec: DeviceSpec) -> ManagerPlan:
    """The bus of a device, with what any of the devices on it says of the manager; a rule looks for contradictions."""
    assert spec.canopen is not None
    found = [
        part.spec
        for part in document.parts(DeviceSpec).values()
        if (part.spec.canopen, part.spec.interface) == (spec.canopen, spec.interface)
    ]
    sync = next((each.sync for each in found if each.sync is not None), None)
    beat = next((each.manager_heartbeat for each in found if each.manager_heartbeat is not None), None)
    return ManagerPlan(
        spec.interface,
        spec.canopen,
        spec.bitrate,
        next((each.manager for each in found if each.manager is not None), None),
        round(1000 * beat) if beat is not None else 0,
        SyncPlan(producer=sync is not None, period=round(1e6 * sync) if sync is not None else 0),
    )
