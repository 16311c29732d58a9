"""An I/O island: pyModbusTCP's server as a program. `set discrete 3 1` and `get coil 0` on standard input.

Usage: python -m tests.e2e.island HOST PORT
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from pyModbusTCP.server import DataBank, ModbusServer


def main(host: str, port: int) -> None:
    """Serve until standard input ends; each line is one command, each answer one line."""
    bank = DataBank()
    server = ModbusServer(host, port, no_block=True, data_bank=bank)
    server.start()
    print("listening", flush=True)
    get: dict[str, Callable[[int, int], Any]] = {
        "coil": bank.get_coils,
        "discrete": bank.get_discrete_inputs,
        "holding": bank.get_holding_registers,
        "input": bank.get_input_registers,
    }
    put: dict[str, Callable[[int, list[int]], Any]] = {
        "coil": bank.set_coils,
        "discrete": bank.set_discrete_inputs,
        "holding": bank.set_holding_registers,
        "input": bank.set_input_registers,
    }
    for line in sys.stdin:
        verb, area, address, *value = line.split()
        if verb == "set":
            put[area](int(address), [int(value[0])])
        print(int(get[area](int(address), 1)[0]), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
