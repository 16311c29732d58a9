"""What this process may do of what a gateway has to."""

from __future__ import annotations

import re
from pathlib import Path

NET_BIND_SERVICE = 10
"""Number of CAP_NET_BIND_SERVICE (linux/capability.h)."""

_FIRST_UNPRIVILEGED = Path("/proc/sys/net/ipv4/ip_unprivileged_port_start")
_STATUS = Path("/proc/self/status")
_USUAL_FIRST = 1024
_EFFECTIVE = re.compile(r"^CapEff:\s*([0-9a-fA-F]+)$", re.MULTILINE)


def first_unprivileged_port(path: Path = _FIRST_UNPRIVILEGED) -> int:
    """Ports below need CAP_NET_BIND_SERVICE; the sysctl net.ipv4.ip_unprivileged_port_start."""
    try:
        return int(path.read_text("ascii"))
    except (OSError, ValueError):
        return _USUAL_FIRST


def has_capability(number: int, path: Path = _STATUS) -> bool:
    """Whether this process has it now; False where that cannot be seen."""
    try:
        found = _EFFECTIVE.search(path.read_text("ascii", "replace"))
    except OSError:
        return False
    return found is not None and bool(int(found[1], 16) >> number & 1)
