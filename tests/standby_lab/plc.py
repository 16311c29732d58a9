"""A PLC that writes a counter every 20 ms to the virtual address, and writes down what was accepted: `plc HOST LOG`."""

from __future__ import annotations

import socket
import struct
import sys
import time
from pathlib import Path

PATIENCE = 0.1
"""Seconds for connection and answer; then it connects anew."""


def main(host: str, log: Path) -> None:
    """Write until killed."""
    stream, count = log.open("w", buffering=1), 0
    while True:
        try:
            with socket.create_connection((host, 1502), PATIENCE) as wire:
                wire.settimeout(PATIENCE)
                while True:
                    count = (count + 1) % 30000
                    request = struct.pack(">HHHBBHHBI", count, 0, 11, 1, 16, 10, 2, 4, count)
                    wire.sendall(request)
                    answer = wire.recv(260)
                    if not answer:
                        break
                    if answer[7] == 16:
                        stream.write(f"{time.monotonic()} {count}\n")
                    time.sleep(0.02)
        except OSError:
            time.sleep(0.02)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
