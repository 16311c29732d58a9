"""`gatewayd doctor`: the command, against real processes."""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, Simulator, free_port, wait_for

GOLDEN = Path(__file__).parents[1] / "golden" / "doctor"
MAPPING = """\
writers:
  plc: {modbus: 127.0.0.1}
variables:
  start:  {robot: input_bit_register_0, modbus: 0.0, owner: plc}
  part:   {robot: input_int_register_3, modbus: 10, owner: plc}
  cycles: {robot: output_int_register_0, modbus: 100}
  wrench: {robot: ft_raw_wrench, modbus: {holding: 200, type: float32}}
"""
FOREIGN = """\
import socket, sys
with socket.create_server((sys.argv[1], int(sys.argv[2]))):
    print("listening", flush=True)
    input()
"""


def start(directory: Path, *arguments: str | Path) -> subprocess.Popen[str]:
    """The command, for which no gateway runs unless the arguments name one."""
    command = [sys.executable, "-m", "gatewayd", "doctor", *map(str, arguments)]
    environment = {"PATH": "/usr/bin:/bin", "XDG_RUNTIME_DIR": str(directory)}
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )


def doctor(directory: Path, *arguments: str | Path) -> tuple[int, str, str]:
    process = start(directory, *arguments)
    output, errors = process.communicate(timeout=60)
    return process.returncode, output, errors


def checks(plant: Plant, *arguments: str | Path) -> dict[str, list[tuple[str, str]]]:
    """What the document has: `link check` -> outcomes and texts."""
    _, output, _ = doctor(plant.directory, "--json", *arguments)
    found: dict[str, list[tuple[str, str]]] = {}
    for one in json.loads(output)["checks"]:
        found.setdefault(f"{one['link']} {one['check']}", []).append((one["outcome"], one["text"]))
    return found


def settled(text: str, plant: Plant, mapping: Path, simulator: Simulator) -> str:
    """The text without what differs from run to run."""
    ports = {str(plant.modbus): "MODBUS", str(simulator.port): "ROBOT"}
    text = text.replace(str(mapping), "cell.yaml").replace(HOST, "HOST")
    for port, name in ports.items():
        text = text.replace(f":{port}", f":{name}")
    text = re.sub(r"\(pid [0-9]+\)", "(pid N)", text)
    text = re.sub(r"for 3\.[0-9] s", "for 3 s", text)
    text = re.sub(r"data( +)note    (.* agreed):.*", r"data\1ok      \2", text)  # a busy machine
    return re.sub(r"[0-9]+ Hz,", "N Hz,", text)


@pytest.mark.parametrize(
    "name, options, arguments, code",
    [
        ("well", (), (), 0),
        ("adapter", ("--adapter", "profinet"), ("--probe-claims",), 1),
        ("old", ("--version", "3.14.0", "--protocol-v1"), (), 1),
        ("silent", ("--silence", "--text-on-connect"), (), 1),
    ],
)
def test_the_text_is_as_it_was(
    plant: Plant, name: str, options: tuple[str, ...], arguments: tuple[str, ...], code: int
) -> None:
    # So slow that no package is left out, however busy this machine is; protocol 1 would have 125 Hz.
    simulator = plant.simulator("--program", "demo", *options, frequency=10)
    mapping = plant.mapping(MAPPING, simulator.port, frequency=10)
    returned, output, errors = doctor(plant.directory, *arguments, mapping)
    assert (returned, errors) == (code, "")
    assert settled(output, plant, mapping, simulator) == (GOLDEN / f"{name}.txt").read_text("utf-8")


def test_nothing_is_written_and_nothing_stays_claimed(plant: Plant) -> None:
    simulator = plant.simulator()
    mapping = plant.mapping(MAPPING, simulator.port)
    simulator.do("set input_int_register_3 7")
    assert checks(plant, "--probe-claims", mapping)["robot claims"][1:] == [("ok", "2 inputs can be claimed")]
    assert simulator.integer("input_int_register_3") == 7
    wait_for(lambda: simulator.do("clients") == "0", "the visits to be over")


def test_a_port_of_a_foreign_server_is_named_with_its_process(plant: Plant) -> None:
    simulator = plant.simulator()
    mapping = plant.mapping(MAPPING, simulator.port)
    with subprocess.Popen(
        [sys.executable, "-c", FOREIGN, HOST, str(plant.modbus)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as foreign:
        assert foreign.stdout is not None
        foreign.stdout.readline()
        ((outcome, text),) = checks(plant, mapping)["modbus port"]
        foreign.kill()
    assert outcome == "problem"
    assert f"(pid {foreign.pid})" in text


def test_a_running_gateway_is_noticed_and_what_it_holds_is_its_own(plant: Plant) -> None:
    simulator = plant.simulator("--program", "demo", "--hold", "input_int_register_3")
    mapping = plant.mapping(MAPPING, simulator.port)
    control = plant.directory / "gatewayd.sock"
    daemon = plant.daemon(mapping, "--control", control)
    daemon.wait_for_line("listening for control")
    plant.ready_plc()
    found = checks(plant, "--probe-claims", mapping)
    assert found["robot claims"] == [
        ("ok", "2 inputs claimed by the gateway on this machine"),
        ("problem", "in use by another client: input_int_register_3"),
    ]
    assert found["modbus port"] == [
        ("ok", f"{HOST}:{plant.modbus} is served by the running gateway, 1 connection")
    ]
    ((outcome, text),) = found["gateway served"]
    assert outcome == "warning"
    assert "another client holds input_int_register_3" in text


@pytest.mark.parametrize(
    "answer, words",
    [(b"", "did not arrive within"), (b"\0\0\0\0", "is not RTDE"), (b"SSH-2.0-x\r\n", "did not arrive")],
    ids=["silent", "garbage", "another service"],
)
def test_who_accepts_and_speaks_no_rtde(plant: Plant, answer: bytes, words: str) -> None:
    import threading

    with socket.create_server((HOST, free_port())) as listener:
        port = listener.getsockname()[1]

        def serve() -> None:
            while True:
                try:
                    peer, _ = listener.accept()
                except OSError:
                    return
                peers.append(peer)
                peer.sendall(answer)

        peers: list[socket.socket] = []
        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        found = checks(plant, plant.mapping(MAPPING, port))
        listener.shutdown(socket.SHUT_RDWR)
        thread.join(10)
        for peer in peers:
            peer.close()
    ((outcome, text),) = found["robot RTDE service"]
    assert outcome == "problem"
    assert words in text


def test_a_mapping_with_errors_is_said_and_others_are_looked_at(plant: Plant) -> None:
    mapping = plant.mapping(MAPPING, free_port())
    broken = plant.directory / "broken.yaml"
    broken.write_text("gatewayd: 1\n")
    code, output, _ = doctor(plant.directory, broken, mapping)
    assert code == 1
    assert f"{broken} has " in output
    assert ": no gateway starts with it" in output
    assert "its RTDE service is off" in output


def test_a_file_that_cannot_be_read_is_said_and_others_are_looked_at(plant: Plant) -> None:
    mapping = plant.mapping(MAPPING, free_port())
    code, output, errors = doctor(plant.directory, plant.directory / "none.yaml", mapping)
    assert code == 2
    assert errors.endswith("none.yaml: cannot be read: No such file or directory\n")
    assert "connection refused" in output
    assert doctor(plant.directory)[0] == 2


def test_a_socket_that_is_named_and_silent_is_a_warning(plant: Plant) -> None:
    mapping = plant.mapping(MAPPING, free_port())
    code, output, _ = doctor(plant.directory, "--socket", plant.directory / "none.sock", mapping)
    assert code == 1
    assert "no gatewayd listens at" in output


def test_an_interrupt_ends_it_cleanly(plant: Plant) -> None:
    simulator = plant.simulator("--silence")
    process = start(plant.directory, plant.mapping(MAPPING, simulator.port))
    assert process.stdout is not None
    while not process.stdout.readline().startswith("  robot     port"):
        pass
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "Traceback" not in errors
