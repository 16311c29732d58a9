# ruff: noqa: ASYNC240 - files of a test
"""The socket's file: permissions, what a dead daemon left behind, and what must never be replaced."""

from __future__ import annotations

import asyncio
import os
import socket
import stat
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from pathlib import Path

import pytest

from gatewayd.control import endpoint
from gatewayd.control.api import Api
from gatewayd.control.client import Client
from gatewayd.control.endpoint import Endpoint, SocketTaken, bind

Serving = Callable[[Endpoint], AbstractAsyncContextManager[None]]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "control.sock"


@pytest.fixture
def serving(monkeypatch: pytest.MonkeyPatch) -> Serving:
    monkeypatch.setattr(endpoint, "RETRY_PERIOD", 0.02)

    @asynccontextmanager
    async def run(one: Endpoint) -> AsyncIterator[None]:
        task = asyncio.create_task(one.run())
        try:
            yield
        finally:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

    return run


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(10):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.005)


def test_owner_and_group_may_use_it_and_nobody_else(path: Path) -> None:
    with bind(path):
        assert stat.S_IMODE(path.stat().st_mode) == 0o660


def test_the_umask_stays_as_it_was(path: Path) -> None:
    before = os.umask(0o22)
    try:
        with bind(path):
            assert os.umask(0o22) == 0o22
    finally:
        os.umask(before)


def test_a_stale_socket_is_replaced(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(path))
    with bind(path):
        Client(path)


def test_a_live_one_is_refused_with_the_remedy(path: Path) -> None:
    with bind(path), pytest.raises(SocketTaken, match="another gatewayd answers there; stop it"):
        bind(path)
    assert path.exists()


def test_a_file_that_is_no_socket_is_never_replaced(path: Path) -> None:
    path.write_text("precious")
    with pytest.raises(SocketTaken, match="not a socket"):
        bind(path)
    assert path.read_text() == "precious"


def test_a_missing_directory_has_a_remedy(tmp_path: Path) -> None:
    with pytest.raises(SocketTaken, match="make the directory"):
        bind(tmp_path / "missing" / "control.sock")


def test_a_path_that_no_socket_can_have_is_an_error_not_a_crash(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="path too long"):
        bind(tmp_path / ("x" * 200))


async def test_it_waits_until_the_gateway_serves(path: Path, api: Api, serving: Serving) -> None:
    serves = False
    async with serving(Endpoint(path, api, lambda: serves)):
        await asyncio.sleep(0.1)
        assert not path.exists()
        serves = True
        await until(path.exists)
        assert (await asyncio.to_thread(Client(path).get, "/v1/version"))["api"] == 1
    assert not path.exists()


async def test_a_removed_file_is_made_again(path: Path, api: Api, serving: Serving) -> None:
    async with serving(Endpoint(path, api, lambda: True)):
        await until(path.exists)
        path.unlink()
        await until(path.exists)
        assert (await asyncio.to_thread(Client(path).get, "/v1/version"))["api"] == 1


async def test_a_file_that_is_not_ours_any_more_is_left_alone(path: Path, api: Api, serving: Serving) -> None:
    async with serving(Endpoint(path, api, lambda: True)):
        await until(path.exists)
        path.unlink()
        path.write_text("somebody else's")
        await asyncio.sleep(0.1)
    assert path.read_text() == "somebody else's"


async def test_trouble_is_told_once_and_tried_again(
    path: Path, api: Api, serving: Serving, caplog: pytest.LogCaptureFixture
) -> None:
    taken = bind(path)
    async with serving(Endpoint(path, api, lambda: True)):
        await until(lambda: bool(caplog.records))
        await asyncio.sleep(0.2)
        assert [one.getMessage() for one in caplog.records] == ["no control socket"]
        taken.close()
        await until(lambda: any(one.getMessage() == "listening for control" for one in caplog.records))


@pytest.fixture(autouse=True)
def _info(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "gatewayd.control")
