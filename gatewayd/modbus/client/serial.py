"""A line on a serial port, as RTU. Needs pyserial, which is imported only here: gatewayd's extra `serial` brings it.

The port is opened for this process alone, and read and written without waiting.
"""

from __future__ import annotations

import asyncio
import errno
import os
import termios
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gatewayd.loop.threads import in_daemon_thread
from gatewayd.modbus.client.conversation import Conversation, RtuConversation
from gatewayd.modbus.client.framing import MAX_RTU_FRAME
from gatewayd.modbus.client.line import Line
from gatewayd.modbus.client.runner import LineError, LineRunner
from gatewayd.modbus.client.timing import RtuTiming

if TYPE_CHECKING:
    import serial

PARITIES = {"none": "N", "even": "E", "odd": "O"}
"""As a mapping names them -> as pyserial does."""
_REMEDIES = {
    errno.ENOENT: "there is no such port; the list is in /dev/serial/by-id",
    errno.EACCES: "not allowed; the user needs the group that the port belongs to, mostly dialout",
    errno.EPERM: "not allowed; a unit of systemd with PrivateDevices= hides serial ports",
    errno.EBUSY: "another program uses it",
    errno.EAGAIN: "another program uses it",
    errno.EWOULDBLOCK: "another program uses it",
    errno.ENOTTY: "it is no serial port",
    errno.EIO: "the adapter does not answer; was it unplugged?",
    errno.ENXIO: "the adapter does not answer; was it unplugged?",
}


@dataclass(frozen=True, slots=True)
class SerialPort:
    """A port and how it is set."""

    device: str
    """As in `/dev/ttyUSB0`."""
    baudrate: int = 19_200
    """Bits per second; 19,200 with even parity is the default of the specification (V1.02, 2.5.1)."""
    parity: str = "even"
    """A key of PARITIES."""
    stop_bits: int = 1

    @property
    def bits(self) -> int:
        """Of one character on the line."""
        return 1 + 8 + (self.parity != "none") + self.stop_bits

    @property
    def timing(self) -> RtuTiming:
        """Of its frames."""
        return RtuTiming.of(self.baudrate, self.bits)

    def __str__(self) -> str:
        return f"{self.device} ({self.baudrate} 8{PARITIES[self.parity]}{self.stop_bits})"


class SerialLine(LineRunner):
    """A line on a serial port."""

    def __init__(
        self, port: SerialPort, line: Line, report: Callable[[str], object] = lambda _reason: None
    ) -> None:
        super().__init__(line, report)
        self.port = port

    async def open(self) -> _SerialChannel:
        """See LineRunner. A thread opens it: some drivers take their time."""
        opened = await in_daemon_thread(self._open, f"open {self.port.device}", lambda port: port.close())
        return _SerialChannel(self, opened)

    def make_conversation(self) -> Conversation:
        """See LineRunner."""
        return RtuConversation(self.port.timing)

    def _open(self) -> serial.Serial:
        try:
            import serial  # noqa: PLC0415 - an extra, needed only where a serial port is declared
        except ImportError as error:
            raise LineError(f"{self.port.device}: pyserial is missing; install gatewayd[serial]") from error
        try:
            return serial.Serial(
                self.port.device,
                self.port.baudrate,
                parity=PARITIES[self.port.parity],
                stopbits=self.port.stop_bits,
                timeout=0,
                write_timeout=0,
                exclusive=True,
            )
        except (OSError, ValueError, termios.error) as error:  # pyserial's own error is an OSError
            raise LineError(f"{self.port}: {_in_words(error)}") from error


class _SerialChannel:
    """The open port on the loop."""

    def __init__(self, runner: LineRunner, port: serial.Serial) -> None:
        self._runner = runner
        self._port = port
        self._file: int = port.fileno()
        self._unsent = b""
        self._loop = asyncio.get_running_loop()
        os.set_blocking(self._file, False)
        self._loop.add_reader(self._file, self._read)

    def send(self, data: bytes) -> None:
        """See Channel. What the driver does not take at once waits; that is less than one frame."""
        self._unsent = data
        self._write()

    def close(self) -> None:
        """See Channel."""
        self._loop.remove_reader(self._file)
        self._loop.remove_writer(self._file)
        with suppress(OSError):
            self._port.close()

    def _read(self) -> None:
        try:
            data = os.read(self._file, 2 * MAX_RTU_FRAME)
        except BlockingIOError:
            return
        except OSError as error:
            self._runner.ended(f"{self._port.port}: {_in_words(error)}")
            return
        if data:
            self._runner.received(data)
        else:
            self._runner.ended(f"{self._port.port}: {_REMEDIES[errno.EIO]}")

    def _write(self) -> None:
        try:
            written = os.write(self._file, self._unsent)
        except BlockingIOError:
            written = 0
        except OSError:
            # The port is found broken where it is read; here a turn is under way that must not be disturbed.
            return
        self._unsent = self._unsent[written:]
        if self._unsent:
            self._loop.add_writer(self._file, self._write)
        else:
            self._loop.remove_writer(self._file)


def _in_words(error: Exception) -> str:
    """What is wrong with the port, and the remedy where it is known."""
    cause = error.__context__ if isinstance(error.__context__, termios.error) else error
    number = cause.args[0] if isinstance(cause, termios.error) else getattr(error, "errno", None)
    if number in _REMEDIES:
        return _REMEDIES[number]
    return os.strerror(number) if isinstance(number, int) else str(error)
