"""Mangled streams: reproducible, and never out of order. Connections closed at a named step."""

from __future__ import annotations

import math

import pytest

from gatewayd.rtde.fields import INPUTS
from gatewayd.simulator.faults import ADAPTER_FIELDS, DropAt, Faults, FaultStep, Mangler

PACKAGES = [bytes([n]) * 8 for n in range(200)]


def stream(faults: Faults, connection: int = 1) -> list[bytes]:
    mangler = Mangler(faults, connection)
    return [*map(mangler.mangle, PACKAGES), mangler.flush()]


def test_nothing_is_mangled_by_default() -> None:
    assert not Faults().mangles
    assert stream(Faults()) == [*PACKAGES, b""]


def test_splitting_delays_but_loses_nothing() -> None:
    sent = stream(Faults(split=0.5, seed=3))
    assert b"".join(sent) == b"".join(PACKAGES)
    assert sent[:-1] != PACKAGES


def test_duplicates_follow_their_original() -> None:
    sent = b"".join(stream(Faults(duplicate=0.5, split=0.5)))
    numbers = list(sent[::8])
    assert sent == b"".join(PACKAGES[n] for n in numbers)
    assert sorted(numbers) == numbers
    assert set(numbers) == set(range(200))
    assert len(numbers) > 250


def test_dropped_packages_are_lost_whole() -> None:
    numbers = b"".join(stream(Faults(drop=0.5, split=0.5)))[::8]
    assert 50 < len(numbers) < 150
    assert sorted(numbers) == list(numbers)


def test_a_seed_repeats_and_connections_differ() -> None:
    faults = Faults(drop=0.3, seed=9)
    assert stream(faults) == stream(faults)
    assert stream(faults) != stream(faults, 2)
    assert stream(faults) != stream(Faults(drop=0.3, seed=10))


def test_an_adapter_claims_inputs_that_exist() -> None:
    assert set(ADAPTER_FIELDS) <= set(INPUTS)
    assert len(ADAPTER_FIELDS) == 12 + 2 + 24 + 24


@pytest.mark.parametrize(
    "text, parsed",
    [
        ("outputs", DropAt(FaultStep.OUTPUTS)),
        ("inputs:2", DropAt(FaultStep.INPUTS, 2)),
        ("data:10", DropAt(FaultStep.DATA, 10)),
    ],
)
def test_a_step_to_drop_at(text: str, parsed: DropAt) -> None:
    assert DropAt.parse(text) == parsed


@pytest.mark.parametrize("text", ["", "output", "outputs:0", "outputs:x", "outputs:-1"])
def test_no_step_to_drop_at(text: str) -> None:
    with pytest.raises(ValueError, match="is not STEP or STEP:NUMBER"):
        DropAt.parse(text)


@pytest.mark.parametrize("times", [0, 1, 2, math.inf])
def test_a_drop_comes_as_often_as_it_should(times: float) -> None:
    faults = Faults(drop_at=DropAt(FaultStep.START, 2), drop_times=times)
    assert not faults.drops(FaultStep.START, 1)
    assert not faults.drops(FaultStep.PAUSE, 2)
    assert [faults.drops(FaultStep.START, 2) for _ in range(3)] == [times >= n for n in (1, 2, 3)]
