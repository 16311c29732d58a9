from __future__ import annotations

import socket
from pathlib import Path

import pytest

from gatewayd.cli.rtde.guard import gateway_in_the_way, program_in_the_way
from tests.cli.conftest import Running


@pytest.fixture(autouse=True)
def no_other_gateway(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Gateways of this machine are no matter of these tests."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.mark.parametrize(
    "state, words",
    [
        (1, ""),
        (4, "the program is paused"),
        (0, "the program is stopping"),
        (2, "the program is running"),
        (5, "the program is resuming"),
        (6, "the program is retracting"),
        (77, "the program is in state 77"),
        (None, "the controller does not say whether a program runs"),
    ],
)
def test_states_of_the_program(state: int | None, words: str) -> None:
    assert program_in_the_way(state) == words


def test_the_gateway_of_the_robot_is_in_the_way(gateway: Running) -> None:
    found = gateway_in_the_way("192.168.1.10", 30004, gateway.path)
    assert found.startswith(f"the gateway at {gateway.path} serves this robot as cell press")
    assert gateway_in_the_way("192.168.1.10", 30005, gateway.path) == ""
    assert gateway_in_the_way("192.168.1.11", 30004, gateway.path) == ""
    assert gateway_in_the_way("no such host", 30004, gateway.path) == ""


def test_a_named_gateway_is_asked_beside_those_that_are_found(gateway: Running, tmp_path: Path) -> None:
    (tmp_path / "gatewayd.sock").symlink_to(gateway.path)
    assert gateway_in_the_way("192.168.1.10", 30004).startswith("the gateway at")
    assert gateway_in_the_way("192.168.1.10", 30004, tmp_path / "other.sock").startswith("the gateway at")


def test_a_gateway_that_does_not_answer_may_be_in_the_way(tmp_path: Path) -> None:
    path = tmp_path / "control.sock"
    assert gateway_in_the_way("192.168.1.10", 30004, path) == "", "there is none"
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listening:
        listening.bind(str(path))
        assert gateway_in_the_way("192.168.1.10", 30004, path) == "", "nobody listens any more"
        listening.listen(0)
        found = gateway_in_the_way("192.168.1.10", 30004, path)
    assert found.startswith("a gateway may serve this robot, and does not say so")
