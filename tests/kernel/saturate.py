"""Send numbered frames of eight bytes in slots of 10 ms, as many in each as a bus of 1 Mbit/s carries."""

from __future__ import annotations

import socket
import struct
import sys
import time


def main() -> None:
    name, count = sys.argv[1], int(sys.argv[2])
    sender = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    sender.bind((name,))
    slot = time.monotonic()
    for number in range(count):
        sender.send(struct.pack("=IB3xQ", 0x205, 8, number))
        if number % 90 == 89:
            slot = max(slot + 0.01, time.monotonic())  # what was missed is not made up for: no bus is faster
            time.sleep(max(0.0, slot - time.monotonic()))


if __name__ == "__main__":
    main()
