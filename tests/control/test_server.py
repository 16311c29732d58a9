"""The interface over a real socket: routes, one form of error, limits, and followers."""

from __future__ import annotations

import asyncio
import getpass
import json
import socket
import struct
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from gatewayd.audit.trail import Audit
from gatewayd.control import server
from gatewayd.control.api import Api
from gatewayd.control.client import Client, ControlError
from gatewayd.control.endpoint import bind
from gatewayd.control.packages import MAX_FEEDS
from gatewayd.core.objection import ObjectionKind
from gatewayd.links.contract import PackageLayout, PackageTap
from gatewayd.loop.share import Busy, LoopShare
from tests.control.served import CYCLES, LIMIT, FixedGateway, Served


@dataclass
class Outcome:
    exit_code: int

    def as_object(self) -> dict[str, object]:
        return {"result": "applied" if not self.exit_code else "refused"}


@pytest.fixture
def asked() -> list[frozenset[ObjectionKind]]:
    return []


@pytest.fixture
async def path(tmp_path: Path, api: Api, asked: list[frozenset[ObjectionKind]]) -> AsyncIterator[Path]:
    async def reload(accept: frozenset[ObjectionKind]) -> Outcome:
        asked.append(accept)
        return Outcome(0 if accept else 1)

    found = tmp_path / "control.sock"
    async with server.serving(bind(found), api, reload):
        yield found


@pytest.fixture
def client(path: Path) -> Client:
    return Client(path)


@pytest.mark.parametrize(
    "path_of_it, body",
    [
        ("/v1/variables/limit/force", {"value": 9, "for": 5}),
        ("/v1/variables/limit/unforce", {}),
        ("/v1/locks/motion/take", {}),
        ("/v1/locks/motion/release", {}),
        ("/v1/reload", {"force": True}),
    ],
)
async def test_what_waited_while_the_gateway_stood_still_is_not_carried_out(  # noqa: PLR0917 - fixtures
    gateway: FixedGateway,
    press: Served,
    audit: Audit,
    tmp_path: Path,
    path_of_it: str,
    body: dict[str, object],
) -> None:
    stood_still = 4.8
    reloaded: list[frozenset[ObjectionKind]] = []

    async def reload(accept: frozenset[ObjectionKind]) -> Outcome:
        reloaded.append(accept)
        return Outcome(0)

    press.cell.operator.take_lock(1, 0.0, 1e9, "by anna")
    press.cell.operator.force(LIMIT, 3.0, 0.0, 1e9, "by anna")
    owners, events = list(press.cell.ownership.owners), press.cell.events.count
    found = tmp_path / "late.sock"
    async with server.serving(bind(found), Api(gateway, audit, stood_still=lambda: stood_still), reload):
        client = Client(found)
        with pytest.raises(
            ControlError, match=r"^the gateway stood still for 4\.8 s; repeat the command$"
        ) as caught:
            await asyncio.to_thread(client.post, path_of_it, body)
        assert (caught.value.status, caught.value.code) == (503, "stood_still")
        assert (press.cell.ownership.owners, press.cell.events.count, reloaded) == (owners, events, [])
        assert (await get(client, "/v1/status"))["cells"], "questions are answered"
        stood_still = 0.5
        if path_of_it == "/v1/reload":
            await asyncio.to_thread(client.post, path_of_it, body)
            assert reloaded == [frozenset(ObjectionKind)]


async def get(client: Client, path: str, **query: Any) -> dict[str, Any]:
    return await asyncio.to_thread(lambda: client.get(path, **query))


async def raw(path: Path, request: bytes) -> bytes:
    reader, writer = await asyncio.open_unix_connection(path)
    writer.write(request)
    answer = await asyncio.wait_for(reader.read(65536), 10)
    writer.close()
    return answer


async def refused(act: Callable[[], object]) -> tuple[int, str]:
    with pytest.raises(ControlError) as caught:
        await asyncio.to_thread(act)
    return caught.value.status, caught.value.code


@pytest.mark.parametrize("route", ["status", "variables", "locks", "events", "audit", "version"])
async def test_every_question_has_an_answer(client: Client, route: str) -> None:
    assert await get(client, f"/v1/{route}")


async def test_questions_wait_for_their_turn_and_acts_do_not(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def full(*_arguments: object) -> None:
        raise Busy

    monkeypatch.setattr(LoopShare, "request", full)
    for route in ("status", "variables", "locks", "events", "audit", "version"):
        assert await refused(lambda route=route: client.get(f"/v1/{route}")) == (503, "busy")  # type: ignore[misc]
    assert await asyncio.to_thread(client.post, "/v1/variables/cycles/force", {"value": 7, "for": 5})


async def test_a_force_says_who_did_it(client: Client, press: Served) -> None:
    body = {"value": 7, "for": 5}
    found = await asyncio.to_thread(client.post, "/v1/variables/cycles/force", body)
    assert (found["value"], press.cell.image.values[CYCLES]) == (7, 7)
    assert [event.detail for event in press.cell.events][-1] == f"by {getpass.getuser()}"


async def test_names_with_brackets_are_one_segment(client: Client) -> None:
    body = {"value": 0.5, "for": 5}
    found = await asyncio.to_thread(client.post, "/v1/variables/tcp%5B2%5D/force", body)
    assert found["name"] == "tcp[2]"


async def test_errors_have_one_form(client: Client) -> None:
    assert await refused(lambda: client.get("/v1/nothing")) == (404, "no_such_path")
    assert await refused(lambda: client.post("/v1/status")) == (405, "wrong_method")
    assert await refused(lambda: client.post("/v1/locks/cycles/take")) == (404, "no_such_lock")
    assert await refused(lambda: client.get("/v1/events", limit="x")) == (400, "bad_query")


@pytest.mark.parametrize(
    "body, code",
    [(b"{", "bad_json"), (b"[1]", "bad_json"), (b"\xff\xfe", "bad_json"), (b"[" * 50_000, "bad_json")],
    ids=["cut", "list", "no text", "deep"],
)
async def test_a_body_that_is_no_object(path: Path, body: bytes, code: str) -> None:
    head = f"POST /v1/reload HTTP/1.1\r\nHost: x\r\nConnection: close\r\nContent-Length: {len(body)}\r\n\r\n"
    answer = await raw(path, head.encode() + body)
    assert answer.startswith(b"HTTP/1.1 400")
    assert json.loads(answer.partition(b"\r\n\r\n")[2])["error"]["code"] == code


async def test_a_body_is_bounded(client: Client) -> None:
    body = {"x": "y" * server.MAX_BODY}
    assert await refused(lambda: client.post("/v1/reload", body)) == (413, "too_large")


async def test_a_defect_shows_no_traceback(
    client: Client, api: Api, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(_moment: object) -> None:
        raise RuntimeError("secret")

    monkeypatch.setattr(api, "status", broken)
    with pytest.raises(ControlError, match="internal error, see the log") as caught:
        await get(client, "/v1/status")
    assert "secret" not in json.dumps(caught.value.body)
    assert caplog.records[-1].exc_info


async def test_garbage_does_not_end_the_server(path: Path, client: Client) -> None:
    await raw(path, b"\x16\x03\x01\x00\xa5 no http at all\r\n\r\n")
    assert await get(client, "/v1/version")


async def test_a_reload_is_handed_on(client: Client, asked: list[frozenset[ObjectionKind]]) -> None:
    assert await asyncio.to_thread(client.post, "/v1/reload", {"force": True}) == {"result": "applied"}
    with pytest.raises(ControlError) as caught:
        await asyncio.to_thread(client.post, "/v1/reload")
    assert (caught.value.status, caught.value.body) == (409, {"result": "refused"})
    accepted: dict[str, object] = {"accept": ["weakening"]}
    assert await asyncio.to_thread(client.post, "/v1/reload", accepted) == {"result": "applied"}
    assert asked == [frozenset(ObjectionKind), frozenset(), {ObjectionKind.WEAKENING}]
    bodies: tuple[dict[str, object], ...] = (
        {"force": "yes"},
        {"accept": ["nothing"]},
        {"accept": "left"},
        {"accept": [1]},
    )
    for body in bodies:
        assert await refused(partial(client.post, "/v1/reload", body)) == (400, "bad_request")


async def test_a_gateway_that_cannot_reload_says_so(tmp_path: Path, api: Api) -> None:
    found = tmp_path / "other.sock"
    async with server.serving(bind(found), api, None):
        assert await refused(lambda: Client(found).post("/v1/reload")) == (501, "no_reload")


class TestFollowing:
    async def test_former_events_then_new_ones_as_they_come(self, client: Client, press: Served) -> None:
        follower = client.follow("/v1/events", follow=1, limit=2)
        former = [(await asyncio.to_thread(next, follower))["event"] for _ in range(2)]
        assert len(former) == 2
        press.cell.robot_lost("gone", 1.0)
        assert (await asyncio.to_thread(next, follower))["event"] == "robot lost"
        follower.close()

    async def test_a_quiet_follower_gets_a_sign_of_life(
        self, path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(server, "ALIVE_PERIOD", 0.05)
        reader, writer = await asyncio.open_unix_connection(path)
        writer.write(b"GET /v1/events?follow=1 HTTP/1.1\r\nHost: x\r\n\r\n")
        assert (await reader.readuntil(b"\r\n\r\n")).startswith(b"HTTP/1.1 200")
        assert await asyncio.wait_for(reader.readuntil(b"1\r\n\n\r\n"), 5)
        writer.close()

    async def test_their_number_is_bounded_and_given_back(
        self, path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(server, "FOLLOWERS", 1)
        monkeypatch.setattr(server, "ALIVE_PERIOD", 0.05)
        reader, writer = await asyncio.open_unix_connection(path)
        writer.write(b"GET /v1/events?follow=1 HTTP/1.1\r\nHost: x\r\n\r\n")
        await reader.readuntil(b"\r\n\r\n")
        assert await refused(lambda: client.get("/v1/events", follow=1)) == (503, "busy")
        writer.close()
        async with asyncio.timeout(10):
            while True:
                try:
                    follower = client.follow("/v1/events", follow=1, limit=1)
                    await asyncio.to_thread(next, follower)
                except ControlError:
                    await asyncio.sleep(0.02)
                else:
                    break
        follower.close()

    async def test_one_that_never_reads_stops_nobody(
        self, path: Path, client: Client, press: Served, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(server, "_WRITE_TIME", 0.2)
        with socket.socket(socket.AF_UNIX) as lazy:
            lazy.connect(str(path))
            lazy.sendall(b"GET /v1/events?follow=1 HTTP/1.1\r\nHost: x\r\n\r\n")
            for _ in range(20):
                for _ in range(200):
                    press.cell.robot_connected(1.0, "x" * 200)
                    press.cell.robot_lost("gone", 1.0)
                assert (await get(client, "/v1/version"))["api"] == 1
                await asyncio.sleep(0.03)


async def test_packages_of_the_robot_are_followed(
    client: Client, press: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    taps: asyncio.Queue[PackageTap | None] = asyncio.Queue()
    monkeypatch.setattr(press.source, "tap_packages", taps.put_nowait, raising=False)
    rows = client.follow("/v1/packages")
    async with asyncio.TaskGroup() as group:
        reading = group.create_task(asyncio.to_thread(lambda: [next(rows) for _ in range(3)]))
        tap = await taps.get()
        assert tap is not None
        pack = struct.Struct(">d").pack
        tap.begin(
            PackageLayout("192.0.2.5", ("timestamp",), ("DOUBLE",), 0.002, lambda values: pack(*values))
        )
        tap.package((1.5,), 2.0)
        tap.lost("pulled")
    head, packages, lost = reading.result()
    assert head["layout"]["names"] == ["timestamp"]
    assert packages["packages"][0][1] == pack(1.5).hex()
    assert lost == {"lost": "pulled"}
    await asyncio.to_thread(rows.close)


async def test_packages_of_no_cell_and_of_too_many_recorders(client: Client, api: Api) -> None:
    with pytest.raises(ControlError, match="there is no cell other"):
        await asyncio.to_thread(lambda: next(client.follow("/v1/packages", cell="other")))
    for _ in range(MAX_FEEDS):
        assert api.feeds.open("press")
    with pytest.raises(ControlError, match="4 recordings are running already"):
        await asyncio.to_thread(lambda: next(client.follow("/v1/packages")))
