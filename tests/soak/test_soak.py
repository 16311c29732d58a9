"""A short soak run with some of the faults; `make soak` is the long one."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.e2e.processes import wait_for
from tests.e2e.witness import Change
from tests.soak.faults import FAULTS, ROUND
from tests.soak.journal import SENT, Entry, Journal, entries
from tests.soak.look import torn
from tests.soak.run import kinds, soak
from tests.soak.starvation import Starvation
from tests.soak.truth import FALLBACK, Period, Record, Stop, misheld, unheard
from tests.soak.verdict import MEMORY_BOUND, THREADS_BOUND, Measured, Sample

SECONDS = float(os.environ.get("GATEWAYD_SOAK_SECONDS", "10"))
SEED = 4


@pytest.mark.timeout(SECONDS + 100)
def test_every_fault_is_recovered_and_nothing_is_left_behind(tmp_path: Path) -> None:
    measured = soak(tmp_path, SECONDS, SEED, "fast", print)
    print(*measured.tables(), sep="\n\n")
    assert measured.verdict() == []
    assert len(measured.recoveries) >= min(len(FAULTS), 5)


def test_a_seed_makes_the_same_faults_and_every_kind_comes_in_turn() -> None:
    count = 3 * len(ROUND)

    def drawn(seed: int) -> list[tuple[str, float]]:
        return [(kind, chance.random()) for kind, chance in itertools.islice(kinds(seed), count)]

    assert drawn(1) == drawn(1) != drawn(2)
    assert [kind for kind, _ in sorted(drawn(1))] == sorted(ROUND * 3)


def test_a_line_of_the_audit_that_was_cut_short_is_seen(tmp_path: Path) -> None:
    """But not the last one: it may be in the making."""
    audit = tmp_path / "audit.jsonl"
    audit.write_text('{"what": 1}\n{"wh{"what": 2}\n{"what": 3}\n{"wh', "utf-8")
    assert torn(audit) == ['{"wh{"what": 2}']


A, B = "input_int_register_0", "input_int_register_1"


def test_a_journal_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "plc.journal"
    assert list(entries(path)) == []
    journal = Journal(str(path))
    journal.note(A, 7)
    journal.note(A, 7, 6)
    sent, answered = entries(path)
    assert (sent.field, sent.value, sent.outcome) == (A, 7, SENT)
    assert (answered.outcome, answered.time >= sent.time) == (6, True)


def sent(time: float, value: float) -> Entry:
    return Entry(time, A, value, SENT)


@pytest.mark.parametrize(
    "change, record, found",
    [
        (Change(10.1, 7, 0.0), Record(), []),
        (Change(99.0, 0, 0.0), Record(), []),
        (Change(10.1, 8, 0.0), Record(), ["nobody wrote"]),
        (Change(9.9, 7, 0.0), Record(), ["nobody wrote"]),
        (Change(13.0, 7, 0.0), Record(), ["3.0 s after"]),
        (Change(13.0, 7, 2.5), Record(), []),
        (Change(13.0, 7, 0.0), Record(pauses=[Period(10.0, 12.9, [A])]), []),
        (Change(13.0, 7, 0.0), Record(pauses=[Period(10.0, 12.9, [B])]), ["3.0 s after"]),
        (Change(13.0, 8, 0.0), Record([Period(12.0, 14.0, [A], 8)]), []),
        (Change(13.0, 9, 0.0), Record([Period(12.0, 14.0, [A], 8)]), ["nobody wrote"]),
        (Change(13.0, 9, 0.0), Record([Period(12.0, 14.0, [A])]), []),
        (Change(14.5, 9, 0.0), Record([Period(12.0, 14.0, [A])]), ["nobody wrote"]),
    ],
    ids=str,
)
def test_what_the_robot_held_must_have_been_written_lately(
    change: Change, record: Record, found: list[str]
) -> None:
    """Or be declared, or be the operator's, or have come when nobody looked."""
    lies = list(misheld(A, [change], [sent(10.0, 7), Entry(10.0, A, 7, 0)], record))
    assert len(lies) == len(found)
    assert all(part in line for part, line in zip(found, lies, strict=True))


@pytest.mark.parametrize(
    "changes, outcome, watched, count",
    [
        ([Change(10.05, 7, 0.0)], 0, True, 0),
        ([Change(9.0, 7, 0.0)], 0, True, 0),
        ([Change(9.0, 6, 0.0)], 0, True, 1),
        ([], 0, True, 1),
        ([], 0, False, 0),
        ([], 6, True, 0),
        ([Change(10.02, 8, 0.0)], 0, True, 0),
        ([Change(10.2, 8, 0.0)], 0, True, 1),
        ([Change(10.06, 8, 0.04)], 0, True, 0),
    ],
)
def test_what_was_acknowledged_must_have_been_there(
    changes: list[Change], outcome: int, watched: bool, count: int
) -> None:
    """Unless nobody looked, or the next value took its place at once."""
    written = [sent(10.0, 7), Entry(10.01, A, 7, outcome)]
    assert len(list(unheard(A, changes, written, lambda _since, _until: watched))) == count


@pytest.mark.parametrize(
    "stop, next_change, count",
    [
        (Stop(10.015, 11.9), Change(12.0, FALLBACK, 0.0), 0),
        (Stop(10.015, 11.8), Change(12.0, 8, 0.0), 1),
        (Stop(10.015, 11.99), Change(12.0, 8, 0.0), 0),
        (Stop(10.015, 11.5), Change(12.0, 7, 0.0), 0),
        (Stop(10.1, 11.9), Change(12.0, FALLBACK, 0.0), 1),
        (Stop(9.0, 9.4), Change(12.0, FALLBACK, 0.0), 1),
    ],
    ids=[
        "the lease ended",
        "another value came later",
        "another one came first",
        "it came late",
        "long after",
        "long before",
    ],
)
def test_a_gateway_that_is_stopped_before_its_package_may_send_something_else(
    stop: Stop, next_change: Change, count: int
) -> None:
    written = [sent(10.0, 7), Entry(10.01, A, 7, 0)]
    changes = [Change(9.5, 6, 0.0), next_change]
    assert len(list(unheard(A, changes, written, lambda _since, _until: True, [stop]))) == count


@pytest.mark.parametrize(
    "lost, count", [(10.05, 0), (10.2, 1), (9.9, 1)], ids=["breaking", "later", "before"]
)
def test_what_went_into_a_breaking_connection_is_no_lie(lost: float, count: int) -> None:
    """The next request is answered that the robot is not connected: that it is not there is visible."""
    written = [sent(10.0, 7), Entry(10.01, A, 7, 0)]
    changes = [Change(9.5, 6, 0.0)]
    assert len(list(unheard(A, changes, written, lambda _since, _until: True, lost=[lost]))) == count


@pytest.mark.parametrize("later, count", [(10.02, 0), (10.2, 1)], ids=["at once", "later"])
def test_of_two_writes_at_once_the_robot_gets_the_newer_one(later: float, count: int) -> None:
    written = [sent(10.0, 7), Entry(10.01, A, 7, 0)]
    changes = [Change(9.5, 6, 0.0), Change(10.3, 8, 0.0)]
    found = unheard(A, changes, written, lambda _since, _until: True, accepted=[10.01, later])
    assert len(list(found)) == count


def test_a_write_that_was_being_served_when_the_gateway_was_stopped_comes_late() -> None:
    """It did not wait: it had been taken already (docs/explanation/promises.md)."""
    late, written = Change(16.2, 7, 0.0), [sent(10.0, 7)]
    assert not list(misheld(A, [late], written, Record(stops=[Stop(10.001, 16.19)])))
    assert list(misheld(A, [late], written, Record(stops=[Stop(9.9, 16.19)])))
    assert list(misheld(A, [late], written, Record(stops=[Stop(10.001, 12.0)])))


def test_a_value_that_is_sent_again_and_again_may_be_the_one_that_was_being_served() -> None:
    """The later ones waited and were refused; the first was taken before the stop."""
    late, written = Change(13.51, 7, 0.0), [sent(10.0 + 0.05 * number, 7) for number in range(17)]
    assert not list(misheld(A, [late], written, Record(stops=[Stop(10.01, 13.5)])))
    assert list(misheld(A, [late], written, Record(stops=[Stop(9.5, 13.5)])))
    assert list(misheld(A, [late], written, Record()))


def test_a_process_that_does_not_get_the_processor_stands_still() -> None:
    core = str(min(os.sched_getaffinity(0)))
    burning = ["taskset", "-c", core, sys.executable, "-c", "while True: pass"]
    # So many that one waits for longer than the watcher's least: by turns of 3 ms, two others would not do.
    burners = [subprocess.Popen(burning) for _ in range(14)]
    stops: list[Stop] = []
    watcher = Starvation(lambda: [burners[0].pid], stops)
    watcher.start()
    try:
        wait_for(lambda: bool(stops), "others on its core to keep a process waiting")
    finally:
        watcher.stop()
        for burner in burners:
            burner.kill()
            burner.wait()
    assert all(stop.end > stop.begin for stop in stops)


def test_lies_are_reported_but_not_all_of_them() -> None:
    measured = good()
    measured.lies = [f"lie {number}" for number in range(30)]
    verdict = measured.verdict()
    assert verdict[0] == "lie 0"
    assert verdict[-1] == "and 10 more of what the robot held"


def good(kilobytes: int = 0) -> Measured:
    """Forty samples, the memory growing by so much from each to the next; all else as it should be."""
    samples = [Sample(float(at), 50_000 + at * kilobytes, 14, 2) for at in range(40)]
    return Measured({"garbage": [0.1]}, samples=samples, descriptors_at_end=14)


def test_a_good_run_has_nothing_to_report() -> None:
    assert good().verdict() == []


def test_a_run_that_measured_nothing_is_not_good() -> None:
    assert Measured().verdict() == ["nothing was measured"]


def test_growing_memory_is_reported_with_its_slope() -> None:
    step = MEMORY_BOUND // 20
    assert good(step - 50).verdict() == []
    (complaint,) = good(step + 50).verdict()
    assert "memory grew" in complaint
    assert round(good(10).slope) == 36_000


def test_threads_may_become_a_few_more() -> None:
    measured = good()
    for more, verdict in ((THREADS_BOUND, []), (THREADS_BOUND + 1, ["threads grew from 2 to 7"])):
        measured.samples[-1] = Sample(40.0, 50_000, 14, 2 + more)
        assert measured.verdict() == verdict


def test_growing_descriptors_leaked_locks_and_failures_are_reported() -> None:
    measured = good()
    measured.descriptors_at_end = 15
    measured.leaked = ["shared", "shared"]
    measured.failures = ["garbage: waited in vain"]
    assert measured.verdict() == [
        "garbage: waited in vain",
        "descriptors grew from 14 to 15",
        "locks without a living owner, or forces that stayed: shared",
    ]
