from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.cli.rtde.progress import Tally, progress_line, reading_line, size_text, summary


def test_a_recording_that_runs_well() -> None:
    tally = Tally(12.2, 6000, 1_300_000, 499.8)
    assert progress_line(tally) == "12 s   6000 packages   500 Hz   1.3 MB   none skipped"
    assert summary("a.csv", tally, "a.csv.gaps") == "a.csv: 6000 packages in 12 s, 1.3 MB, none skipped"


def test_what_is_missing_is_said() -> None:
    tally = Tally(3.0, 1, 999, 125.0, skipped=7, gaps=2, left_out=4, waiting="waiting for the condition")
    assert progress_line(tally) == "3 s   1 package   125 Hz   999 B   7 skipped   waiting for the condition"
    assert summary("a.csv", tally, "a.csv.gaps") == (
        "a.csv: 1 package in 3 s, 999 B, 7 skipped, 4 left out by the condition; see a.csv.gaps"
    )
    unknown = Tally(gaps=1)
    assert progress_line(unknown).endswith("1 gap")
    assert summary("a", unknown, "a.gaps").endswith("1 gap; see a.gaps")


def test_how_far_the_reading_of_a_file_is() -> None:
    assert reading_line(420, 1000, 6000) == " 42%, 6000 packages"
    assert reading_line(0, 0, 0) == "100%, no packages"


@given(st.integers(0, 10**18))
def test_a_size_is_short_and_right(size: int) -> None:
    number, unit = size_text(size).split()
    scale = {"B": 1, "kB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12}[unit]
    assert abs(float(number) * scale - size) <= 0.051 * scale
    assert float(number) <= 1000 or unit == "TB"
