"""The control interface over HTTP (aiohttp): routes, limits, one form of error. The rest is `gatewayd.control.api`."""

from __future__ import annotations

import asyncio
import json
import logging
import pwd
import socket
import struct
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Generator, Mapping
from contextlib import asynccontextmanager, suppress
from functools import lru_cache, partial
from typing import Any

from aiohttp import web
from aiohttp.typedefs import Middleware

from gatewayd.control.access import Caller, Role, local_caller
from gatewayd.control.api import Api, ApiError, Cursor, Moment
from gatewayd.control.devices import devices_by_hand
from gatewayd.control.endpoint import Reload
from gatewayd.control.http_log import HttpLog
from gatewayd.control.packages import MAX_FEEDS, PackageFeeds
from gatewayd.control.trace import MAX_TRACES, Traces
from gatewayd.core.objection import ObjectionKind
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.loop.share import Busy, LoopShare, in_one_step
from gatewayd.loop.threads import in_daemon_thread
from gatewayd.report.printable import json_text

MAX_BODY = 64 * 1024
"""Bytes of a request's body."""
REQUESTS = 64
"""Requests under way at one time, those that follow events included."""
FOLLOWERS = 16
"""Requests that follow events at one time."""
ALIVE_PERIOD = 10.0
"""Seconds after which a follower gets an empty line where nothing happens."""
_FOLLOW_PERIOD = 0.1
MAX_ROWS = 2000
"""Passages of a trace that are sent at a time."""
_DAY = 24 * 3600
_BODY_TIME = 5.0
_WRITE_TIME = 30.0
"""Seconds for which a follower may leave what it asked for unread."""
_PEER_CREDENTIALS = struct.Struct("iII")
CALLER = web.RequestKey("CALLER", Caller)
"""In a request that came over the network: who asks, if its listener knows."""
CALLER_NOW: web.RequestKey[Callable[[], Caller | None]] = web.RequestKey("CALLER_NOW")
"""In such a request: who asks, and what it may do, at the moment of the call; None: its token counts no more.

For what takes time: a body that comes slowly, an answer without end.
"""
REFUSED: web.RequestKey[Callable[[str], None]] = web.RequestKey("REFUSED")
"""In such a request: to be called with the reason, a key of the listener's, for which it is refused here."""
GOT_ON: web.RequestKey[Callable[[], None]] = web.RequestKey("GOT_ON")
"""In such a request: to be called when the peer has taken a part of an answer without end."""
PEER = web.RequestKey("PEER", str)
"""In such a request: the address that it came from, which is a proxy's client's where there is a proxy."""

log = logging.getLogger("gatewayd.control")

_Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]
_Act = Callable[[str, Mapping[str, Any], Caller, Moment], Mapping[str, object]]
_Ask = Callable[[str, Mapping[str, Any], str], Awaitable[Mapping[str, object]]]
_Question = Callable[[Mapping[str, str], Moment], Generator[None, None, Mapping[str, object]]]


@asynccontextmanager
async def serving(listening: socket.socket, api: Api, reload: Reload | None) -> AsyncIterator[None]:
    """Serve on the socket while the context lasts."""
    served = application(api, reload)
    if api.traces is not None:
        served.router.add_get("/v1/trace", partial(_trace, api.traces, api.share))
    served.router.add_get("/v1/packages", partial(_packages, api.feeds, api.share))
    devices = devices_by_hand(api)
    served.router.add_post("/v1/devices/{name}/read", partial(_ask_device, api, devices.read))
    served.router.add_post("/v1/devices/{name}/write", partial(_ask_device, api, devices.write))
    served.middlewares.insert(0, _in_turn(api.share))
    runner = web.AppRunner(
        served, access_log=None, logger=HttpLog(log), handle_signals=False, shutdown_timeout=0.1
    )
    await runner.setup()
    try:
        await web.SockSite(runner, listening).start()
        yield
    finally:
        await runner.cleanup()


def application(api: Api, reload: Reload | None) -> web.Application:
    """The routes."""
    routes = _Routes(api, reload)
    found = web.Application(client_max_size=MAX_BODY, middlewares=[routes.guard])
    questions: dict[str, _Question] = {
        "version": lambda _query, _moment: in_one_step(api.version),
        "status": lambda _query, moment: api.status(moment),
        "variables": api.variables,
        "locks": api.locks,
        "audit": api.audit,
    }
    for name, question in questions.items():
        found.router.add_get(f"/v1/{name}", routes.answer(question))
    found.router.add_get("/v1/events", routes.events)
    acts: dict[str, tuple[_Act, Role]] = {
        "locks/{name}/take": (api.take, Role.OPERATOR),
        "locks/{name}/release": (api.release, Role.OPERATOR),
        "variables/{name}/force": (api.force, Role.ENGINEER),
        "variables/{name}/unforce": (api.unforce, Role.ENGINEER),
        "cells/{name}/hand-over": (api.hand_over, Role.ENGINEER),
    }
    for name, (act, role) in acts.items():
        found.router.add_post(f"/v1/{name}", routes.act(act, role))
    found.router.add_post("/v1/reload", routes.reload)
    return found


class _Routes:
    def __init__(self, api: Api, reload: Reload | None) -> None:
        self._api = api
        self._reload = reload
        self._under_way = 0
        self._followers = 0

    @web.middleware
    async def guard(self, request: web.Request, handler: _Handler) -> web.StreamResponse:
        """Bound what is under way, and give every error the same form."""
        if self._under_way >= REQUESTS:
            return _error(ApiError(503, "busy", f"{REQUESTS} requests are being answered already"))
        self._under_way += 1
        try:
            return await handler(request)
        except ApiError as error:
            return _error(error)
        except Busy:
            return _error(_BUSY)
        except web.HTTPException as error:
            return _error(_HTTP_ERRORS.get(error.status) or ApiError(error.status, "http", error.reason))
        except ConnectionError:
            raise
        except Exception:
            log.exception("a control request could not be answered", extra=fields(path=request.path))
            return _error(ApiError(500, "internal", "internal error, see the log"))
        finally:
            self._under_way -= 1

    def answer(self, question: _Question) -> _Handler:
        async def handle(request: web.Request) -> web.StreamResponse:
            return await self._answer(request, question)

        return handle

    async def _answer(self, request: web.Request, question: _Question) -> web.StreamResponse:
        query = dict(request.query)

        def work() -> Generator[None, None, str]:
            return (yield from _text_of((yield from question(query, _moment()))))

        subject = request.path, tuple(sorted(query.items()))
        return _response(await self._api.share.done_once(subject, asker(request), work))

    def act(self, act: _Act, role: Role) -> _Handler:
        async def handle(request: web.Request) -> web.StreamResponse:
            self._api.refuse_what_waited()
            body, caller = await _body(request), await _allowed(request, role)
            self._api.refuse_what_waited()
            return _json(act(request.match_info["name"], body, caller, _moment()))

        return handle

    async def reload(self, request: web.Request) -> web.StreamResponse:
        self._api.refuse_what_waited()
        body, caller = await _body(request), await _allowed(request, Role.ENGINEER)
        force, accept = body.get("force", False), _accepted(body.get("accept", []))
        if not isinstance(force, bool):
            raise ApiError(400, "bad_request", "`force` must be true or false")
        if self._reload is None:
            raise ApiError(501, "no_reload", "this gateway cannot reload: restart it")
        self._api.refuse_what_waited()
        kinds = ",".join(sorted(accept)) or None
        log.info("reload asked for", extra=fields(detail=caller.detail, force=force, accept=kinds))
        result = await self._reload(frozenset(ObjectionKind) if force else accept)
        return _json(dict(result.as_object()), 409 if result.exit_code else 200)

    async def events(self, request: web.Request) -> web.StreamResponse:
        follow = request.query.get("follow")
        if follow is None or follow in ("0", "false"):
            return await self._answer(request, self._api.events)
        if self._followers >= FOLLOWERS:
            raise ApiError(503, "busy", f"{FOLLOWERS} clients follow the events already")
        self._followers += 1
        try:
            cursor, limited = Cursor(), {"limit": "0"} | dict(request.query)

            def begin() -> Generator[None, None, str]:
                former = yield from self._api.events(limited, _moment())
                self._api.new_events(cursor, request.query, _moment())
                return "".join(map(_line, former["events"]))

            return await self._follow(request, cursor, await self._api.share.done(asker(request), begin()))
        finally:
            self._followers -= 1

    async def _follow(self, request: web.Request, cursor: Cursor, lines: str) -> web.StreamResponse:
        response = web.StreamResponse(
            headers={"Content-Type": "application/x-ndjson", "Cache-Control": "no-store"}
        )
        await response.prepare(request)
        sent_at = clock.now()

        def news() -> Generator[None, None, str]:
            found = []
            for event in self._api.new_events(cursor, request.query, _moment()):
                found.append(_line(event))
                yield
            return "".join(found)

        # A follower that is gone, or that leaves too much unread, gets nothing more.
        with suppress(ConnectionError, TimeoutError, Busy):
            while _is_current(request):
                if lines or clock.now() - sent_at >= ALIVE_PERIOD:
                    sent_at = clock.now()
                    async with asyncio.timeout(_WRITE_TIME):
                        await response.write(lines.encode() or b"\n")
                    request.get(GOT_ON, _nothing)()
                await asyncio.sleep(_FOLLOW_PERIOD)
                lines = ""
                if self._api.has_news(cursor, request.query):
                    lines = await self._api.share.done(asker(request), news())
        return response


async def _trace(traces: Traces, share: LoopShare, request: web.Request) -> web.StreamResponse:
    """What passes the links from now on, for `seconds` or until `count` passages were sent, then the totals."""
    query = request.query
    seconds, left = _number(query, "seconds", _DAY), _number(query, "count", _DAY)
    unknown = traces.unknown(query)
    if unknown:
        raise ApiError(404, "no_such_link", unknown)
    trace = traces.open(query)
    if trace is None:
        raise ApiError(503, "busy", f"{MAX_TRACES} traces are running already")
    response = web.StreamResponse(
        headers={"Content-Type": "application/x-ndjson", "Cache-Control": "no-store"}
    )
    try:
        await response.prepare(request)
        until, sent_at, dropped = clock.now() + seconds, clock.now(), 0
        with suppress(ConnectionError, TimeoutError):
            while left and clock.now() < until:
                await asyncio.sleep(min(_FOLLOW_PERIOD, max(0.0, until - clock.now())))
                traces.refresh()
                rows: list[Mapping[str, object]] = []
                with suppress(Busy):
                    work = trace.rows(min(left, MAX_ROWS), time.time() - clock.now())
                    rows += await share.done(asker(request), work)
                left -= len(rows)
                if trace.dropped != dropped:
                    dropped = trace.dropped
                    rows.append({"dropped": dropped})
                if rows or clock.now() - sent_at >= ALIVE_PERIOD:
                    sent_at = clock.now()
                    async with asyncio.timeout(_WRITE_TIME):
                        await response.write("".join(map(_line, rows)).encode() or b"\n")
            await response.write(_line({"passed": trace.passed, "dropped": trace.dropped}).encode())
    finally:
        traces.close(trace)
    return response


async def _ask_device(api: Api, ask: _Ask, request: web.Request) -> web.StreamResponse:
    """Read or write a place of a device, on the connection that the gateway has."""
    api.refuse_what_waited()
    body, caller = await _body(request), await _allowed(request, Role.ENGINEER)
    api.refuse_what_waited()
    return _json(await ask(request.match_info["name"], body, caller.detail))


async def _packages(feeds: PackageFeeds, share: LoopShare, request: web.Request) -> web.StreamResponse:
    """Every package of the robot of `cell` from now on."""
    try:
        cell = feeds.named(request.query.get("cell"))
    except ValueError as error:
        raise ApiError(404, "no_such_cell", str(error)) from None
    feed = feeds.open(cell)
    if feed is None:
        raise ApiError(503, "busy", f"{MAX_FEEDS} recordings are running already")
    response = web.StreamResponse(
        headers={"Content-Type": "application/x-ndjson", "Cache-Control": "no-store"}
    )
    try:
        await response.prepare(request)
        sent_at, dropped = clock.now(), 0

        def news() -> Generator[None, None, str]:
            ahead, lines = time.time() - clock.now(), []
            for row in (yield from feed.rows(ahead)):
                lines.append(_line(row))
                yield
            return "".join(lines)

        with suppress(ConnectionError, TimeoutError):
            while True:
                feeds.refresh()
                lines = ""
                # First what the packages lack: the oldest went.
                if feed.dropped != dropped:
                    dropped = feed.dropped
                    lines = _line({"dropped": dropped})
                with suppress(Busy):
                    lines += await share.done(asker(request), news())
                if lines or clock.now() - sent_at >= ALIVE_PERIOD:
                    sent_at = clock.now()
                    async with asyncio.timeout(_WRITE_TIME):
                        await response.write(lines.encode() or b"\n")
                await asyncio.sleep(_FOLLOW_PERIOD)
    finally:
        feeds.close(feed)
    return response


def _number(query: Mapping[str, str], name: str, default: int) -> int:
    text = query.get(name, str(default))
    if not (text.isascii() and text.isdigit()) or not 0 < len(text) <= 9 or not int(text):
        raise ApiError(400, "bad_query", f"`{name}` must be a whole number from 1 on")
    return int(text)


def _accepted(kinds: object) -> frozenset[ObjectionKind]:
    if isinstance(kinds, list) and all(kind in list(ObjectionKind) for kind in kinds):
        return frozenset(map(ObjectionKind, kinds))
    raise ApiError(400, "bad_request", f"`accept` must be a list of {', '.join(ObjectionKind)}")


_HTTP_ERRORS = {
    404: ApiError(404, "no_such_path", "there is nothing at this path"),
    405: ApiError(405, "wrong_method", "this path does not allow this method"),
    413: ApiError(413, "too_large", f"a request may have at most {MAX_BODY} bytes"),
}


_BUSY = ApiError(503, "busy", "too many requests at once: try again later, and less often")


def asker(request: web.Request) -> str:
    """Who gets turns: the address of a peer on the network; all that use the control socket are one."""
    return request.get(PEER) or request.remote or "control socket"


def _in_turn(share: LoopShare) -> Middleware:
    """Who asks waits for a turn. Who acts does not: it costs little, and somebody may need it now."""

    @web.middleware
    async def in_turn(request: web.Request, handler: _Handler) -> web.StreamResponse:
        if request.method != "POST":
            try:
                await share.request(asker(request))
            except Busy:
                return _error(_BUSY)
        return await handler(request)

    return in_turn


def _is_current(request: web.Request) -> bool:
    caller_now = request.get(CALLER_NOW)
    return caller_now is None or caller_now() is not None


def _nothing(_reason: str = "") -> None:
    pass


def _moment() -> Moment:
    return Moment(clock.now(), time.time())


def _line(event: Mapping[str, object]) -> str:
    return _compact(event) + "\n"


def _compact(value: object) -> str:
    return json_text(json.dumps(value, ensure_ascii=False, separators=(",", ":")))


def _text_of(answer: Mapping[str, object]) -> Generator[None, None, str]:
    """The same as `_line`, one element of its lists in each step."""
    members = []
    for name, value in answer.items():
        if isinstance(value, list):
            elements = []
            for element in value:
                elements.append(_compact(element))
                yield
            members.append(f'"{name}":[{",".join(elements)}]')
        else:
            members.append(f'"{name}":{_compact(value)}')
    return "{" + ",".join(members) + "}\n"


def _json(value: Mapping[str, object], status: int = 200) -> web.Response:
    return _response(_line(value), status)


def _response(text: str, status: int = 200) -> web.Response:
    headers = {"Cache-Control": "no-store"}
    return web.Response(text=text, status=status, content_type="application/json", headers=headers)


def _error(error: ApiError) -> web.Response:
    return _json(error.as_json(), error.status)


async def _body(request: web.Request) -> dict[str, Any]:
    """The JSON object that came with the request; none is an empty one."""
    try:
        async with asyncio.timeout(_BODY_TIME):
            text = await request.text()
    except TimeoutError:
        raise ApiError(408, "too_slow", f"the body did not arrive within {_BODY_TIME:g} s") from None
    except UnicodeDecodeError:
        raise ApiError(400, "bad_json", "the body is not UTF-8") from None
    except (LookupError, web.RequestPayloadError):
        raise ApiError(400, "bad_json", "the body is not encoded as its headers say") from None
    try:
        found = json.loads(text) if text.strip() else {}
    except (ValueError, RecursionError):
        raise ApiError(400, "bad_json", "the body is not JSON") from None
    if not isinstance(found, dict):
        raise ApiError(400, "bad_json", "the body must be a JSON object")
    return found


async def _allowed(request: web.Request, role: Role) -> Caller:
    """Who asks, if it has this role. Raises ApiError."""
    caller_now = request.get(CALLER_NOW)
    caller = await _user(request) if caller_now is None else caller_now()
    refused = request.get(REFUSED, _nothing)
    if caller is None:
        refused("expired_token")
        raise ApiError(401, "token", "the token was revoked or has expired since the request began")
    if caller.role < role:
        refused("role")
        log.warning("refused for lack of the role", extra=fields(detail=caller.detail, path=request.path))
        lack = caller.reduced or f"{caller.holder.title} is {caller.role.title}"
        raise ApiError(403, "role", f"this needs the role {role.title}; {lack}")
    return caller


async def _user(request: web.Request) -> Caller:
    """The user at the other end of the control socket, as the kernel knows it."""
    sock = request.transport.get_extra_info("socket") if request.transport is not None else None
    if sock is None or sock.family != socket.AF_UNIX:
        raise ApiError(403, "role", "nobody is known to ask for this")
    raw = sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _PEER_CREDENTIALS.size)
    _pid, user, _group = _PEER_CREDENTIALS.unpack(raw)
    # The user database may be on the network, and asyncio's own threads would be waited for at the gateway's end.
    return local_caller(await in_daemon_thread(lambda: _user_name(user), "user name"))


@lru_cache(maxsize=32)
def _user_name(user: int) -> str:
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return f"user {user}"
