"""The recorder alone: columns, limits, gaps, and the order of what it gets."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gatewayd.cli.rtde.conditions import ConditionError, parse_condition
from gatewayd.cli.rtde.recorder import LEFT_OUT, Recorder, RecordingOrder, SourceLayout
from gatewayd.cli.rtde.triggers import Conditions
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording import RecordingError, open_recording, read_gaps
from gatewayd.rtde.types import DataType

RECIPE = Recipe(["timestamp", "q", "io"], [DataType.DOUBLE, DataType.VECTOR3D, DataType.INT32])
LAYOUT = SourceLayout(RECIPE, 0.5)
Package = tuple[tuple[float, ...], float]


def package(number: int, io: int = 0) -> Package:
    return (100 + number / 2, number, number + 0.25, -number, io), 1e9 + number


def stamps(path: Path) -> list[float]:
    with open_recording(path) as found:
        return [(row[0] - 100) * 2 for row in found]


def recorded(order: RecordingOrder, *bursts: list[Package]) -> Recorder:
    with Recorder(order, LAYOUT) as recorder:
        for number, burst in enumerate(bursts):
            if not recorder.over:
                recorder.take(burst, float(number))
    return recorder


def test_columns_in_the_order_that_was_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    recorded(RecordingOrder(path=str(path), fields=("io", "q"), host_time=True), [package(3, 7)])
    assert path.read_text() == "io q_0 q_1 q_2 host_time\n7 3.0 3.25 -3.0 1000000003.0\n"
    one = tmp_path / "b.csv"
    recorded(RecordingOrder(path=str(one), fields=("io",)), [package(3, 7)])
    assert one.read_text() == "io\n7\n"
    with pytest.raises(
        RecordingError, match="not among the fields that come: off; there are timestamp, q, io"
    ):
        recorded(RecordingOrder(path=str(tmp_path / "c.csv"), fields=("off",)), [])
    assert not (tmp_path / "c.csv").exists()


@pytest.mark.parametrize(
    "seconds, fields, refused",
    [(99_999, 5, ""), (100_001, 5, "200000 can be kept, 1 d 3 h"), (6000, 1001, "9990")],
)
def test_a_time_before_that_cannot_be_kept_is_refused_and_leaves_no_file(
    tmp_path: Path, seconds: float, fields: int, refused: str
) -> None:
    """A package each half second; of many fields fewer are kept."""
    path = tmp_path / "a.csv"
    names = ["timestamp", *(f"f{number}" for number in range(1, fields))]
    layout = SourceLayout(Recipe(names, [DataType.DOUBLE] * fields), 0.5)
    order = RecordingOrder(path=str(path), before=seconds)
    if not refused:
        Recorder(order, layout).close()
        return
    with pytest.raises(ConditionError, match=refused):
        Recorder(order, layout)
    assert not path.exists()


def test_the_duration_counts_from_when_the_condition_held(tmp_path: Path) -> None:
    """What was before comes on top; a number of packages counts it."""
    packages = [package(number, int(number >= 6)) for number in range(30)]
    trigger = Conditions(None, parse_condition("io == 1"), None, once=False).trigger
    timed, counted = tmp_path / "a.csv", tmp_path / "b.csv"
    recorded(RecordingOrder(path=str(timed), before=2, duration=3, trigger=trigger), packages)
    assert stamps(timed) == list(range(2, 12))
    recorded(RecordingOrder(path=str(counted), before=2, samples=6, trigger=trigger), packages)
    assert stamps(counted) == list(range(2, 8))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    st.lists(st.integers(1, 9), max_size=8), st.none() | st.integers(1, 30), st.none() | st.integers(1, 30)
)
def test_limits_hold_to_the_package_however_they_come(
    tmp_path: Path, bursts: list[int], samples: int | None, periods: int | None
) -> None:
    path, first, given_bursts = tmp_path / "a.csv", 0, list[list[Package]]()
    for size in bursts:
        given_bursts.append([package(number) for number in range(first, first + size)])
        first += size
    duration = None if periods is None else periods / 2
    order = RecordingOrder(path=str(path), samples=samples, duration=duration, overwrite=True)
    recorder = recorded(order, *given_bursts)
    most = min(limit for limit in (samples, periods, first) if limit is not None)
    assert stamps(path) == list(range(most))
    assert recorder.tally().packages == most
    assert recorder.over is (most < first or most == samples)


def test_gaps_are_counted_and_kept_beside(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with Recorder(RecordingOrder(path=str(path)), LAYOUT) as recorder:
        recorder.take([package(0), package(1), package(4)], 0.0)
        recorder.lost("pulled")
        recorder.take([package(9)], 1.0)
        tally = recorder.tally()
    assert [(gap.package, gap.reason, gap.missing) for gap in read_gaps(path)] == [
        (2, "skipped", 2),
        (3, "pulled", 4),
    ]
    assert (tally.packages, tally.skipped, tally.gaps, tally.left_out) == (4, 6, 2, 0)
    assert tally.seconds == 4.5


def test_what_a_condition_leaves_out_is_no_loss(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    order = RecordingOrder(
        path=str(path),
        trigger=Conditions(parse_condition("io == 1"), None, None, once=False).trigger,
        before=1.0,
    )
    recorder = recorded(order, [package(number, number in {5, 6, 15}) for number in range(20)])
    assert stamps(path) == [3, 4, 5, 6, 13, 14, 15]
    assert [(gap.package, gap.reason, gap.missing) for gap in read_gaps(path)] == [(4, LEFT_OUT, 6)]
    tally = recorder.tally()
    assert (tally.skipped, tally.gaps, tally.left_out) == (0, 0, 6)
    assert recorder.waiting


def test_the_time_ends_though_nothing_comes_or_the_clock_stands_still(tmp_path: Path) -> None:
    order = RecordingOrder(path=str(tmp_path / "a.csv"), duration=3.0)
    with Recorder(order, LAYOUT) as recorder:
        recorder.look(1000.0)
        assert not recorder.over, "it has not begun"
        recorder.take([package(0), package(0)], 1000.0)
        recorder.look(1003.5)
        assert not recorder.over
        recorder.look(1004.5)
        assert recorder.over


def test_without_a_timestamp_everything_is_recorded(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with Recorder(
        RecordingOrder(path=str(path)), SourceLayout(Recipe(["x"], [DataType.INT32]), 0.5)
    ) as recorder:
        recorder.take([((number,), 0.0) for number in range(3)], 0.0)
        recorder.lost("pulled")
        recorder.take([((3,), 0.0)], 0.0)
    assert path.read_text() == "x\n0\n1\n2\n3\n"
    assert [(gap.package, gap.reason) for gap in read_gaps(path)] == [(3, "pulled")]


def test_a_package_that_finds_no_room_is_in_no_gap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A row is cut off again where the disk is full; the gap before it goes too."""
    path = tmp_path / "a.csv"
    write, room = os.pwrite, 200

    def limited(file: int, data: bytes, offset: int) -> int:
        if Path(f"/proc/self/fd/{file}").readlink() != path:
            return write(file, data, offset)
        if offset >= room:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data[: room - offset], offset)

    monkeypatch.setattr(os, "pwrite", limited)
    recorder = Recorder(RecordingOrder(path=str(path)), LAYOUT)
    with pytest.raises(RecordingError, match="No space left on device"):
        recorder.take([package(number * 3) for number in range(50)], 0.0)
    recorder.close()
    monkeypatch.undo()
    count = len(stamps(path))
    assert 1 < count < 50
    assert [gap.package for gap in read_gaps(path)] == list(range(1, count))
