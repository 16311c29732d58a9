"""`gatewayd demo` as a process: it ends by itself, ends cleanly on Ctrl-C, and says what it did."""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import socket
import subprocess
import sys
import time

import pytest

from gatewayd.demo.scene import HOST

DEMO = [sys.executable, "-m", "gatewayd", "demo"]
PATIENCE = 30


def test_ends_by_itself_with_success_and_plain_lines() -> None:
    done = subprocess.run(
        [*DEMO, "--seconds", "4", "--port", "0"],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "\x1b" not in done.stdout
    assert re.search(r"[1-9]\d* parts? ordered, [1-9]\d* parts? made", done.stdout)
    assert re.search(
        r"CANopen: [1-9]\d* heartbeats, [1-9]\d* PDOs received, [1-9]\d* sent, [1-9]", done.stdout
    )
    assert "mbpoll -0 -p " in done.stdout


def test_port_in_use_is_one_clear_line() -> None:
    with socket.create_server((HOST, 0)) as taken:
        port = str(taken.getsockname()[1])
        done = subprocess.run(
            [*DEMO, "--port", port], capture_output=True, text=True, check=False, timeout=PATIENCE
        )
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr == (
        f"gatewayd: cannot listen on port {port}: Address already in use; --port 0 takes a free one\n"
    )


def test_terminal_gets_a_live_table_and_ctrl_c_ends_it() -> None:
    main, side = pty.openpty()
    environment = os.environ | {"TERM": "xterm-256color", "COLUMNS": "100", "LINES": "30"}
    demo = subprocess.Popen([*DEMO, "--port", "0"], stdout=side, stderr=side, env=environment)
    os.close(side)
    seen, end = b"", time.monotonic() + PATIENCE
    interrupted = False
    while time.monotonic() < end:
        if select.select([main], [], [], 0.1)[0]:
            try:
                seen += os.read(main, 65536)
            except OSError:  # the terminal's other side is closed: the end
                break
        if not interrupted and b"plc took start" in seen:
            interrupted = True
            demo.send_signal(signal.SIGINT)
    try:
        assert demo.wait(PATIENCE) == 0
    finally:
        demo.kill()
        os.close(main)
    text = seen.decode()
    assert "input_bit_register_0" in text
    assert "\x1b[?1049h" not in text, "the alternate screen would take the result away"
    assert "packages from the robot" in text
    assert "Traceback" not in text


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_other_signals_end_it_in_order(number: int) -> None:
    demo = subprocess.Popen([*DEMO, "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert demo.stdout is not None
    while " good " not in demo.stdout.readline():
        assert demo.poll() is None
    demo.send_signal(number)
    output, errors = demo.communicate(timeout=PATIENCE)
    assert demo.returncode in (0, 1), "1: too early for a part to be made on both buses"
    assert errors == ""
    assert "packages from the robot" in output
