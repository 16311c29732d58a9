"""Every route of the status listener, for everybody who may ask, on every kind of address: one table."""

from __future__ import annotations

import ssl
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

import aiohttp
import pytest
from aiohttp import web

from gatewayd.audit.trail import Audit
from gatewayd.control.access import Role
from gatewayd.control.api import Api
from gatewayd.service.daemon import Daemon
from gatewayd.web import throttle
from gatewayd.web.access_control import AccessControl
from gatewayd.web.guard import FREE
from gatewayd.web.listener import PAGE, StatusListener
from gatewayd.web.probes import Probes
from gatewayd.web.settings import Settings, settings
from tests.machine.authority import OPENSSL, Authority
from tests.web.press import token, write_tokens

pytestmark = pytest.mark.skipif(OPENSSL is None, reason="openssl is not installed")

NEEDED = {
    "/api/v1/locks/{name}/take": Role.OPERATOR,
    "/api/v1/locks/{name}/release": Role.OPERATOR,
    "/api/v1/variables/{name}/force": Role.ENGINEER,
    "/api/v1/variables/{name}/unforce": Role.ENGINEER,
    "/api/v1/cells/{name}/hand-over": Role.ENGINEER,
    "/api/v1/reload": Role.ENGINEER,
}
"""What each act needs. All else is reading, which needs a viewer beyond loopback and nobody on it."""
NOBODY, WRONG, EXPIRED = "no token", "a wrong token", "an expired token"
CALLERS: dict[str, Role | None] = {
    NOBODY: None,
    WRONG: None,
    EXPIRED: None,
    **{role.title: role for role in Role},
}
KINDS = ("loopback", "loopback without tokens", "network", "proxy")


def expected(kind: str, method: str, path: str, caller: str) -> int | None:
    """The status of a refusal; None: let through."""
    role = CALLERS[caller]
    if kind == "loopback without tokens":
        return 403 if method == "POST" else None
    if method == "POST":
        if role is None:
            return 401
        return 403 if role < NEEDED[path] else None
    if role is not None:
        return None
    is_free = kind == "loopback" or path in PAGE or path in FREE
    return None if caller == NOBODY and is_free else 401


@pytest.fixture(autouse=True)
def _without_delay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(throttle, "FIRST_DELAY", 0.0)


def options(kind: str, tokens: Path, authority: Authority) -> Settings:
    if kind == "network":
        return settings("0.0.0.0:0", tokens, *authority.issue("gateway", "subjectAltName=IP:127.0.0.1"))
    if kind == "proxy":
        return settings("127.0.0.1:0", tokens, proxy="127.0.0.1")
    return settings("127.0.0.1:0", tokens if kind == "loopback" else None)


@asynccontextmanager
async def asking(
    kind: str, directory: Path, daemon: Daemon, probes: Probes
) -> AsyncIterator[tuple[StatusListener, aiohttp.ClientSession]]:
    authority = Authority(directory)
    old = token(EXPIRED.replace(" ", "-"), Role.ENGINEER, EXPIRED, -5.0)
    tokens = write_tokens(directory / "tokens", old, *(token(role.title, role, role.title) for role in Role))
    access = AccessControl(options(kind, tokens, authority), lambda: daemon.cells)
    access.refresh()
    listener = StatusListener(access, probes, (Api(daemon, Audit()), None))
    await listener.start()
    async with AsyncExitStack() as stack:
        stack.push_async_callback(listener.close)
        tls = ssl.create_default_context(cafile=str(authority.certificate)) if kind == "network" else False
        scheme = "https" if kind == "network" else "http"
        session = aiohttp.ClientSession(
            f"{scheme}://127.0.0.1:{listener.port}", connector=aiohttp.TCPConnector(ssl=tls)
        )
        yield listener, await stack.enter_async_context(session)


def routes(application: web.Application) -> Iterator[tuple[str, str]]:
    """Methods and paths, those of applications below it included."""
    for route in application.router.routes():
        assert route.resource is not None
        yield route.method, route.resource.canonical


def concrete(path: str) -> str:
    name = "press" if "/cells/" in path else "spare" if "/locks/" in path else "cycles"
    return path.replace("{cell}", "press").replace("{name}", name)


@pytest.mark.parametrize("kind", KINDS)
async def test_who_may_ask_for_what(kind: str, tmp_path: Path, daemon: Daemon, probes: Probes) -> None:
    async with asking(kind, tmp_path, daemon, probes) as (listener, session):
        found = set(routes(listener._app))
        assert {path for method, path in found if method == "POST"} == set(NEEDED)
        assert {method for method, _path in found} == {"GET", "HEAD", "POST"}
        for method, path in sorted(found):
            for caller in CALLERS:
                given = {} if caller == NOBODY else {"Authorization": f"Bearer {caller}"}
                async with session.request(method, concrete(path), headers=given) as response:
                    text = await response.text()
                refused = response.status if response.status in (401, 403) else None
                assert refused == expected(kind, method, path, caller), (method, path, caller, text)
