"""A PLC: a Modbus client on pyModbusTCP with the source address that makes it one writer or another."""

from __future__ import annotations

import socket
import struct
from collections.abc import Sequence

from pyModbusTCP.client import ModbusClient
from pyModbusTCP.constants import EXP_NONE, MB_CONNECT_ERR

from tests.e2e.processes import HOST

PLC = "127.0.0.2"
HMI = "127.0.0.3"
LINE = "127.0.0.4"
STRANGER = "127.0.0.9"
"""Source addresses: the writers of the tests' mappings, and one that no mapping declares."""

NO_ADDRESS, NO_VALUE, BUSY, NO_PATH, FAILED = 0x02, 0x03, 0x06, 0x0A, 0x0B
"""Modbus exception codes."""

_STATUS = 60000
_TIMEOUT = 10.0


class Plc:
    """One Modbus connection. Writes return the exception code, 0 if accepted; ConnectionError if it is gone."""

    def __init__(self, port: int, source: str = PLC, unit: int = 1, host: str = HOST) -> None:
        self._client = ModbusClient(host, port, unit, timeout=_TIMEOUT, auto_open=False)
        self._source = source
        self._address = (host, port)
        # pyModbusTCP connects from whatever address the system chooses; a PLC is known by its own.
        self._client._open = self._connect
        if not self._client.open():
            raise ConnectionError(self._client.last_error_as_txt)

    def _connect(self) -> None:
        try:
            connected = socket.create_connection(self._address, _TIMEOUT, (self._source, 0))
        except OSError as error:
            raise ModbusClient._NetworkError(MB_CONNECT_ERR, str(error)) from error
        self._client._sock = connected

    def close(self) -> None:
        self._client.close()

    # -- words -------------------------------------------------------------------------------------------------------

    def read(self, address: int, count: int = 1) -> list[int]:
        """Holding registers."""
        words = self._client.read_holding_registers(address, count)
        code = self._code()
        assert not code, f"exception {code:02X} reading {count} at {address}"
        return list(words)

    def reading_code(self, address: int, count: int = 1) -> int:
        """The exception code that reading these registers gives, 0 for none."""
        self._client.read_holding_registers(address, count)
        return self._code()

    def write(self, address: int, words: Sequence[int]) -> int:
        """Function 16."""
        self._client.write_multiple_registers(address, list(words))
        return self._code()

    def write_one(self, address: int, word: int) -> int:
        """Function 6."""
        self._client.write_single_register(address, word)
        return self._code()

    def coils(self, address: int, count: int) -> list[bool]:
        found = self._client.read_coils(address, count)
        assert not self._code()
        return list(found)

    def discrete(self, address: int, count: int) -> list[bool]:
        found = self._client.read_discrete_inputs(address, count)
        assert not self._code()
        return list(found)

    def write_coils(self, address: int, bits: Sequence[bool]) -> int:
        """Function 15."""
        self._client.write_multiple_coils(address, list(bits))
        return self._code()

    # -- numbers -----------------------------------------------------------------------------------------------------

    def integers(self, address: int, count: int = 1) -> list[int]:
        """INT32 values, high word first."""
        return list(struct.unpack(f">{count}i", _bytes(self.read(address, 2 * count))))

    def doubles(self, address: int, count: int = 1) -> list[float]:
        return list(struct.unpack(f">{count}d", _bytes(self.read(address, 4 * count))))

    def write_integers(self, address: int, *values: int) -> int:
        return self.write(address, _words(struct.pack(f">{len(values)}i", *values)))

    def write_doubles(self, address: int, *values: float) -> int:
        return self.write(address, _words(struct.pack(f">{len(values)}d", *values)))

    # -- status block ------------------------------------------------------------------------------------------------

    def status(self, offset: int) -> int:
        return self.read(_STATUS + offset)[0]

    @property
    def robot_state(self) -> int:
        """0 lost, 1 waiting, 2 fresh, 3 silent, 4 frozen."""
        return self.status(7)

    @property
    def writable(self) -> bool:
        """Robot connected and its inputs adopted."""
        return bool(self.status(1) & 2)

    @property
    def refusal(self) -> tuple[int, int, int, int]:
        """The last one: reason, variable, writer, holder."""
        reason, variable, writer, holder = self.read(_STATUS + 30, 4)
        return reason, variable, writer, holder

    def good(self, variable: int) -> bool:
        """The quality bit of the variable of this number."""
        word, bit = divmod(variable - 1, 16)
        return bool(self.status(64 + word) >> bit & 1)

    def owner(self, variable: int) -> int:
        return self.status(192 + variable - 1)

    def lease(self, variable: int) -> int:
        """Milliseconds."""
        return self.status(1216 + variable - 1)

    def quality(self, variable: int) -> int:
        """0 good, 1 stale, 2 unavailable, 3 never."""
        return self.status(3264 + variable - 1)

    def request(self, variable: int) -> int:
        return self.write_one(_STATUS + 40, variable)

    def release(self, variable: int) -> int:
        return self.write_one(_STATUS + 41, variable)

    def _code(self) -> int:
        """The exception code of the last answer."""
        if self._client.last_except != EXP_NONE:
            return int(self._client.last_except)
        if self._client.last_error:
            raise ConnectionError(self._client.last_error_as_txt)
        return 0


def _bytes(words: Sequence[int]) -> bytes:
    return struct.pack(f">{len(words)}H", *words)


def _words(data: bytes) -> list[int]:
    return list(struct.unpack(f">{len(data) // 2}H", data))
