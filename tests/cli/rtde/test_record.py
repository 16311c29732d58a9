"""`gatewayd rtde record` against the simulator as a process: limits, conditions, and everything that ends it early."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli import command
from gatewayd.rtde.recording import open_recording, read_gaps
from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, Process, Simulator, free_port, wait_for


def place(simulator: Simulator) -> str:
    return f"{HOST}:{simulator.port}"


def robot(plant: Plant, *options: str, port: int = 0) -> Simulator:
    """A controller at the rate of its series, which the client takes it to have."""
    return plant.simulator(*options, port=port, frequency=500)


def record(*arguments: str | Path) -> Result:
    return CliRunner().invoke(command, ("rtde", "record", *map(str, arguments)), prog_name="gatewayd")


Recording = Callable[..., Process]


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    """`gatewayd rtde record` as a program of its own."""

    def start(*arguments: str | Path) -> Process:
        line = [sys.executable, "-m", "gatewayd", "rtde", "record", *map(str, arguments)]
        return Process(line, tmp_path / "record.log")

    return start


def columns(path: Path) -> dict[str, list[float]]:
    """The columns of a recording, by the library's reader; every line is whole."""
    with open_recording(path) as found:
        rows = list(found)
        assert found.torn == ""
        names = path.read_text("utf-8").split("\n", 1)[0].split(" ")
    return {name: [float(row[place]) for row in rows] for place, name in enumerate(names)}


def missing(path: Path) -> int:
    """How many packages the recording says that it lacks, each where it is lacking: timestamps and gaps agree.

    On a busy machine the simulator itself leaves out some, as a busy controller does.
    """
    stamps = columns(path)["timestamp"]
    assert len(stamps) > 1
    steps = (round((after - before) / 0.002) for before, after in pairwise(stamps))
    found = {number: step - 1 for number, step in enumerate(steps, 1) if step != 1}
    assert found == {gap.package: gap.missing for gap in read_gaps(path) if gap.missing}
    return sum(found.values())


def skipped(path: Path) -> str:
    """The same as the last line says it."""
    return f"{missing(path) or 'none'} skipped"


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "robot_data.csv"


@pytest.mark.parametrize(
    "arguments, words",
    [
        ((), "name the robot's HOST, or record a running gateway's with --gateway"),
        (("127.0.0.1:1", "x.csv", "--gateway"), "leave HOST out"),
        (("x.csv", "--gateway", "--frequency", "10"), "leave --frequency out"),
        (("127.0.0.1:1", "--cell", "press"), "--cell is for --gateway"),
        (("127.0.0.1:1", "--while", "runtime_state ="), "column 16: a number, or one of stopping"),
        (("127.0.0.1:1", "--while", "a", "--start", "b"), "leave --start and --stop out"),
        (("127.0.0.1:1", "--once"), "--once is for --while"),
        (("127.0.0.1:1", "--stop", "a", "--before", "1s"), "--before needs a condition"),
        (("127.0.0.1:1", "--start", "a", "--after", "1s"), "--after needs a condition"),
        (("127.0.0.1:1", "--key", "out"), "--key is for --config"),
        (("127.0.0.1:1", "--config", "no/such.xml"), "no/such.xml: cannot be read"),
        (("127.0.0.1:1", "-f", "actual_Q"), "there is no field actual_Q: it is written actual_q"),
        (("127.0.0.1:1", "-f", ","), "no field is named"),
        (("127.0.0.1:1", "-f", "a;b"), "'a;b' is not the name of a field"),
        (("127.0.0.1:1", "--delimiter", "."), "cannot separate columns"),
        (("127.0.0.1:1", "--binary", "--delimiter", "space"), "--delimiter separates the columns of text"),
        (("127.0.0.1:1", "--socket", "x.sock"), "--socket is for --gateway"),
    ],
)
def test_wrong_usage_says_what_to_do(arguments: tuple[str, ...], words: str) -> None:
    result = record(*arguments)
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())


def test_every_package_is_there_until_the_wanted_number(plant: Plant, out: Path) -> None:
    simulator = robot(plant)
    result = record(
        place(simulator), out, "-f", "actual_q,timestamp", "-f", "runtime_state", "--samples", "700"
    )
    assert result.exit_code == 0, result.output
    found = columns(out)
    assert list(found) == ["timestamp", *(f"actual_q_{joint}" for joint in range(6)), "runtime_state"]
    assert len(found["timestamp"]) == 700
    size = f"{out.stat().st_size / 1000:.1f} kB"
    assert result.output.startswith(f"{out}: 700 packages in ")
    assert f" s, {size}, {skipped(out)}" in result.output


def test_binary_with_host_time_and_a_duration(plant: Plant, out: Path) -> None:
    simulator = robot(plant)
    result = record(
        place(simulator),
        out,
        "-f",
        "actual_q",
        "--binary",
        "--host-time",
        "--duration",
        "400ms",
        "--frequency",
        "62.5",
    )
    assert result.exit_code == 0, result.output
    with open_recording(out) as found:
        rows = list(found.rows())
    assert found.recipe.names == ("timestamp", "actual_q")
    assert 1 < len(rows) <= 25
    times = [time for _, time in rows]
    assert None not in times
    assert sorted(times, key=lambda time: time or 0.0) == times


def test_the_recipe_of_the_official_client_with_its_types(plant: Plant, out: Path, tmp_path: Path) -> None:
    simulator = robot(plant)
    config = tmp_path / "record_configuration.xml"
    config.write_text(
        '<?xml version="1.0"?><rtde_config><recipe key="out"><field name="actual_q" type="VECTOR6D"/>'
        '<field name="output_int_register_3" type="INT32"/></recipe>'
        '<recipe key="bad"><field name="actual_q" type="VECTOR3D"/></recipe></rtde_config>'
    )
    result = record(place(simulator), out, "--config", config, "--samples", "3", "--delimiter", "comma")
    assert result.exit_code == 0, result.output
    header = out.read_text().split("\n")[0].split(",")
    assert header == [*(f"actual_q_{joint}" for joint in range(6)), "output_int_register_3"]
    result = record(
        place(simulator), tmp_path / "b.csv", "--config", config, "--key", "bad", "--samples", "3"
    )
    assert result.exit_code == 1
    assert "actual_q was declared as VECTOR3D, the controller has VECTOR6D" in result.output
    assert not (tmp_path / "b.csv").exists()
    result = record(place(simulator), tmp_path / "b.csv", "--config", config, "--key", "other")
    assert result.exit_code == 2
    assert "record_configuration.xml" in result.output


def test_a_field_that_the_controller_lacks_is_named(plant: Plant, out: Path) -> None:
    simulator = robot(plant, "--series", "cb3")
    result = record(place(simulator), out, "-f", "ft_raw_wrench")
    assert result.exit_code == 1
    assert "ft_raw_wrench: NOT_FOUND" in result.output
    assert not out.exists()


def test_nothing_is_overwritten_unless_that_is_wanted(plant: Plant, out: Path) -> None:
    simulator = robot(plant)
    out.write_text("precious")
    result = record(place(simulator), out)
    assert result.exit_code == 2
    assert "is there already; choose another name, or overwrite it with --force" in " ".join(
        result.output.split()
    )
    assert out.read_text() == "precious"
    assert record(place(simulator), out, "--force", "--samples", "2").exit_code == 0
    assert len(columns(out)["timestamp"]) == 2
    gaps = out.with_name(out.name + ".gaps.jsonl")
    gaps.write_text("{}")
    out.unlink()
    assert record(place(simulator), out).exit_code == 2
    assert record(place(simulator), out, "--force", "--samples", "2").exit_code == 0
    assert not gaps.exists() or gaps.read_text() != "{}"


def test_while_a_condition_holds_with_what_is_around_it(plant: Plant, out: Path) -> None:
    simulator = robot(plant, "--program", "output_int_register_0 = toggle every 100ms")
    result = record(
        place(simulator), out, "-f", "output_int_register_0", "--while", "output_int_register_0 == 1", "--before",
        "20ms", "--after", "40ms", "--samples", "200",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    found = columns(out)
    stamps, values = found["timestamp"], found["output_int_register_0"]
    ones = [stamp for stamp, value in zip(stamps, values, strict=True) if value]
    left_out = [gap for gap in read_gaps(out) if gap.reason == "left out by the condition"]
    assert left_out
    for stamp, value in zip(stamps, values, strict=True):
        assert value or stamp > ones[-1] or any(-0.0201 <= stamp - one <= 0.0401 for one in ones)
    for gap in left_out:
        between = round((stamps[gap.package] - stamps[gap.package - 1]) / 0.002) - 1
        assert 0 < (gap.missing or 0) <= between
    total = sum(gap.missing or 0 for gap in left_out)
    assert f"{total} left out by the condition; see {out}.gaps.jsonl" in result.output


def test_once_and_start_and_stop(plant: Plant, out: Path, tmp_path: Path) -> None:
    simulator = robot(
        plant,
        "--program",
        "output_int_register_0 = toggle every 40ms; output_int_register_1 = count every 100ms",
    )
    result = record(
        place(simulator), out, "-f", "output_int_register_0", "--while", "output_int_register_0", "--once"
    )
    assert result.exit_code == 0, result.output
    assert set(columns(out)["output_int_register_0"]) == {1.0}
    other = tmp_path / "other.csv"
    result = record(
        place(simulator), other, "-f", "output_int_register_1", "--start", "output_int_register_1 >= 2",
        "--stop", "output_int_register_1 > 2", "--after", "40ms",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    values = columns(other)["output_int_register_1"]
    assert values[0] >= 2
    assert values[-1] > 2


def test_a_condition_on_what_is_not_there_leaves_no_file(plant: Plant, out: Path) -> None:
    simulator = robot(plant)
    result = record(place(simulator), out, "--while", "actual_q > 1")
    assert result.exit_code == 2
    assert "actual_q is a vector: say which element" in result.output
    assert not out.exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_it_with_a_whole_file(
    plant: Plant, out: Path, recording: Recording, number: signal.Signals
) -> None:
    simulator = robot(plant)
    program = recording(place(simulator), out)
    wait_for(lambda: _length(out) > 5000, "packages to be recorded")
    program.signal(number)
    assert program.wait() == 0
    assert skipped(out) in program.answer()
    assert program.text() == ""
    program.kill()


def test_killed_in_the_middle_it_leaves_whole_packages(plant: Plant, out: Path, recording: Recording) -> None:
    simulator = robot(plant)
    program = recording(place(simulator), out)
    wait_for(lambda: _length(out) > 100_000, "packages to be recorded")
    program.kill()
    missing(out)


def test_a_robot_that_dies_ends_it(plant: Plant, out: Path, recording: Recording) -> None:
    simulator = robot(plant)
    program = recording(place(simulator), out)
    wait_for(lambda: _length(out) > 5000, "packages to be recorded")
    simulator.kill()
    assert program.wait() == 1
    assert f"gatewayd: {place(simulator)}: " in program.text()
    assert "the file has what came until then" in program.text()
    missing(out)
    program.kill()


def test_it_waits_for_the_robot_and_goes_on_after_a_loss(
    plant: Plant, out: Path, recording: Recording
) -> None:
    port = free_port()
    program = recording(f"{HOST}:{port}", out, "--reconnect")
    simulator = robot(plant, port=port)
    wait_for(lambda: _length(out) > 5000, "packages to be recorded")
    simulator.do("drop-clients")
    gaps = out.with_name(out.name + ".gaps.jsonl")
    wait_for(lambda: gaps.exists() and place(simulator) in gaps.read_text(), "the gap to be recorded")
    program.signal(signal.SIGINT)
    assert program.wait() == 0
    (gap,) = (found for found in read_gaps(out) if found.reason != "skipped")
    assert gap.reason.startswith(place(simulator))
    assert f"{skipped(out)}; see" in program.answer()
    program.kill()


def test_a_robot_that_comes_back_as_another_ends_the_recording(
    plant: Plant, out: Path, recording: Recording
) -> None:
    simulator = robot(plant)
    program = recording(place(simulator), out, "--reconnect", "-f", "actual_q")
    wait_for(lambda: _length(out) > 5000, "packages to be recorded")
    simulator.kill()
    robot(plant, "--field", "actual_q:VECTOR3D", port=simulator.port)
    assert program.wait() == 1
    assert "came back with other fields or types than the recording has" in program.text()
    missing(out)
    program.kill()


def test_ctrl_c_before_the_robot_is_there(out: Path, recording: Recording) -> None:
    program = recording(f"{HOST}:{free_port()}", out, "--reconnect")
    wait_for(lambda: _catches(program.pid, signal.SIGHUP), "it to wait for the robot")
    program.signal(signal.SIGINT)
    assert program.wait() == 0
    assert "ended before the robot was reached; nothing was recorded" in program.text()
    assert not out.exists()
    program.kill()


def _catches(pid: int, number: signal.Signals) -> bool:
    """Whether a process has a handler for a signal (proc(5), SigCgt)."""
    status = Path(f"/proc/{pid}/status").read_text("ascii")
    mask = next(line.split()[1] for line in status.splitlines() if line.startswith("SigCgt:"))
    return bool(int(mask, 16) >> (number - 1) & 1)


def test_progress_and_texts_of_the_robot_in_a_terminal(plant: Plant, out: Path) -> None:
    simulator = robot(plant)
    master, slave = pty.openpty()
    line = [sys.executable, "-m", "gatewayd", "rtde", "record", place(simulator), str(out)]
    program = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=slave, text=True, close_fds=True)
    os.close(slave)
    seen: list[str] = []

    def shows(text: str) -> bool:
        if select.select([master], [], [], 0)[0]:
            seen.append(os.read(master, 65536).decode(errors="replace"))
        return text in "".join(seen)

    wait_for(lambda: shows(" Hz   "), "the progress")
    simulator.do("text the gripper is open")
    wait_for(lambda: shows("the gripper is open"), "the text")
    program.send_signal(signal.SIGINT)
    assert program.stdout is not None
    assert program.stdout.read().startswith(f"{out}: ")
    assert program.wait(15) == 0
    program.stdout.close()
    os.close(master)


def test_packages_that_the_controller_skips_are_counted(plant: Plant, out: Path) -> None:
    simulator = robot(plant, "--drop", "0.2", "--seed", "7")
    result = record(place(simulator), out, "--samples", "100")
    assert result.exit_code == 0
    gaps = read_gaps(out)
    assert {gap.reason for gap in gaps} == {"skipped"}
    assert missing(out) > 0
    assert skipped(out) in result.output


def test_a_full_disk_ends_it_with_a_whole_file(plant: Plant, out: Path, tmp_path: Path) -> None:
    """The limit on the size of files stands for the disk: the system refuses in the middle of a write, as there."""
    simulator = robot(plant)
    program = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000)); "
        "from gatewayd.__main__ import main; sys.exit(main())"
    )
    line = [sys.executable, "-c", program, "rtde", "record", place(simulator), str(out)]
    running = Process(line, tmp_path / "record.log")
    assert running.wait() == 1
    assert "all of them whole" in running.text()
    assert "Traceback" not in running.text()
    assert 15_000 < out.stat().st_size <= 20_000
    missing(out)
    running.kill()


def test_a_place_that_cannot_be_written(plant: Plant, tmp_path: Path) -> None:
    simulator = robot(plant)
    result = record(place(simulator), tmp_path / "no" / "such" / "a.csv", "--samples", "1")
    assert result.exit_code == 1
    assert "a.csv: cannot be written: No such file or directory" in result.output


def test_who_cannot_be_reached_is_one_clear_line(out: Path) -> None:
    result = record(f"{HOST}:{free_port()}", out)
    assert result.exit_code == 1
    assert result.output.startswith("gatewayd: ")
    assert len(result.output.splitlines()) == 1
    assert not out.exists()


def test_without_a_name_the_file_is_named_after_the_robot(
    plant: Plant, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulator = robot(plant)
    monkeypatch.chdir(tmp_path)
    assert record(place(simulator), "--samples", "1").exit_code == 0
    (found,) = tmp_path.glob("rtde-*.csv")
    assert found.name.startswith(f"rtde-{HOST}-{simulator.port}-20")


CELL = """\
writers: {plc: {modbus: 127.0.0.1}}
variables:
  echo: {robot: output_int_register_0, modbus: 100}
  joints: {robot: actual_q, modbus: 200}
"""


def test_a_running_gateway_is_recorded_without_another_connection(
    plant: Plant, out: Path, tmp_path: Path, recording: Recording
) -> None:
    simulator = robot(plant, "--program", "output_int_register_0 = count every 20ms")
    socket = tmp_path / "control.sock"
    plant.daemon(plant.mapping(CELL, simulator.port), "--control", str(socket))
    wait_for(socket.exists, "the control socket")
    result = record(
        "--gateway", out, "--socket", socket, "--samples", "150", "--while", "output_int_register_0"
    )
    assert result.exit_code == 0, result.output
    found = columns(out)
    assert list(found) == ["timestamp", "output_int_register_0", *(f"actual_q_{joint}" for joint in range(6))]
    assert skipped(out) in result.output
    assert simulator.do("clients") == "1"
    other = tmp_path / "other.csv"
    assert record("--gateway", other, "--socket", socket, "-f", "actual_qd").exit_code == 1
    lost = tmp_path / "lost.csv"
    program = recording("--gateway", lost, "--socket", socket, "--host-time", "-f", "actual_q")
    wait_for(lambda: _length(lost) > 5000, "packages to be recorded")
    simulator.kill()
    assert program.wait() == 1
    assert "the file has what came until then" in program.text()
    with open_recording(lost) as reader:
        assert reader.host_time
        assert all(time for _, time in reader.rows())
    program.kill()


def test_a_gateway_that_ends_leaves_what_came_until_then(
    plant: Plant, out: Path, tmp_path: Path, recording: Recording
) -> None:
    simulator = robot(plant)
    socket = tmp_path / "control.sock"
    daemon = plant.daemon(plant.mapping(CELL, simulator.port), "--control", str(socket))
    wait_for(socket.exists, "the control socket")
    program = recording("--gateway", out, "--socket", socket)
    wait_for(lambda: _length(out) > 5000, "packages to be recorded")
    daemon.stop()
    assert program.wait() == 1
    assert "the gateway has ended; the file has what came until then" in program.text()
    assert columns(out)


def test_the_fieldbus_does_not_notice_a_recorder_that_stands_still(
    plant: Plant, out: Path, tmp_path: Path, recording: Recording
) -> None:
    """What it has not read meanwhile it gets afterwards, as far as the gateway keeps it."""
    simulator = robot(plant, "--program", "demo")
    socket = tmp_path / "control.sock"
    plant.daemon(
        plant.mapping(
            "writers: {plc: {modbus: 127.0.0.1}}\nvariables:\n"
            "  part: {robot: input_int_register_0, modbus: 0, owner: plc}\n"
            "  echo: {robot: output_int_register_0, modbus: 100}\n",
            simulator.port,
        ),
        "--control",
        str(socket),
    )
    plc = plant.ready_plc("127.0.0.1")
    wait_for(socket.exists, "the control socket")
    program = recording("--gateway", out, "--socket", socket)
    wait_for(lambda: _length(out) > 2000, "packages to be recorded")
    program.signal(signal.SIGSTOP)
    for value in range(1, 40):
        assert plc.write_integers(0, value) == 0
        wait_for(lambda: plc.integers(100) == [value], "the echo")  # noqa: B023 - waited for at once
    program.signal(signal.SIGCONT)
    wait_for(lambda: columns(out)["output_int_register_0"][-1] == 39, "the last echo to be recorded")
    program.signal(signal.SIGINT)
    assert program.wait() == 0
    missing(out)
    program.kill()
    echoes = columns(out)["output_int_register_0"]
    assert {float(value) for value in range(1, 40)} <= set(echoes)


def test_no_gateway_is_said(tmp_path: Path, out: Path) -> None:
    result = record("--gateway", out, "--socket", tmp_path / "no.sock")
    assert result.exit_code == 2
    assert "no gatewayd listens at" in result.output
    assert not out.exists()


def _length(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0
