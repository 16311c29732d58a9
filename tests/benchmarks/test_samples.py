"""Samples are repeated while the machine is disturbed, never for ever, and what was left out is said."""

from __future__ import annotations

from collections.abc import Sequence

from tests.benchmarks.samples import MOST_REPEATS, REPEATS, Samples, disturbance
from tests.benchmarks.usage import Usage

QUIET = Usage(wall=1.0, cpu=0.5, switches=7)
NOISY = Usage(wall=1.0, cpu=0.5, switches=900, others=0.8)
STOLEN = Usage(wall=1.0, cpu=0.5, switches=9, steal=0.05)


def _samples(noise: Sequence[Usage]) -> Samples:
    """What the samples meet, one after the other; each is looked at before it and after it."""
    looks = iter([look for one in noise for look in (Usage(), one)])
    return Samples(lambda _: next(looks))


def test_a_quiet_sample_counts_at_once() -> None:
    samples = _samples([QUIET])
    assert samples.take("row", 1, iter("ab").__next__) == "a"
    assert samples.noise("row") == ("0.0%", "0%", "7")
    assert samples.note.startswith("0 of 1 samples left out as disturbed; load ")


def test_a_disturbed_sample_is_repeated() -> None:
    samples = _samples([NOISY, STOLEN, QUIET])
    assert samples.take("row", 1, iter("abc").__next__) == "c"
    assert (samples.taken, samples.left_out, samples.disturbed) == (3, 2, 0)


def test_the_quietest_counts_if_none_is_quiet_and_the_note_says_so() -> None:
    samples = _samples([NOISY, STOLEN, NOISY])
    assert samples.take("row", 1, iter("abc").__next__) == "b"
    assert samples.noise("row") == ("5.0%", "0%", "9")
    assert "1 that count are DISTURBED" in samples.note


def test_a_row_shows_the_worst_of_its_samples() -> None:
    samples = _samples([QUIET, Usage(wall=2.0, switches=200, others=0.1)])
    for _ in range(2):
        samples.take("row", 1, lambda: None)
    assert samples.noise("row") == ("0.0%", "5%", "100")


def test_a_machine_that_is_never_quiet_costs_a_bounded_number_of_repeats() -> None:
    count = 100
    samples = _samples([NOISY] * (count + MOST_REPEATS))
    for _ in range(count):
        samples.take("row", 1, lambda: None)
    assert samples.left_out == MOST_REPEATS
    assert samples.taken == count + MOST_REPEATS
    assert MOST_REPEATS > REPEATS


def test_disturbed_is_more_than_one_of_the_two_limits() -> None:
    assert disturbance(QUIET) == 0
    assert disturbance(Usage(wall=1.0, others=0.1)) <= 1 < disturbance(Usage(wall=1.0, others=0.11))
    assert disturbance(Usage(wall=1.0, steal=0.01)) <= 1 < disturbance(STOLEN)


def test_a_row_without_samples_has_no_noise() -> None:
    assert _samples([]).noise("row") == ("-", "-", "-")
