"""`gatewayd` on a machine whose name server does not answer: looking up a name takes a minute.

python -m tests.e2e.slow_names ARGUMENTS OF GATEWAYD
"""

from __future__ import annotations

import socket
import time
from typing import Any

from gatewayd.__main__ import main

NAME = "robot.example"
_getaddrinfo = socket.getaddrinfo


def slow(host: Any, *args: Any, **options: Any) -> Any:
    if host == NAME and not options.get("flags", 0) & socket.AI_NUMERICHOST:
        time.sleep(60)
    return _getaddrinfo(host, *args, **options)


if __name__ == "__main__":
    socket.getaddrinfo = slow
    main()
