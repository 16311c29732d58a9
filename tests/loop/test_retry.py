"""What fails is tried again and said once; what is a defect is logged each time."""

from __future__ import annotations

import asyncio
import errno
import logging
from contextlib import suppress

import pytest

from gatewayd.loop.retry import Failure, keep_running, reason_of, until_done


def test_a_reason_is_reported_once_until_it_is_another_one_or_it_worked() -> None:
    reported: list[str] = []
    failure = Failure(lambda error: reported.append(reason_of(error)))
    assert not failure.worked()
    for _ in range(2):
        failure.failed(OSError(errno.ENOSPC, "No space left on device"))
    failure.failed(ValueError("another"))
    assert reported == ["No space left on device", "another"]
    assert failure.reason == "another"
    assert failure.worked()
    assert not failure.reason
    failure.failed(ValueError("another"))
    assert reported[2:] == ["another"]


async def test_it_is_tried_until_it_works_and_progress_shows_meanwhile() -> None:
    reported: list[str] = []
    attempts = progress = 0

    async def attempt() -> str:
        nonlocal attempts
        attempts += 1
        if attempts < 4:
            raise OSError(errno.EADDRINUSE, "in use")
        return "done"

    def moved() -> None:
        nonlocal progress
        progress += 1

    found = await until_done(attempt, OSError, lambda e: reported.append(reason_of(e)), 0.001, moved)
    assert (found, attempts, reported) == ("done", 4, ["in use"])
    assert progress >= 3


async def test_what_is_not_expected_is_raised() -> None:
    async def attempt() -> None:
        raise ValueError("a defect")

    with pytest.raises(ValueError, match="a defect"):
        await until_done(attempt, OSError, lambda _error: None, 0.001)


async def test_a_cancellation_ends_it() -> None:
    async def attempt() -> None:
        raise OSError

    task = asyncio.create_task(until_done(attempt, OSError, lambda _error: None, 60.0))
    await asyncio.sleep(0)
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
    assert task.cancelled()


async def test_work_that_ends_in_a_defect_is_begun_again_until_it_ends(
    caplog: pytest.LogCaptureFixture,
) -> None:
    begun = 0

    async def work() -> None:
        nonlocal begun
        begun += 1
        if begun < 3:
            raise RuntimeError("a defect")

    await keep_running(work, logging.getLogger("test"), 0.001)
    assert begun == 3
    assert [record.getMessage() for record in caplog.records] == ["internal error, starting again"] * 2
