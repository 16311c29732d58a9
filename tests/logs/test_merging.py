"""A log under floods of every kind: bounded, and nothing is lost uncounted."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator

import pytest

from gatewayd.logs import merging
from gatewayd.logs.merging import EACH, OF_ONE_TEXT, PERIOD
from gatewayd.logs.records import fields
from tests.logs.written import Log, written_log

log = logging.getLogger("gatewayd.test")


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> Iterator[Log]:
    with written_log(monkeypatch) as log_:
        yield log_


def test_texts_of_a_controller_that_talks_are_few_lines(written: Log) -> None:
    for number in range(300):
        log.warning("the controller says", extra=fields(cell="press", text=f"pose {number}"))
    assert len(written.lines()) == EACH
    written.now += PERIOD
    written.flush()
    assert written.lines()[-1]["merged"] == 300 - EACH
    assert written.lines()[-1]["text"] == "pose 299"


def test_wrong_tokens_are_few_lines_whatever_is_asked_for(written: Log) -> None:
    for number in range(9000):
        written.now += 1 / 3000
        peer = f"192.0.2.7:{number % 60_000}"
        log.warning("a request without the right token", extra=fields(peer=peer, path=f"/{number}"))
        written.flush()
    assert len(written.lines()) <= EACH + 1
    written.now += PERIOD
    written.flush()
    assert written.count() == 9000


def test_peers_are_told_apart_by_their_address_alone(written: Log) -> None:
    for peer in ("192.0.2.7:{}", "192.0.2.8:{}", "[fe80::1]:{}", "[fe80::2]:{}", "fe80::3", "fe80::4"):
        for port in range(2 * EACH):
            log.warning("refused", extra=fields(peer=peer.format(port)))
    assert len(written.lines()) == 6 * EACH


def test_what_differs_is_written_one_by_one_up_to_a_bound(written: Log) -> None:
    for number in range(5000):
        log.warning("fallback applied", extra=fields(cell="press", variable=f"v{number}"))
    assert len(written.lines()) == OF_ONE_TEXT
    log.warning("robot lost", extra=fields(cell="press"))
    assert written.lines()[-1]["event"] == "robot lost", "another event is not concerned"
    written.now += PERIOD
    written.flush()
    assert written.count() == 5001


def test_a_cell_that_flaps_is_told_once_in_a_while_and_nothing_is_lost(written: Log) -> None:
    for _second in range(3600):
        written.now += 1.0
        log.warning("robot lost", extra=fields(cell="press", detail="closed"))
        written.flush()
    assert EACH <= len(written.lines()) <= EACH + 3600 / PERIOD + 2
    written.close()
    assert written.count() == 3600


def test_a_bus_that_flaps_is_the_same_whatever_its_counters_say(written: Log) -> None:
    for second in range(3600):
        written.now += 1.0
        reason = f"can0 is up (transmit errors: {second % 250}, receive errors: 0)"
        log.warning("CAN bus passive", extra=fields(cell="press", bus="socketcan:can0", reason=reason))
        written.flush()
    assert EACH <= len(written.lines()) <= EACH + 3600 / PERIOD + 2
    written.close()
    assert written.count() == 3600


def test_debug_is_written_as_it_comes(written: Log) -> None:
    for _ in range(1000):
        log.debug("lock acquired", extra=fields(lock="start"))
    assert len(written.lines()) == 1000


async def test_what_was_merged_is_written_though_nothing_follows(
    written: Log, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(merging, "_LOOK", 0.001)
    for _ in range(EACH + 5):
        log.warning("robot lost", extra=fields(cell="press"))
    written.now += PERIOD
    async with asyncio.timeout(10):
        while written.count() < EACH + 5:  # noqa: ASYNC110
            await asyncio.sleep(0.001)
