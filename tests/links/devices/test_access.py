"""Which family a line and a device belong to."""

from __future__ import annotations

from gatewayd.links.access import ScanOrder
from gatewayd.links.devices.access import ACCESS
from tests.links.devices.cells import device, planned


def test_lines_of_modbus() -> None:
    assert ACCESS.scan(ScanOrder("127.0.0.1")).noun == "unit"
    assert ACCESS.scan(ScanOrder("/dev/ttyUSB0")).line == "/dev/ttyUSB0 19200 8N1"


def test_device_of_modbus() -> None:
    assert ACCESS.refusal(device(planned(), "island"), []) == ""
