"""Recordings as the official client has them, byte by byte, and whole whatever happens."""

from __future__ import annotations

import csv
import math
import subprocess
import sys
from pathlib import Path

import pytest

from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording import RecordingError, RecordingExistsError, create_recording, open_recording
from tests.rtde.recording.samples import HEADER, LINES, PACKAGES, RECIPE, TYPES


def test_text_is_the_official_writers_but_for_booleans_and_line_ends(tmp_path: Path) -> None:
    path = tmp_path / "robot_data.csv"
    with create_recording(path, RECIPE) as recording:
        for values in PACKAGES:
            recording.write(values)
    assert path.read_text() == "".join(f"{line}\n" for line in (HEADER, *LINES))
    assert (recording.packages, recording.size) == (2, path.stat().st_size)


def test_what_the_official_reader_does_with_a_line_succeeds(tmp_path: Path) -> None:
    """csv_reader.CSVReader: the csv module, float() of every cell, and `runtime_state` compared with the text 2."""
    path = tmp_path / "robot_data.csv"
    with create_recording(path, RECIPE) as recording:
        for values in PACKAGES:
            recording.write(values)
    with path.open() as file:
        header, *rows = csv.reader([line for line in file.readlines() if line.strip()], delimiter=" ")
    found = {
        name: [float(cell) for cell in column]
        for name, column in zip(header, zip(*rows, strict=True), strict=True)
    }
    assert found["actual_q_4"] == [0.1 + 0.2, 2 / 3]
    assert found["output_bit_register_64"] == [1.0, 0.0]
    assert [row[header.index("runtime_state")] == "2" for row in rows] == [True, False]


def test_binary_is_two_lines_of_names_and_types_and_then_payloads(tmp_path: Path) -> None:
    path = tmp_path / "robot_data.bin"
    with create_recording(path, RECIPE, binary=True) as recording:
        for values in PACKAGES:
            recording.write(values)
    head = f"{HEADER}\n{TYPES}\n".encode()
    data = path.read_bytes()
    assert data.startswith(head)
    assert data.removeprefix(head) == b"".join(map(RECIPE.pack, PACKAGES))
    assert RECIPE.pack(PACKAGES[0])[:8].hex() == "409348020c49ba5e"


@pytest.mark.parametrize("binary", [False, True])
def test_a_payload_is_the_same_as_its_values(tmp_path: Path, binary: bool) -> None:
    paths = tmp_path / "values", tmp_path / "payloads"
    with (
        create_recording(paths[0], RECIPE, binary=binary) as values,
        create_recording(paths[1], RECIPE, binary=binary) as payloads,
    ):
        for package in PACKAGES:
            values.write(package)
            payloads.write_payload(RECIPE.pack(package))
        with pytest.raises(ValueError, match="a payload of 3 B, where the recipe has"):
            payloads.write_payload(b"abc")
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_delimiter_and_host_time(tmp_path: Path) -> None:
    path = tmp_path / "robot_data.csv"
    recipe = Recipe(
        ["timestamp", "payload_cog"], [OUTPUTS[name].type for name in ("timestamp", "payload_cog")]
    )
    with create_recording(path, recipe, delimiter=";", host_time=True) as recording:
        recording.write((0.002, 0.0, math.inf, math.nan), 1764398686.5)
    assert path.read_text() == (
        "timestamp;payload_cog_0;payload_cog_1;payload_cog_2;host_time\n0.002;0.0;inf;nan;1764398686.5\n"
    )


@pytest.mark.parametrize("delimiter", ["", "ab", ".", "-", "e", "1", "_", '"', "\n", "\0", "ü"])
def test_no_sign_separates_that_numbers_or_names_have(tmp_path: Path, delimiter: str) -> None:
    with pytest.raises(ValueError, match="cannot separate columns"):
        create_recording(tmp_path / "x.csv", RECIPE, delimiter=delimiter)
    assert not (tmp_path / "x.csv").exists()


def test_a_file_that_is_there_is_overwritten_only_on_request(tmp_path: Path) -> None:
    path = tmp_path / "robot_data.csv"
    path.write_text("precious" * 1000)
    with pytest.raises(RecordingExistsError, match=r"robot_data\.csv: is there already; choose another name"):
        create_recording(path, RECIPE)
    assert path.read_text() == "precious" * 1000
    create_recording(path, RECIPE, overwrite=True).close()
    assert path.read_text() == f"{HEADER}\n"


def test_values_that_do_not_fit_are_named_and_not_written(tmp_path: Path) -> None:
    path = tmp_path / "robot_data.csv"
    with create_recording(path, RECIPE) as recording:
        with pytest.raises(ValueError, match="tool_output_mode is UINT8 and cannot hold 256"):
            recording.write((*PACKAGES[0][:-2], 256, True))
        recording.write(PACKAGES[1])
    assert path.read_text().splitlines()[1:] == [LINES[1]]


_RECORD = """
import resource, sys
from gatewayd.rtde.recording import RecordingError, create_recording
from tests.rtde.recording.samples import PACKAGES, RECIPE

resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))
recording = create_recording(sys.argv[1], RECIPE, binary=sys.argv[2] == "True", flush_every=int(sys.argv[3]))
try:
    for _ in range(1000):
        recording.write(PACKAGES[0])
except RecordingError as error:
    print(recording.packages, error)
recording.close()
"""


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("flush_every", [1, 7])
def test_a_file_that_may_not_grow_ends_with_the_last_whole_package(
    tmp_path: Path, binary: bool, flush_every: int
) -> None:
    """The system's limit of file sizes refuses as a full disk does: a part of a write succeeds, the next fails."""
    path = tmp_path / "robot_data"
    done = subprocess.run(
        [sys.executable, "-c", _RECORD, str(path), str(binary), str(flush_every)],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    count, message = done.stdout.rstrip("\n").split(" ", 1)
    assert message == f"{path}: File too large; the file has {count} rows, all of them whole"
    with open_recording(path) as recording:
        assert list(recording) == [PACKAGES[0]] * int(count)
        assert recording.torn == ""
    row = path.stat().st_size // int(count)
    assert 5000 - row < path.stat().st_size <= 5000


def test_a_disk_that_is_full(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=16k", "tmpfs", disk], capture_output=True, check=False
    )
    if mounted.returncode != 0:
        pytest.skip("no file system can be mounted here")
    try:
        script = _RECORD.replace("(5000, 5000)", "(1 << 20, 1 << 20)")
        done = subprocess.run(
            [sys.executable, "-c", script, disk / "robot_data.csv", "False", "7"],
            capture_output=True,
            text=True,
            check=True,
            timeout=60,
        )
        count, message = done.stdout.rstrip("\n").split(" ", 1)
        assert "No space left on device" in message
        with open_recording(disk / "robot_data.csv") as recording:
            assert (len(list(recording)), recording.torn) == (int(count), "")
    finally:
        subprocess.run(["umount", disk], check=True)


def test_what_was_flushed_outlives_the_process(tmp_path: Path) -> None:
    path = tmp_path / "robot_data.csv"
    script = _RECORD.replace("recording.close()", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    script = script.replace("range(1000)", "range(5)")
    done = subprocess.run([sys.executable, "-c", script, path, "False", "2"], check=False, timeout=60)
    assert done.returncode == -9
    with open_recording(path) as recording:
        assert len(list(recording)) == 4


def test_a_place_where_nothing_can_be_written(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be written: No such file or directory"):
        create_recording(tmp_path / "no" / "x.csv", RECIPE)
    with pytest.raises(RecordingError, match="cannot be written: embedded null byte"):
        create_recording("x\0.csv", RECIPE)
