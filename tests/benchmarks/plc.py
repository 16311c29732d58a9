"""A Modbus client of the plainest kind: one blocking socket, one request at a time."""

from __future__ import annotations

import socket
import struct

READ = 3
WRITE = 16
MBAP = struct.Struct(">HHHB")


class Plc:
    """One connection. RuntimeError names the exception code of a refused request."""

    def __init__(self, port: int, unit: int = 1) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), 5)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._unit = unit

    def read(self, first: int, count: int) -> bytes:
        """The holding registers as bytes, big-endian."""
        return self._ask(struct.pack(">BHH", READ, first, count))[2:]

    def write(self, first: int, data: bytes) -> None:
        """Write whole registers and wait for the answer."""
        self._ask(self._writing(first, data))

    def post(self, first: int, data: bytes) -> None:
        """Write whole registers; `answer` fetches the answer."""
        self._send(self._writing(first, data))

    def answer(self) -> bytes:
        """The next answer's PDU."""
        header = self._exactly(MBAP.size)
        pdu = self._exactly(MBAP.unpack(header)[2] - 1)
        if pdu[0] & 0x80:
            raise RuntimeError(f"exception {pdu[1]:02X} for function {pdu[0] & 0x7F}")
        return pdu

    def close(self) -> None:
        """End the connection."""
        self._socket.close()

    @staticmethod
    def _writing(first: int, data: bytes) -> bytes:
        return struct.pack(">BHHB", WRITE, first, len(data) // 2, len(data)) + data

    def _ask(self, pdu: bytes) -> bytes:
        self._send(pdu)
        return self.answer()

    def _send(self, pdu: bytes) -> None:
        self._socket.sendall(MBAP.pack(1, 0, len(pdu) + 1, self._unit) + pdu)

    def _exactly(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            piece = self._socket.recv(size - len(data))
            if not piece:
                raise ConnectionError("the server closed the connection")
            data += piece
        return data
