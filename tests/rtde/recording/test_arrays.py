"""Recordings as arrays of numpy."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gatewayd.rtde.recording import MissingExtraError, RecordingError, create_recording, read_arrays
from tests.rtde.recording.samples import HEADER, LINES, PACKAGES, RECIPE


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("host_time", [False, True])
def test_fields_have_their_shapes_types_and_values(tmp_path: Path, binary: bool, host_time: bool) -> None:
    path = tmp_path / "x"
    with create_recording(path, RECIPE, binary=binary, host_time=host_time) as recording:
        for number, values in enumerate(PACKAGES):
            recording.write(values, 17.5 + number)
    found = read_arrays(path)
    assert {
        name: (value.shape, value.dtype.name) for name, value in found.items() if name != "host_time"
    } == {
        "timestamp": ((2,), "float64"),
        "actual_q": ((2, 6), "float64"),
        "actual_digital_input_bits": ((2,), "uint64"),
        "robot_mode": ((2,), "int32"),
        "joint_mode": ((2, 6), "int32"),
        "runtime_state": ((2,), "uint32"),
        "elbow_position": ((2, 3), "float64"),
        "tool_output_mode": ((2,), "uint8"),
        "output_bit_register_64": ((2,), "bool"),
    }
    assert found["actual_digital_input_bits"][0] == 2**64 - 1
    assert found["actual_q"][0].tolist() == list(PACKAGES[0][1:7])
    assert ("host_time" in found) == host_time
    if host_time:
        assert found["host_time"].tolist() == [17.5, 18.5]


def test_they_are_what_numpy_reads_itself(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_text("".join(f"{line}\n" for line in (HEADER, *LINES)))
    table = np.loadtxt(path, skiprows=1)
    found = read_arrays(path)
    columns = np.column_stack([found[name] for name in RECIPE.names])
    assert np.array_equal(columns, table)


def test_only_while_a_program_ran(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_text("".join(f"{line}\n" for line in (HEADER, *LINES)))
    assert read_arrays(path, running=True)["timestamp"].tolist() == [1234.002]
    path.write_text("timestamp\n0.5\n")
    with pytest.raises(RecordingError, match="has neither runtime_state nor robot_status_bits"):
        read_arrays(path, running=True)


def test_a_recording_without_packages(tmp_path: Path) -> None:
    create_recording(tmp_path / "x", RECIPE).close()
    assert read_arrays(tmp_path / "x")["actual_q"].shape == (0, 6)


def test_without_numpy_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numpy", None)
    with pytest.raises(MissingExtraError) as error:
        read_arrays(tmp_path / "x")
    expected = "Reading a recording as arrays needs the package numpy, which is not installed: pip install"
    assert str(error.value) == f"{expected} 'gatewayd[numpy]'"


def test_packages_of_extras_are_imported_only_where_they_are_used() -> None:
    script = "import sys, gatewayd.rtde.recording; print({'numpy', 'arro3', 'matplotlib'} & set(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout == "set()\n"
