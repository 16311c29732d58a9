"""Sends what no Modbus client should, as fast as it is answered or cut off.

python -m tests.e2e.modbus_fuzzer HOST PORT SOURCE CASES SEED
    Prints one line at the end; ends with an error only if the gateway does not take connections or bytes any more.
"""

from __future__ import annotations

import random
import select
import socket
import struct
import sys
from collections.abc import Callable
from contextlib import suppress

ADDRESSES = (0, 1, 2, 4, 8, 20, 100, 101, 1000, 59999, 60000, 60040, 60041, 64287, 64288, 65535)
_PATIENCE = 5.0
_MOMENT = 0.002
_AT_ONCE = 8
"""Cases of one connection, if it lives that long."""
_FUNCTIONS = (1, 2, 3, 4, 5, 6, 15, 16, 22, 23, 43)


def frame(chance: random.Random, pdu: bytes, length: int | None = None) -> bytes:
    unit = chance.choice((1, 1, 1, 2, 0, 255, chance.randrange(256)))
    size = len(pdu) + 1 if length is None else length
    return struct.pack(">HHHB", chance.randrange(65536), 0, size, unit) + pdu


def request(chance: random.Random) -> bytes:
    """A PDU of a known function with addresses and counts at the edges of what is allowed, or beyond."""
    function = chance.choice(_FUNCTIONS)
    address = chance.choice((*ADDRESSES, chance.randrange(65536)))
    count = chance.choice(
        (0, 1, 2, 4, 122, 123, 124, 125, 126, 1968, 2000, 2001, 65535, chance.randrange(65536))
    )
    data = chance.randbytes(chance.choice((0, 1, 2, 4, 8, 2 * (count % 124))))
    size = chance.choice((len(data), len(data), chance.randrange(256)))
    return {
        15: struct.pack(">BHHB", 15, address, count, size) + data,
        16: struct.pack(">BHHB", 16, address, count, size) + data,
        22: struct.pack(">BHHH", 22, address, count, chance.randrange(65536)),
        23: struct.pack(">BHHHHB", 23, address, count, chance.choice(ADDRESSES), len(data) // 2, size) + data,
        43: bytes((43, chance.choice((13, 14, 255)))) + chance.randbytes(chance.randrange(4)),
    }.get(function, struct.pack(">BHH", function, address, count))[:253]


def noise(chance: random.Random) -> bytes:
    return chance.randbytes(chance.choice((1, 3, 7, 8, 20, 260, 4000)))


def known(chance: random.Random) -> bytes:
    return frame(chance, request(chance))


def unknown(chance: random.Random) -> bytes:
    return frame(chance, chance.randbytes(chance.randrange(1, 254)))


def misframed(chance: random.Random) -> bytes:
    return frame(
        chance, request(chance), chance.choice((0, 1, 2, 254, 255, 256, 65535, chance.randrange(65536)))
    )


def mutated(chance: random.Random) -> bytes:
    data = bytearray(known(chance))
    for _ in range(chance.randrange(1, 4)):
        data[chance.randrange(len(data))] = chance.randrange(256)
    return bytes(data)


def cut(chance: random.Random) -> bytes:
    data = known(chance)
    return data[: chance.randrange(1, len(data))]


def flood(chance: random.Random) -> bytes:
    """Many requests at once, whose answers may never be read."""
    return known(chance) * chance.randrange(1, 60)


_KINDS: tuple[Callable[[random.Random], bytes], ...] = (
    noise,
    known,
    known,
    unknown,
    misframed,
    mutated,
    mutated,
    cut,
    flood,
)


def one_connection(address: tuple[str, int], source: str, chance: random.Random, most: int) -> int:
    """Cases until the gateway closes the connection, but not more than `most`; how many there were."""
    done = 0
    with socket.create_connection(address, _PATIENCE, (source, 0)) as connection:
        try:
            while done < most:
                done += 1
                send(connection, chance.choice(_KINDS)(chance), chance)
                if chance.random() < 0.7 and is_closed(connection):
                    return done
            ending = chance.random()
            if ending < 0.3:
                # A reset instead of an orderly end.
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            elif ending < 0.5:
                connection.shutdown(socket.SHUT_WR)
                while connection.recv(65536):
                    pass
        except TimeoutError:
            raise
        except OSError:
            pass
    return done


def send(connection: socket.socket, data: bytes, chance: random.Random) -> None:
    """All of it, in one piece or two."""
    cut_at = chance.randrange(len(data)) if chance.random() < 0.2 else 0
    connection.sendall(data[:cut_at])
    connection.sendall(data[cut_at:])


def is_closed(connection: socket.socket) -> bool:
    """Wait a moment for an answer, read what has been answered so far; whether that was the end of the connection."""
    if not select.select([connection], [], [], _MOMENT)[0]:
        return False
    connection.setblocking(False)
    with suppress(BlockingIOError):
        while connection.recv(65536):
            pass
        return True
    connection.settimeout(_PATIENCE)
    return False


def main() -> None:
    host, port, source, cases, seed = sys.argv[1:]
    chance = random.Random(int(seed))
    done = connections = 0
    while done < int(cases):
        done += one_connection((host, int(port)), source, chance, min(_AT_ONCE, int(cases) - done))
        connections += 1
    print(f"{done} cases {connections} connections", flush=True)


if __name__ == "__main__":
    main()
