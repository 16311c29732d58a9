"""`gatewayd rtde convert` as a person uses it."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli import command
from gatewayd.rtde.recording import GapWriter, RecordedGap, open_recording, read_gaps


def convert(*arguments: object) -> Result:
    return CliRunner().invoke(command, ["rtde", "convert", *map(str, arguments)], prog_name="gatewayd")


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "robot_data.csv"
    path.write_text("timestamp robot_mode\n" + "".join(f"{number / 500} 7\n" for number in range(1000)))
    return path


@pytest.mark.parametrize("name", ["x.parquet", "x.bin", "x.txt"])
def test_the_name_says_the_format(source: Path, tmp_path: Path, name: str) -> None:
    target = tmp_path / name
    done = convert(source, target)
    assert done.exit_code == 0
    assert done.stdout.startswith(f"{target}: 1000 packages, ")
    assert done.stdout.endswith(f" ({source}: {source.stat().st_size / 1000:.1f} kB)\n")
    with open_recording(source) as first, open_recording(target) as second:
        assert list(first) == list(second)


def test_delimiters_have_words(source: Path, tmp_path: Path) -> None:
    assert convert("--delimiter", "tab", source, tmp_path / "x.csv").exit_code == 0
    assert (tmp_path / "x.csv").read_text().startswith("timestamp\trobot_mode\n0.0\t7\n")
    assert (
        convert(
            "--delimiter", ";", "--input-delimiter", "tab", tmp_path / "x.csv", tmp_path / "y.csv"
        ).exit_code
        == 0
    )
    assert (tmp_path / "y.csv").read_text().startswith("timestamp;robot_mode\n0.0;7\n")
    refused = convert("--delimiter", ".", source, tmp_path / "z.csv")
    assert refused.exit_code == 2
    assert "'.' cannot separate columns" in refused.stderr


def test_a_delimiter_of_what_is_no_text_is_wrong_usage(source: Path, tmp_path: Path) -> None:
    refused = convert("--delimiter", "tab", source, tmp_path / "x.bin")
    assert refused.exit_code == 2
    assert "x.bin is to be binary" in " ".join(refused.stderr.split())
    assert not (tmp_path / "x.bin").exists()


def test_gaps_go_along(source: Path, tmp_path: Path) -> None:
    with GapWriter(source) as gaps:
        gaps.write(RecordedGap(3, "skipped", 2))
    convert(source, tmp_path / "x.bin")
    assert read_gaps(tmp_path / "x.bin") == (RecordedGap(3, "skipped", 2),)


def test_an_existing_file_wants_force(source: Path, tmp_path: Path) -> None:
    target = tmp_path / "x.bin"
    target.write_text("precious")
    refused = convert(source, target)
    assert (refused.exit_code, target.read_text()) == (2, "precious")
    assert (
        refused.stderr == f"{target}: is there already; choose another name, or overwrite it with --force\n"
    )
    assert convert("--force", source, target).exit_code == 0


def test_a_name_that_stands_for_no_format(source: Path, tmp_path: Path) -> None:
    refused = convert(source, tmp_path / "x")
    assert refused.exit_code == 2
    assert "stands for no format: choose one with --format" in refused.stderr
    assert convert("--format", "binary", source, tmp_path / "x").exit_code == 0


def test_what_cannot_be_read_is_said_and_leaves_nothing(source: Path, tmp_path: Path) -> None:
    source.write_text(source.read_text() + "17 7 7\n")
    done = convert(source, tmp_path / "x.bin")
    assert done.exit_code == 1
    assert done.stderr == f"{source}:1002: 3 columns, where the first line has 2\n"
    assert [path.name for path in tmp_path.iterdir()] == [source.name]


def test_a_torn_end_is_reported_and_no_failure(source: Path, tmp_path: Path) -> None:
    source.write_text(source.read_text() + "17")
    done = convert(source, tmp_path / "x.bin")
    assert done.exit_code == 0
    assert done.stderr == f"{source}:1002: the last line is not whole and was left out\n"
    assert "1000 packages" in done.stdout


def test_without_the_package_for_parquet(
    source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "arro3", None)
    done = convert(source, tmp_path / "x.parquet")
    assert done.exit_code == 2
    assert "pip install 'gatewayd[parquet]'" in done.stderr


CONVERT = """
import resource, sys
from gatewayd.__main__ import main
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv.pop()),) * 2)
main()
"""


@pytest.mark.parametrize("name", ["x.parquet", "x.bin", "x.txt"])
def test_a_disk_that_is_full_leaves_nothing(source: Path, tmp_path: Path, name: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", CONVERT, "rtde", "convert", source, tmp_path / name, "1000"],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert "File too large" in done.stderr
    assert done.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == [source.name]


@pytest.mark.parametrize("name", ["x.parquet", "x.bin"])
def test_ctrl_c_leaves_nothing(source: Path, tmp_path: Path, name: str) -> None:
    with source.open("a") as file:
        file.writelines(f"{number / 500} 7\n" for number in range(1_000_000))
    process = subprocess.Popen(
        [sys.executable, "-m", "gatewayd", "rtde", "convert", source, tmp_path / name],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while not list(tmp_path.glob("*.part")):
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    printed, error = process.communicate(timeout=60)
    assert (process.returncode, printed, error) == (130, "", "\n")
    assert [path.name for path in tmp_path.iterdir()] == [source.name]


def test_no_recording(tmp_path: Path) -> None:
    assert "does not exist" in convert(tmp_path / "no", tmp_path / "x.csv").stderr
    (tmp_path / "empty").touch()
    done = convert(tmp_path / "empty", tmp_path / "x.csv")
    assert (done.exit_code, done.stderr.count("\n")) == (1, 1)
