"""Stands for systemd: `supervisor NAME DIRECTORY MAPPING` runs a gateway, kills it if its watchdog goes unfed for 2 s
(WatchdogSec), withdraws the address whatever ends it (ExecStopPost, systemd/examples/standby.conf), and starts it
again.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

WATCHDOG = 2.0


def main(name: str, directory: Path, mapping: Path) -> None:
    """Run until killed. A file `hold-NAME` keeps it from starting again."""
    run = directory / name
    run.mkdir(exist_ok=True)
    notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    notify.bind(str(run / "notify"))
    notify.settimeout(0.05)
    surroundings = {
        **os.environ,
        "NOTIFY_SOCKET": str(run / "notify"),
        "WATCHDOG_USEC": str(int(WATCHDOG * 1e6)),
        "RUNTIME_DIRECTORY": str(run),
    }
    command = [sys.executable, "-m", "gatewayd", "run", str(mapping), "--control", str(run / "control.sock")]
    while True:
        if (directory / f"hold-{name}").exists():
            time.sleep(0.05)
            continue
        with (directory / f"{name}.log").open("ab") as log:
            gateway = subprocess.Popen(
                [*command, "--state", str(run / "state")], stderr=log, env=surroundings
            )
        (run / "pid").write_text(str(gateway.pid))
        fed, ready = time.monotonic(), False
        while gateway.poll() is None:
            try:
                said = notify.recv(4096)
            except TimeoutError:
                said = b""
            ready |= b"READY=1" in said
            if b"WATCHDOG=1" in said or not ready:
                fed = time.monotonic()
            if time.monotonic() - fed > WATCHDOG:
                gateway.send_signal(signal.SIGKILL)
                gateway.wait()
        for file in run.glob("standby-*"):
            if file.suffix != ".alive":
                file.write_text("1\n")
        time.sleep(0.25)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]))
