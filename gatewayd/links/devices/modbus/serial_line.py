"""Lines on serial ports of this machine. Imported where a mapping has one, since it needs pyserial."""

from __future__ import annotations

from collections.abc import Callable

from gatewayd.links.devices.modbus.plan import LineAddress
from gatewayd.links.devices.modbus.tapped import TappedChannel, TappedRunner
from gatewayd.modbus.client.line import Line
from gatewayd.modbus.client.serial import SerialLine, SerialPort


class TappedSerialLine(TappedRunner, SerialLine):
    """A line on a serial port."""

    async def open(self) -> TappedChannel:  # type: ignore[override]
        """See LineRunner."""
        return TappedChannel(self, await super().open())


def serial_runner(address: LineAddress, line: Line, report: Callable[[str], object]) -> TappedRunner:
    """What keeps a line at a serial port at work."""
    settings = address.serial
    assert settings is not None
    port = SerialPort(address.path, settings.baudrate, settings.parity, settings.stop_bits)
    return TappedSerialLine(port, line, report)
