"""A short soak run with some of the faults; `make soak` is the long one."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

import pytest

from tests.soak.faults import FAULTS
from tests.soak.look import torn
from tests.soak.run import kinds, soak
from tests.soak.verdict import MEMORY_BOUND, THREADS_BOUND, Measured, Sample

SECONDS = float(os.environ.get("GATEWAYD_SOAK_SECONDS", "20"))
SEED = 4


@pytest.mark.timeout(SECONDS + 100)
def test_every_fault_is_recovered_and_nothing_is_left_behind(tmp_path: Path) -> None:
    measured = soak(tmp_path, SECONDS, SEED, "fast", print)
    print(*measured.tables(), sep="\n\n")
    assert measured.verdict() == []
    assert len(measured.recoveries) >= min(len(FAULTS), 5)


def test_a_seed_makes_the_same_faults_and_every_kind_comes_in_turn() -> None:
    count = 3 * len(FAULTS)

    def drawn(seed: int) -> list[tuple[str, float]]:
        return [(kind, chance.random()) for kind, chance in itertools.islice(kinds(seed), count)]

    assert drawn(1) == drawn(1) != drawn(2)
    assert [kind for kind, _ in sorted(drawn(1))] == sorted([*FAULTS] * 3)


def test_a_line_of_the_audit_that_was_cut_short_is_seen(tmp_path: Path) -> None:
    """But not the last one: it may be in the making."""
    audit = tmp_path / "audit.jsonl"
    audit.write_text('{"what": 1}\n{"wh{"what": 2}\n{"what": 3}\n{"wh', "utf-8")
    assert torn(audit) == ['{"wh{"what": 2}']


def good(kilobytes: int = 0) -> Measured:
    """Forty samples, the memory growing by so much from each to the next; all else as it should be."""
    samples = [Sample(float(at), 50_000 + at * kilobytes, 14, 2) for at in range(40)]
    return Measured({"garbage": [0.1]}, samples=samples, descriptors_at_end=14)


def test_a_good_run_has_nothing_to_tell() -> None:
    assert good().verdict() == []


def test_a_run_that_measured_nothing_is_not_good() -> None:
    assert Measured().verdict() == ["nothing was measured"]


def test_growing_memory_is_told_with_its_slope() -> None:
    step = MEMORY_BOUND // 20
    assert good(step - 50).verdict() == []
    (told,) = good(step + 50).verdict()
    assert "memory grew" in told
    assert round(good(10).slope) == 36_000


def test_threads_may_become_a_few_more() -> None:
    measured = good()
    for more, told in ((THREADS_BOUND, []), (THREADS_BOUND + 1, ["threads grew from 2 to 7"])):
        measured.samples[-1] = Sample(40.0, 50_000, 14, 2 + more)
        assert measured.verdict() == told


def test_growing_descriptors_leaked_locks_and_failures_are_told() -> None:
    measured = good()
    measured.descriptors_at_end = 15
    measured.leaked = ["shared", "shared"]
    measured.failures = ["garbage: waited in vain"]
    assert measured.verdict() == [
        "garbage: waited in vain",
        "descriptors grew from 14 to 15",
        "locks without a living owner, or forces that stayed: shared",
    ]
