"""A headless Chromium, driven by the DevTools protocol over aiohttp's WebSocket: just what the page's tests need."""

# ruff: noqa: ASYNC240 - nothing else runs in a test's loop

from __future__ import annotations

import asyncio
import atexit
import base64
import json
import shutil
import subprocess
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import aiohttp

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
_OPTIONS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--no-pings",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.*",
    "--remote-debugging-port=0",
)
_PATIENCE = 20.0


class Page:
    """One tab."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self._socket = socket
        self._number = 0
        self.problems: list[str] = []
        """What the page's console and the browser's network and security checks complained about."""

    async def command(self, method: str, **parameters: object) -> Any:
        """Have the browser do something; its result."""
        self._number += 1
        await self._socket.send_json({"id": self._number, "method": method, "params": parameters})
        while True:
            message = await self._socket.receive_json(timeout=_PATIENCE)
            if message.get("id") == self._number:
                assert "error" not in message, message
                return message["result"]
            self._note(message)

    def _note(self, message: dict[str, Any]) -> None:
        parameters = message.get("params", {})
        if message["method"] == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.problems.append(str(details.get("exception", {}).get("description", details["text"])))
        elif message["method"] == "Log.entryAdded" and parameters["entry"]["level"] in ("warning", "error"):
            self.problems.append(f"{parameters['entry']['text']} {parameters['entry'].get('url', '')}")

    async def open(self, url: str, width: int, height: int, *, dark: bool = False, scale: float = 1) -> None:
        """Go there in a window of this size."""
        scheme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        await self.command("Emulation.setEmulatedMedia", features=scheme)
        await self.resize(width, height, scale)
        await self.command("Page.navigate", url=url)

    async def resize(self, width: int, height: int, scale: float = 1) -> None:
        await self.command(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=scale,
            mobile=width < 600,
        )

    async def run(self, script: str) -> Any:
        """The value of a JavaScript expression."""
        found = await self.command(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    async def wait(self, condition: str) -> None:
        """Return when the JavaScript expression is true; what it cannot evaluate yet is not."""
        start = time.monotonic()
        script = f"(() => {{ try {{ return Boolean({condition}); }} catch {{ return false; }} }})()"
        while not await self.run(script):
            assert time.monotonic() - start < _PATIENCE, f"waited in vain for {condition}; {self.problems}"
            await asyncio.sleep(0.05)

    async def wait_for(self, promise: str) -> None:
        """Return when what the JavaScript promise brings is true."""
        start = time.monotonic()
        while not await self.run(promise):
            assert time.monotonic() - start < _PATIENCE, f"waited in vain for {promise}; {self.problems}"
            await asyncio.sleep(0.05)

    async def press(self, key: str, code: int = 0) -> None:
        """One key, down and up."""
        text = {"text": key} if len(key) == 1 else {"text": "\r"} if key == "Enter" else {}
        for kind in ("keyDown", "keyUp"):
            await self.command(
                "Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code, **text
            )
            text = {}

    async def picture(self, path: Path, *, whole: bool = False) -> None:
        """A screenshot as PNG."""
        found = await self.command("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(found["data"]))


@asynccontextmanager
async def browsing() -> AsyncIterator[Page]:
    """A tab with an empty profile of its own, in the browser that all tests of this process share."""
    port = await _port(_browser())
    async with (
        aiohttp.ClientSession() as session,
        session.get(f"http://127.0.0.1:{port}/json/version") as response,
        session.ws_connect(json.loads(await response.text())["webSocketDebuggerUrl"]) as whole,
    ):
        browser = Page(whole)
        context = (await browser.command("Target.createBrowserContext"))["browserContextId"]
        target = await browser.command("Target.createTarget", url="about:blank", browserContextId=context)
        url = f"ws://127.0.0.1:{port}/devtools/page/{target['targetId']}"
        async with session.ws_connect(url, max_msg_size=0) as socket:
            page = Page(socket)
            for domain in ("Page", "Runtime", "Log"):
                await page.command(f"{domain}.enable")
            yield page
        await browser.command("Target.disposeBrowserContext", browserContextId=context)


@dataclass(frozen=True, slots=True)
class _Browser:
    process: subprocess.Popen[bytes]
    port_file: Path


@cache
def _browser() -> _Browser:
    """Starting one takes a second of a processor, so it is started once; gone with this process."""
    assert CHROMIUM is not None
    profile = Path(tempfile.mkdtemp(prefix="gatewayd-browser-"))
    process = subprocess.Popen(
        [CHROMIUM, *_OPTIONS, f"--user-data-dir={profile}", "about:blank"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    atexit.register(_end, process, profile)
    return _Browser(process, profile / "DevToolsActivePort")


def _end(process: subprocess.Popen[bytes], profile: Path) -> None:
    process.terminate()
    try:
        process.wait(5)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    shutil.rmtree(profile, ignore_errors=True)


async def _port(browser: _Browser) -> int:
    start, file = time.monotonic(), browser.port_file
    while not (file.exists() and file.read_text().count("\n")):
        assert browser.process.poll() is None, "Chromium ended"
        assert time.monotonic() - start < _PATIENCE, "Chromium does not begin"
        await asyncio.sleep(0.05)
    return int(file.read_text().splitlines()[0])
