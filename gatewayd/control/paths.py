"""Where the control socket lies: in the runtime directory of the service or of the session, else in /run/gatewayd."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

VARIABLE = "GATEWAYD_CONTROL"
"""Environment variable that names the socket, for the daemon and for the commands that talk to it."""
SYSTEM_SOCKET = Path("/run/gatewayd/control.sock")
"""Where the packaged service has it."""


def default_socket(environ: Mapping[str, str]) -> Path | None:
    """Where a daemon listens for which nobody said where; None if there is no place that only its own user can change.

    Under systemd the first of its runtime directories, in a session the user's.
    """
    runtime = environ.get("RUNTIME_DIRECTORY", "").partition(":")[0]
    if runtime:
        return Path(runtime, SYSTEM_SOCKET.name)
    session = _session_socket(environ)
    if session is not None:
        return session
    return SYSTEM_SOCKET if os.access(SYSTEM_SOCKET.parent, os.W_OK) else None


def candidates(environ: Mapping[str, str]) -> list[Path]:
    """Where a command looks for a daemon whose socket nobody named, in this order.

    As a part of a service (ExecReload=) at that of the service alone.
    """
    if environ.get("RUNTIME_DIRECTORY"):
        own = default_socket(environ)
        return [own] if own is not None else []
    session = _session_socket(environ)
    return [SYSTEM_SOCKET] if session is None else [session, SYSTEM_SOCKET]


def _session_socket(environ: Mapping[str, str]) -> Path | None:
    directory = environ.get("XDG_RUNTIME_DIR", "")
    return Path(directory, "gatewayd.sock") if directory.startswith("/") else None
