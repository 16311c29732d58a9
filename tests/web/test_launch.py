"""The status listener comes up beside a daemon without holding it up."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import aiohttp
import pytest

from gatewayd.service.daemon import Daemon
from gatewayd.web.access_control import AccessControl
from gatewayd.web.launch import serve
from gatewayd.web.settings import settings
from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, free_port
from tests.web.press import TOKEN


async def test_an_address_in_use_is_said_once_and_tried_again(
    daemon: Daemon, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("gatewayd.web.launch.RETRY_PERIOD", 0.02)
    monkeypatch.setattr(Daemon, "progress", lambda _self: {"core": 1})
    port = free_port()
    caplog.set_level("INFO")
    squatter = await asyncio.start_server(lambda _r, _w: None, HOST, port)
    serving = asyncio.create_task(serve(AccessControl(settings(f"{HOST}:{port}")), daemon))
    try:
        await _said(caplog, "cannot listen")
        await asyncio.sleep(0.1)
        squatter.close()
        await squatter.wait_closed()
        await _said(caplog, "status page")
        assert caplog.text.count("cannot listen") == 1
        async with aiohttp.ClientSession() as session, session.get(f"http://{HOST}:{port}/healthz") as found:
            assert found.status == 200
    finally:
        serving.cancel()
        with suppress(asyncio.CancelledError):
            await serving


async def _said(caplog: pytest.LogCaptureFixture, words: str) -> None:
    async with asyncio.timeout(10):
        while words not in caplog.text:  # noqa: ASYNC110 - a log has no event to wait for
            await asyncio.sleep(0.02)


async def test_the_daemon_answers_and_obeys_the_token(tmp_path: Path, token_file: Path) -> None:
    """From the command line to a reload over the network, without a robot."""
    plant, port = Plant(tmp_path), free_port()
    try:
        mapping = plant.mapping("variables: {cycles: {robot: output_int_register_0, modbus: 0}}\n", 1)
        options = ("--status", f"{HOST}:{port}", "--token-file", token_file)
        daemon = plant.daemon(mapping, *options)
        daemon.wait_for_line("status page")
        async with aiohttp.ClientSession(f"http://{HOST}:{port}") as session:
            async with session.get("/readyz") as response:
                assert response.status == 503
                assert "robot not connected" in await response.text()
            async with session.post("/api/v1/reload") as response:
                assert response.status == 401
            headers = {"Authorization": f"Bearer {TOKEN}"}
            async with session.post("/api/v1/reload", headers=headers) as response:
                assert response.status == 200, await response.text()
        daemon.wait_for_line("reload asked for", "by token anna from 127.0.0.1")
        code, seconds = daemon.stop()
        assert code == 0
        assert seconds < 3
    finally:
        plant.stop()


def test_nothing_of_it_is_imported_unless_asked_for() -> None:
    """The daemon, and even the options of the status listener, do without aiohttp and prometheus-client."""
    script = (
        "import sys, gatewayd.cli.run, gatewayd.service.daemon, gatewayd.web.launch;"
        "print([name for name in ('aiohttp', 'prometheus_client') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_wrong_option_is_wrong_usage(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "gatewayd", "run", "--status", "nonsense", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "127.0.0.1:9502" in done.stderr
    assert "Traceback" not in done.stderr
