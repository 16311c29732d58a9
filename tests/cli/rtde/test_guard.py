from __future__ import annotations

import socket
from pathlib import Path

import pytest

from gatewayd.cli.rtde import gateway_processes as module
from gatewayd.cli.rtde.gateway_processes import GatewayProcess
from gatewayd.cli.rtde.guard import gateway_in_the_way, program_in_the_way
from tests.cli.conftest import Running
from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, free_port


@pytest.fixture(autouse=True)
def no_other_gateway(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Gateways of this machine are no matter of these tests."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(module, "gateway_processes", tuple)


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
    found = gateway_in_the_way("192.0.2.10", 30004, gateway.path)
    assert found.startswith(f"the gateway at {gateway.path} serves this robot as cell press")
    assert gateway_in_the_way("192.0.2.10", 30005, gateway.path) == ""
    assert gateway_in_the_way("192.0.2.11", 30004, gateway.path) == ""
    assert gateway_in_the_way("no such host", 30004, gateway.path) == ""


def test_a_named_gateway_is_asked_beside_those_that_are_found(gateway: Running, tmp_path: Path) -> None:
    (tmp_path / "gatewayd.sock").symlink_to(gateway.path)
    assert gateway_in_the_way("192.0.2.10", 30004).startswith("the gateway at")
    assert gateway_in_the_way("192.0.2.10", 30004, tmp_path / "other.sock").startswith("the gateway at")


def test_a_gateway_that_does_not_answer_may_be_in_the_way(tmp_path: Path) -> None:
    path = tmp_path / "control.sock"
    assert gateway_in_the_way("192.0.2.10", 30004, path) == "", "there is none"
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listening:
        listening.bind(str(path))
        assert gateway_in_the_way("192.0.2.10", 30004, path) == "", "nobody listens any more"
        listening.listen(0)
        found = gateway_in_the_way("192.0.2.10", 30004, path)
    assert found.startswith("a gateway may serve this robot, and does not say so")


MAPPING = """\
gatewayd: 1
cell: press
robot: {host: 192.0.2.10}
modbus: {listen: "127.0.0.1:1502", unit: 1}
variables: {mode: {robot: robot_mode, modbus: 0}}
"""


def running(monkeypatch: pytest.MonkeyPatch, *sockets: Path, files: tuple[Path, ...] | None) -> None:
    monkeypatch.setattr(module, "gateway_processes", lambda: (GatewayProcess(7, sockets, files),))


def test_a_gateway_whose_socket_only_proc_shows_is_asked(
    gateway: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also if it has lost its robot: it has no connection then. One that has answered is known, whatever its files."""
    running(monkeypatch, gateway.path, files=None)
    monkeypatch.setattr(module, "listener", lambda path: 7 if path == gateway.path else 0)
    assert gateway_in_the_way("192.0.2.10", 30004).startswith(f"the gateway at {gateway.path} serves")
    assert gateway_in_the_way("192.0.2.11", 30004) == ""


def test_a_gateway_without_a_socket_is_known_by_its_mapping_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "press.yaml"
    file.write_text(MAPPING)
    for files in ((file,), (tmp_path,)):
        running(monkeypatch, files=files)
        found = gateway_in_the_way("192.0.2.10", 30004, beside_unknown=True)
        assert found.startswith(
            f"a gateway (process 7) is to serve this robot by {files[0]}, and its control socket"
        )
        assert gateway_in_the_way("192.0.2.11", 30004) == ""
        assert gateway_in_the_way("192.0.2.10", 30005) == ""


@pytest.mark.parametrize("content", [None, "cell: [", "gatewayd: 1\n"])
def test_a_gateway_of_which_nothing_can_be_read_may_be_in_the_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str | None
) -> None:
    file = tmp_path / "press.yaml"
    if content is not None:
        file.write_text(content)
    other = tmp_path / "other.yaml"
    other.write_text(MAPPING)
    for files in ((file,), (other, file), None):
        running(monkeypatch, files=files)
        found = gateway_in_the_way("192.0.2.11", 30004)
        assert found.startswith(
            "a gateway (process 7) runs on this machine, and which robot it serves is not known"
        )
        assert found.endswith("--beside-unknown-gateway writes all the same")
        assert gateway_in_the_way("192.0.2.11", 30004, beside_unknown=True) == ""


def test_a_gateway_that_has_lost_its_robot_is_found_all_the_same(
    plant: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A real one, without a control socket, whose robot was never there."""
    monkeypatch.undo()
    port = free_port()
    daemon = plant.daemon(
        plant.mapping("variables: {mode: {robot: robot_mode, modbus: 0}}\n", port), "--control", "none"
    )
    monkeypatch.setattr("os.environ", {})
    found = gateway_in_the_way(HOST, port)
    assert found.startswith(f"a gateway (process {daemon.pid}) is to serve this robot by ")
