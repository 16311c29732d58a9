"""What is missing in a recording, and where it is said."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording import (
    GapWatch,
    GapWriter,
    RecordedGap,
    RecordingError,
    RecordingExistsError,
    read_gaps,
)

WITH_TIME = Recipe(["robot_mode", "timestamp"], [OUTPUTS[name].type for name in ("robot_mode", "timestamp")])
WITHOUT = Recipe(["robot_mode"], [OUTPUTS["robot_mode"].type])


def test_packages_in_time_have_no_gap() -> None:
    watch = GapWatch(WITH_TIME, 0.008)
    assert [watch.check((7, 100 + 0.008 * number)) for number in range(1000)] == [None] * 1000


def test_missing_packages_are_counted_by_the_timestamps() -> None:
    watch = GapWatch(WITH_TIME, 0.002)
    found = [watch.check((7, time)) for time in (1.0, 1.002, 1.012, 1.014)]
    assert found == [None, None, RecordedGap(2, "skipped", 4, 1.002, 1.012), None]


def test_a_loss_ends_with_the_next_package() -> None:
    watch = GapWatch(WITH_TIME, 0.002)
    watch.check((7, 1.0))
    watch.lost("connection reset by peer")
    assert watch.check((7, 3.0), 17.5) == RecordedGap(1, "connection reset by peer", 999, 1.0, 3.0, 17.5)
    assert watch.check((7, 3.002)) is None


@pytest.mark.parametrize("after", [0.002, float("nan"), float("inf")])
def test_a_controller_that_was_restarted_counts_anew(after: float) -> None:
    watch = GapWatch(WITH_TIME, 0.002)
    watch.check((7, 1000.0))
    gap = watch.check((7, after))
    assert gap is not None
    assert (gap.reason, gap.missing, gap.before) == ("timestamp went back", None, 1000.0)


def test_without_timestamps_only_what_was_reported_is_known() -> None:
    watch = GapWatch(WITHOUT, 0.002)
    watch.lost("before the first package")
    assert watch.check((7,)) is None
    assert watch.check((7,)) is None
    watch.lost("timed out")
    assert watch.check((7,)) == RecordedGap(2, "timed out")


def test_without_a_period_packages_may_come_when_they_like() -> None:
    watch = GapWatch(WITH_TIME, None)
    assert [watch.check((7, time)) for time in (1.0, 2.0, 30.0)] == [None] * 3


_NUMBERS = st.none() | st.floats(allow_nan=False, allow_infinity=False)
_GAPS = st.builds(
    RecordedGap,
    package=st.integers(0, 10**9),
    reason=st.text(),
    missing=st.none() | st.integers(0, 10**9),
    before=_NUMBERS,
    after=_NUMBERS,
    host_time=_NUMBERS,
)


@given(st.lists(_GAPS, max_size=5))
def test_what_is_written_is_read(gaps: list[RecordedGap]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot_data.csv"
        with GapWriter(path) as writer:
            for gap in gaps:
                writer.write(gap)
        assert read_gaps(path) == tuple(gaps)
        assert path.with_name("robot_data.csv.gaps.jsonl").exists() == bool(gaps)
        assert (writer.count, writer.missing) == (len(gaps), sum(gap.missing or 0 for gap in gaps))


def test_the_gaps_of_an_overwritten_recording_go(tmp_path: Path) -> None:
    path = tmp_path / "robot_data.csv"
    with GapWriter(path) as writer:
        writer.write(RecordedGap(1, "skipped"))
    with pytest.raises(RecordingExistsError, match=r"robot_data\.csv\.gaps\.jsonl: is there already"):
        GapWriter(path)
    GapWriter(path, overwrite=True).close()
    assert read_gaps(path) == ()


def test_a_last_line_that_is_cut_off_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "x.gaps.jsonl").write_text('{"package": 1, "reason": "skipped"}\n{"package": 2, "rea')
    assert read_gaps(tmp_path / "x") == (RecordedGap(1, "skipped"),)


@pytest.mark.parametrize(
    "line",
    [
        "1",
        "{}",
        "[",
        '{"package": "1", "reason": "x"}',
        '{"package": 1, "reason": "x", "missing": 1.5}',
        "[" * 10**5,
    ],
)
def test_a_line_that_is_no_gap(tmp_path: Path, line: str) -> None:
    path = tmp_path / "x.gaps.jsonl"
    path.write_text(f"{line}\n")
    with pytest.raises(RecordingError) as error:
        read_gaps(tmp_path / "x")
    assert str(error.value) == f"{path}:1: is no gap of a recording; strike the line"


@given(st.binary(max_size=100))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "x.gaps.jsonl").write_bytes(data)
        try:
            found = read_gaps(Path(folder) / "x")
        except RecordingError:
            return
        assert all(isinstance(gap, RecordedGap) for gap in found)
