"""A PLC as a process of its own: writes the same values every 20 ms until it is killed.

python -m tests.e2e.cyclic_client HOST PORT SOURCE VALUE
"""

from __future__ import annotations

import sys
import time

from tests.e2e.plc import Plc

CYCLE = 0.02


def main() -> None:
    host, port, source, value = sys.argv[1:]
    plc = Plc(int(port), source, host=host)
    printed = False
    while True:
        code = plc.write_integers(0, *[int(value)] * 3) or plc.write(6, [1])
        if not printed:
            print(f"first write {code}", flush=True)
            printed = True
        time.sleep(CYCLE)


if __name__ == "__main__":
    main()
