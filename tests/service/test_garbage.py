"""When garbage is looked for: hardly while a command starts, as usual while a daemon serves, without what stays."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest

from gatewayd.service import garbage


@pytest.fixture(autouse=True)
def _as_before() -> Iterator[None]:
    threshold = gc.get_threshold()
    yield
    gc.unfreeze()
    gc.set_threshold(*threshold)


def test_a_start_is_not_interrupted_for_it() -> None:
    garbage.begin()
    assert gc.get_threshold()[0] > 700
    assert gc.isenabled()


def test_what_serves_collects_as_usual_and_looks_at_nothing_that_stays() -> None:
    usual = gc.get_threshold()
    garbage.begin()
    garbage.serve()
    assert gc.get_threshold() == usual
    assert gc.get_freeze_count() > 0


def test_an_end_looks_at_nothing() -> None:
    garbage.end()
    assert gc.get_freeze_count() > 0
