"""The status listener: HTTP on one TCP address, by aiohttp. Everything it can be asked is a line in `_routes`.

It is imported only where it is configured, and only after serving has begun: aiohttp alone takes 0.2 s to import.
"""

from __future__ import annotations

import asyncio
import gzip
import logging
from collections.abc import Awaitable, Callable, Generator
from contextlib import suppress
from importlib.resources import files
from typing import TypeVar

from aiohttp import web

from gatewayd import __version__
from gatewayd.control.access import Caller
from gatewayd.control.api import Api
from gatewayd.control.endpoint import Reload
from gatewayd.control.http_log import HttpLog
from gatewayd.control.server import CALLER, application, asker
from gatewayd.loop import clock
from gatewayd.loop.share import LoopShare, in_one_step
from gatewayd.loop.threads import in_daemon_thread
from gatewayd.mapping.plan import Plan
from gatewayd.service.cell_runtime import CellRuntime
from gatewayd.web import view
from gatewayd.web.access_control import AccessControl
from gatewayd.web.doors import MAX_CONNECTIONS, Doors
from gatewayd.web.guard import MAX_BODY, Guard, middleware
from gatewayd.web.health import health
from gatewayd.web.metrics import CONTENT_TYPE, Exposition
from gatewayd.web.probes import Probes

PAGE = {
    "/": ("index.html", "text/html"),
    "/style.css": ("style.css", "text/css"),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
    "/app.js": ("app.js", "text/javascript"),
    "/cells.js": ("cells.js", "text/javascript"),
    "/picture.js": ("picture.js", "text/javascript"),
    "/variables.js": ("variables.js", "text/javascript"),
    "/operate.js": ("operate.js", "text/javascript"),
    "/session.js": ("session.js", "text/javascript"),
    "/facts.js": ("facts.js", "text/javascript"),
    "/groups.js": ("groups.js", "text/javascript"),
    "/history.js": ("history.js", "text/javascript"),
    "/words.js": ("words.js", "text/javascript"),
}
"""Path -> file of gatewayd/web/page and its type. All of it is read once."""
_WORTH_PACKING = 2048
_CLOSING_TIME = 0.5

_Result = TypeVar("_Result")

log = logging.getLogger("gatewayd.status")

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class StatusListener:
    """Answers where `access` says (port 0: any free one), and whom it knows, about the daemon that `probes` measures.

    With `api` the control interface is under /api as well.
    """

    def __init__(
        self,
        access: AccessControl,
        probes: Probes,
        api: tuple[Api, Reload | None] | None = None,
    ) -> None:
        self._access = access
        self._host, self._port = access.settings.host, access.settings.port
        self._probes = probes
        self._exposition = Exposition(probes, __version__, access)
        self._has_api = api is not None
        self._doors: Doors | None = None
        self._share = api[0].share if api is not None else LoopShare()
        self._layouts: dict[str, tuple[Plan, bytes]] = {}
        guarded = middleware(Guard(access, PAGE), lambda: self._doors, self._share)
        self._app = web.Application(middlewares=[guarded], client_max_size=MAX_BODY)
        self._app.add_routes(self._routes())
        if api is not None:
            self._app.add_subapp("/api", application(*api))
        self._runner: web.AppRunner | None = None
        self._server: asyncio.Server | None = None
        self._sweeper: asyncio.Task[None] | None = None

    @property
    def port(self) -> int:
        """The port that is listened on."""
        return int(self._server.sockets[0].getsockname()[1]) if self._server is not None else self._port

    async def start(self) -> None:
        """Listen. Raises OSError."""
        runner = web.AppRunner(
            self._app,
            access_log=None,
            logger=HttpLog(log, self._malformed),
            keepalive_timeout=15.0,
            handle_signals=False,
            lingering_time=1.0,
        )
        await runner.setup()
        assert runner.server is not None
        doors = Doors(runner.server, self._access, self._share)
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(doors, self._host, self._port, backlog=MAX_CONNECTIONS)
        self._doors, self._runner = doors, runner
        self._sweeper = loop.create_task(doors.sweep())

    def _malformed(self) -> None:
        self._access.refused["malformed"] += 1

    async def close(self) -> None:
        """Stop listening and end all connections."""
        if self._server is not None:
            self._server.close()
        if self._doors is not None:
            self._doors.close()
        if self._sweeper is not None:
            self._sweeper.cancel()
        if self._runner is not None:
            with suppress(TimeoutError):
                async with asyncio.timeout(_CLOSING_TIME):
                    await self._runner.cleanup()

    # -- what can be asked ------------------------------------------------------------------------------------------

    def _routes(self) -> list[web.RouteDef]:
        return [
            *(web.get(path, _file(*file)) for path, file in PAGE.items()),
            web.get("/healthz", self._healthz),
            web.get("/readyz", self._readyz),
            web.get("/metrics", self._metrics),
            web.get("/page/session", self._session),
            web.get("/page/cells", self._overview),
            web.get("/page/cells/{cell}", self._layout),
            web.get("/page/cells/{cell}/state", self._state),
            web.get("/page/cells/{cell}/history", self._history),
        ]

    def _is_known(self, request: web.Request) -> bool:
        """Whether the one who asks may read; the paths that are free tell others no more than they have to."""
        return self._access.settings.is_local or CALLER in request

    async def _healthz(self, request: web.Request) -> web.Response:
        healthy, answer = health(self._probes.late)
        shown = answer if self._is_known(request) else {"healthy": healthy}
        return _json(shown, status=200 if healthy else 503)

    async def _readyz(self, request: web.Request) -> web.Response:
        ready, answer = await self._done(request, lambda: self._probes.readiness(clock.now()))
        shown = answer if self._is_known(request) else {"ready": ready}
        return _json(shown, status=200 if ready else 503)

    async def _session(self, request: web.Request) -> web.Response:
        """Who asks, for the page: what to offer, and whose name to show. Never shared with another one's answer."""
        caller = request.get(CALLER)
        signs_in = self._access.credentials is not None and self._has_api
        return _json({"tokens": signs_in, "caller": None if caller is None else _caller(caller)})

    async def _metrics(self, request: web.Request) -> web.Response:
        body = await self._share.done_once("/metrics", asker(request), self._exposition.text)
        return await _packed(request, body, {"Content-Type": CONTENT_TYPE})

    async def _overview(self, request: web.Request) -> web.Response:
        body = await self._done(request, self._overview_now)
        return web.Response(body=body, content_type="application/json")

    def _overview_now(self) -> bytes:
        return view.as_json(view.overview(self._probes, __version__, clock.now()))

    async def _layout(self, request: web.Request) -> web.Response:
        body = await self._done(request, lambda: self._layout_of(self._runtime(request)))
        return await _packed(request, body, {"Content-Type": "application/json"})

    def _layout_of(self, runtime: CellRuntime) -> bytes:
        """Made once for each mapping: for a thousand variables it takes as long as many answers."""
        name = runtime.cell.definition.name
        plan, body = self._layouts.get(name, (None, b""))
        if plan is not runtime.plan:
            body = view.as_json(view.layout(runtime))
            self._layouts[name] = runtime.plan, body
        return body

    async def _state(self, request: web.Request) -> web.Response:
        text = request.query.get("since", "0")
        since = int(text) if text.isascii() and text.isdigit() and len(text) < 16 else 0

        def state() -> bytes:
            return view.as_json(view.state(self._runtime(request), self._probes, since, clock.now()))

        return web.Response(body=await self._done(request, state, since), content_type="application/json")

    async def _history(self, request: web.Request) -> web.Response:
        def history() -> Generator[None, None, bytes]:
            return view.past(self._runtime(request), self._probes, clock.now())

        body = await self._share.done_once(request.path, asker(request), history)
        return await _packed(request, body, {"Content-Type": "application/json"})

    async def _done(self, request: web.Request, work: Callable[[], _Result], what: object = None) -> _Result:
        """The result of a short work, in its turn, once for all who ask for the same meanwhile."""
        subject = request.path, what
        return await self._share.done_once(subject, asker(request), lambda: in_one_step(work))

    def _runtime(self, request: web.Request) -> CellRuntime:
        name = request.match_info["cell"]
        for runtime in self._probes.daemon.runtimes:
            if runtime.cell.definition.name == name:
                return runtime
        raise web.HTTPNotFound(reason="there is no such cell")


def _caller(caller: Caller) -> dict[str, object]:
    return {
        "name": caller.holder.name,
        "role": caller.role.title,
        "level": int(caller.role),
        "expires": caller.expires,
    }


def _json(document: object, status: int = 200) -> web.Response:
    return web.Response(body=view.as_json(document), status=status, content_type="application/json")


async def _packed(request: web.Request, body: bytes, headers: dict[str, str]) -> web.Response:
    """What is large and seldom asked for is packed for those who can unpack it, by a thread."""
    if len(body) >= _WORTH_PACKING and "gzip" in request.headers.get("Accept-Encoding", ""):
        body = await in_daemon_thread(lambda: gzip.compress(body, 1), "packing")
        headers = {**headers, "Content-Encoding": "gzip"}
    return web.Response(body=body, headers=headers)


def _file(name: str, content_type: str) -> Handler:
    body = files("gatewayd.web").joinpath("page", name).read_bytes()
    headers = {"Content-Type": f"{content_type}; charset=utf-8", "Cache-Control": "no-cache"}

    async def handle(request: web.Request) -> web.Response:
        return await _packed(request, body, headers)

    return handle
