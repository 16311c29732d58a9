"""What can be asked over HTTP, and that the page needs nothing from elsewhere."""

from __future__ import annotations

import json
import re
from collections.abc import AsyncIterator
from importlib.resources import files
from typing import Any

import aiohttp
import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR
from gatewayd.web.listener import PAGE, StatusListener
from gatewayd.web.metrics import CONTENT_TYPE
from tests.web.press import SPARE, TOKEN


@pytest.fixture
async def session(listener: StatusListener) -> AsyncIterator[aiohttp.ClientSession]:
    async with aiohttp.ClientSession(f"http://127.0.0.1:{listener.port}") as found:
        yield found


async def get(session: aiohttp.ClientSession, path: str) -> tuple[int, Any]:
    async with session.get(path) as response:
        return response.status, json.loads(await response.text())


async def test_health_and_readiness(session: aiohttp.ClientSession) -> None:
    assert await get(session, "/healthz") == (200, {"healthy": True, "reasons": []})
    status, told = await get(session, "/readyz")
    assert (status, told["reasons"]) == (503, ["not listening on 127.0.0.1:15020"])
    assert told["cells"] == {"press": {"ready": True, "reasons": []}}


async def test_metrics_are_text_that_prometheus_takes(session: aiohttp.ClientSession) -> None:
    async with session.get("/metrics", headers={"Accept-Encoding": "identity"}) as response:
        assert response.headers["Content-Type"] == CONTENT_TYPE
        assert 'gatewayd_robot_up{cell="press"} 1.0' in await response.text()
    async with session.get("/metrics", headers={"Accept-Encoding": "gzip"}) as response:
        assert response.headers["Content-Encoding"] == "gzip"
        assert 'gatewayd_robot_up{cell="press"} 1.0' in await response.text()


async def test_the_pages_own_view(session: aiohttp.ClientSession) -> None:
    status, found = await get(session, "/page/cells")
    assert (status, found["cells"][0]["name"]) == (200, "press")
    assert (await get(session, "/page/cells/press"))[1]["variables"][0]["name"] == "start"
    for since in ("0", "7", "-1", "x", "9" * 500):
        status, found = await get(session, f"/page/cells/press/state?since={since}")
        assert (status, len(found["values"])) == (200, 10)
    async with session.get("/page/cells/nobody/state") as response:
        assert (response.status, await response.text()) == (404, "there is no such cell\n")


async def test_the_control_interface_is_there_too(session: aiohttp.ClientSession, cell: Cell) -> None:
    assert (await get(session, "/api/v1/status"))[1]["cells"][0]["name"] == "press"
    headers = {"Authorization": f"Bearer {TOKEN}"}
    async with session.post("/api/v1/locks/spare/take", headers=headers, json={"for": 5}) as response:
        assert (response.status, (await response.json())["owner"]) == (200, "operator")
    assert cell.ownership.owners[cell.definition.variables[SPARE].lock or 0] == OPERATOR
    async with session.post("/api/v1/locks/nothing/take", headers=headers) as response:
        assert (response.status, (await response.json())["error"]["code"]) == (404, "no_such_lock")


@pytest.mark.parametrize("path", PAGE)
async def test_every_file_of_the_page_is_served(session: aiohttp.ClientSession, path: str) -> None:
    name, content_type = PAGE[path]
    async with session.get(path) as response:
        assert response.content_type == content_type
        assert await response.read() == files("gatewayd.web").joinpath("page", name).read_bytes()


def test_nothing_lies_about_that_is_not_served() -> None:
    there = {one.name for one in files("gatewayd.web").joinpath("page").iterdir()}
    assert there == {name for name, _ in PAGE.values()}


@pytest.mark.parametrize("path", PAGE)
def test_the_page_asks_nobody_else_and_has_nothing_inline(path: str) -> None:
    """No foreign address; no script, style or handler that the content security policy would stop."""
    text = files("gatewayd.web").joinpath("page", PAGE[path][0]).read_text()
    foreign = [url for url in re.findall(r"(?:https?:)?//[\w.-]+\.\w+", text) if "www.w3.org" not in url]
    assert not foreign
    assert not re.search(r"<style|<script(?! type=\"module\" src)|\sstyle=|\son\w+=|innerHTML|\beval\(", text)


def test_files_of_the_page_are_short() -> None:
    for name, _ in PAGE.values():
        assert len(files("gatewayd.web").joinpath("page", name).read_text().splitlines()) <= 260, name
