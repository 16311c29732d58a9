"""Messages to a service manager: a real datagram socket takes them."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from gatewayd.service.systemd import LONGEST_STATUS, Notifier


class Manager:
    """The receiving end of sd_notify."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind("\0" + address[1:] if address.startswith("@") else address)
        self.socket.settimeout(5)

    def read(self) -> str:
        return self.socket.recv(65536).decode()


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[Manager]:
    made = Manager(str(tmp_path / "notify"))
    yield made
    made.socket.close()


@pytest.fixture
def notifier(manager: Manager) -> Iterator[Notifier]:
    made = Notifier({"NOTIFY_SOCKET": manager.address}, 1)
    yield made
    made.close()


def test_each_message_is_one_datagram(manager: Manager, notifier: Notifier) -> None:
    sent = []
    for call in (
        notifier.ready,
        notifier.watchdog,
        notifier.stopping,
        lambda: notifier.status("robot fresh"),
        lambda: notifier.ready("well"),
        lambda: notifier.reloading(12.3456789, "reloading"),
        lambda: notifier.stopping("bye"),
    ):
        assert call()
        sent.append(manager.read())
    assert sent == [
        "READY=1",
        "WATCHDOG=1",
        "STOPPING=1",
        "STATUS=robot fresh",
        "READY=1\nSTATUS=well",
        "RELOADING=1\nMONOTONIC_USEC=12345678\nSTATUS=reloading",
        "STOPPING=1\nSTATUS=bye",
    ]


def test_an_at_sign_stands_for_the_abstract_namespace() -> None:
    name = f"@gatewayd-test-{os.getpid()}"
    manager = Manager(name)
    notifier = Notifier({"NOTIFY_SOCKET": name}, 1)
    assert notifier.ready()
    assert manager.read() == "READY=1"
    notifier.close()
    manager.socket.close()


def test_a_status_cannot_smuggle_in_another_assignment(manager: Manager, notifier: Notifier) -> None:
    notifier.status("a name\nWATCHDOG=trigger\r\n  of two   lines")
    assert manager.read() == "STATUS=a name WATCHDOG=trigger of two lines"


def test_a_status_is_cut_and_never_fails_to_encode(manager: Manager, notifier: Notifier) -> None:
    assert notifier.status("\udcff\x1b[31m\u202e" + 5000 * "x")
    told = manager.read().removeprefix("STATUS=")
    assert told.startswith("\\udcff\\x1b[31m\\u202exxx")
    assert told.endswith("... (5007 characters)")
    assert len(told) == LONGEST_STATUS


@pytest.mark.parametrize(
    "environment", [{}, {"NOTIFY_SOCKET": ""}, {"NOTIFY_SOCKET": "@"}, {"NOTIFY_SOCKET": "relative"}]
)
def test_without_a_manager_nothing_happens(environment: dict[str, str]) -> None:
    notifier = Notifier({**environment, "WATCHDOG_USEC": "2000000"}, 1)
    assert notifier.watchdog_after is None
    assert not any((notifier.ready(), notifier.status("x"), notifier.watchdog(), notifier.stopping()))
    assert notifier._socket is None


def test_a_manager_that_is_gone_raises_nothing(tmp_path: Path) -> None:
    notifier = Notifier({"NOTIFY_SOCKET": str(tmp_path / "nobody")}, 1)
    assert not notifier.ready()
    notifier.close()
    assert not Notifier({"NOTIFY_SOCKET": "/" + 200 * "x"}, 1).ready()


def test_a_manager_that_does_not_read_holds_nothing_up(manager: Manager, notifier: Notifier) -> None:
    """The queue fills; from then on messages are lost, and come through again once there is room."""
    while notifier.status("x" * 500):
        pass
    manager.read()
    assert notifier.watchdog()


@pytest.mark.parametrize(
    "environment, expected",
    [
        ({"WATCHDOG_USEC": "2000000"}, 2.0),
        ({"WATCHDOG_USEC": "2000000", "WATCHDOG_PID": "42"}, 2.0),
        ({"WATCHDOG_USEC": "2000000", "WATCHDOG_PID": "43"}, None),
        ({"WATCHDOG_USEC": "2000000", "WATCHDOG_PID": "no"}, None),
        ({"WATCHDOG_USEC": "0"}, None),
        ({"WATCHDOG_USEC": "soon"}, None),
        ({}, None),
    ],
)
def test_the_watchdog_is_meant_for_one_process(environment: dict[str, str], expected: float | None) -> None:
    assert Notifier({"NOTIFY_SOCKET": "@x", **environment}, 42).watchdog_after == expected
