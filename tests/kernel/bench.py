"""CAN interfaces to test with: a peer on any of them, and a serial adapter whose controller does what a test says.

The adapter is a pseudo-terminal under the kernel's slcan line discipline: the kernel believes in a CAN controller
that reports its state and error counters, goes off the bus, and is unplugged.
"""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import os
import pty
import socket
import struct
import subprocess
import termios
import tty

from gatewayd.canopen.frame import Frame
from gatewayd.canopen.socketcan import pack

_N_SLCAN = 17
_SIOCGIFNAME = 0x8910
_FRAME = struct.Struct("=IB3x8s")


def ip(*words: str) -> None:
    """Run the program ip; CalledProcessError if it fails."""
    subprocess.run(["ip", *words], check=True, capture_output=True)


def serial_adapters_work() -> bool:
    """Whether the kernel makes a CAN interface of a terminal for us."""
    master, slave = pty.openpty()
    try:
        fcntl.ioctl(slave, termios.TIOCSETD, struct.pack("i", _N_SLCAN))
    except OSError:
        return False
    finally:
        os.close(slave)
        os.close(master)
    return True


class Peer:
    """Another program on the bus."""

    def __init__(self, name: str) -> None:
        self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.bind((name,))
        self._socket.setblocking(False)

    def send(self, frame: Frame) -> None:
        self._socket.send(pack(frame))

    def send_raw(self, can_id: int, data: bytes) -> None:
        """With the flags of the identifier as they are given: extended, error."""
        self._socket.send(_FRAME.pack(can_id, len(data), data))

    def received(self) -> list[Frame]:
        """What has come since the last call."""
        frames = []
        with contextlib.suppress(BlockingIOError):
            while True:
                can_id, length, data = _FRAME.unpack(self._socket.recv(16))
                remote = bool(can_id & 0x4000_0000)
                data = b"" if remote else data[:length]
                frames.append(Frame(can_id & 0x7FF, data, remote, length if remote else 0))
        return frames

    def close(self) -> None:
        self._socket.close()


class SerialAdapter:
    """One adapter; the test is its firmware."""

    def __init__(self) -> None:
        self.name = ""
        """Of the interface that the kernel makes of it."""
        self.lines: list[str] = []
        """What the kernel sent to it; `t1852ABCD` is a frame."""
        self._master = -1
        self._slave = -1
        self._rest = b""

    def plug_in(self) -> None:
        """The kernel finds it."""
        self._master, self._slave = pty.openpty()
        tty.setraw(self._master)
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        fcntl.ioctl(self._slave, termios.TIOCSETD, struct.pack("i", _N_SLCAN))
        self.name = fcntl.ioctl(self._slave, _SIOCGIFNAME, bytes(16)).split(b"\0")[0].decode()
        self.read()

    def unplug(self) -> None:
        """The kernel loses it."""
        if self._master >= 0:
            self.stop_reading()
            os.close(self._slave)
            os.close(self._master)
            self._master = self._slave = -1

    def read(self) -> None:
        """Take what the kernel sends, from now on."""
        asyncio.get_running_loop().add_reader(self._master, self._readable)

    def stop_reading(self) -> None:
        """Take nothing: the wire is busy."""
        asyncio.get_running_loop().remove_reader(self._master)

    def _readable(self) -> None:
        try:
            *lines, self._rest = (self._rest + os.read(self._master, 4096)).split(b"\r")
        except OSError:
            self.stop_reading()
            return
        self.lines += [line.decode() for line in lines]

    def say(self, *lines: str) -> None:
        """Report: `t12321122` a frame; `sa`, `sw`, `sp`, `sb` active, warning, passive, bus-off.

        States are followed by the receive and the transmit error counter, three digits each.
        """
        os.write(self._master, "".join(line + "\r" for line in lines).encode())

    async def configure(self, bitrate: int) -> None:
        await self._ip("type", "can", "bitrate", str(bitrate))

    async def set_queue_length(self, frames: int) -> None:
        await self._ip("txqueuelen", str(frames))

    async def up(self) -> None:
        await self._ip("up")

    async def down(self) -> None:
        await self._ip("down")

    async def _ip(self, *words: str) -> None:
        """Run ip while the loop goes on: the kernel talks to the adapter meanwhile, and waits a second for it to read.

        A busy machine may need longer than that to let us read, so it is asked once more.
        """
        for _ in range(2):
            process = subprocess.Popen(["ip", "link", "set", self.name, *words])  # noqa: ASYNC220 - starting it is quick
            while process.poll() is None:  # noqa: ASYNC110 - without a thread nobody reports it
                await asyncio.sleep(0.005)
            if process.returncode == 0:
                return
        raise AssertionError(f"ip link set {self.name} {' '.join(words)}: exit code {process.returncode}")
