"""What may fail at any time is tried again until it works, and said once: not every two seconds for a whole night."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import TypeVar

from gatewayd.loop.progress import wait_with_progress

_Result = TypeVar("_Result")


def reason_of(error: Exception) -> str:
    """What an error says, without its number."""
    return getattr(error, "strerror", None) or str(error)


class Failure:
    """Why something fails now. `report` is called once for each reason, and again after it has worked meanwhile."""

    def __init__(self, report: Callable[[Exception], object]) -> None:
        self.reason = ""
        """Empty while it works."""
        self._report = report

    def failed(self, error: Exception) -> None:
        """Another attempt has failed."""
        reason = reason_of(error)
        if reason != self.reason:
            self.reason = reason
            self._report(error)

    def worked(self) -> bool:
        """An attempt has succeeded; returns whether the one before had failed."""
        reason, self.reason = self.reason, ""
        return bool(reason)


async def until_done(
    attempt: Callable[[], Awaitable[_Result]],
    expected: type[Exception],
    report: Callable[[Exception], object],
    period: float,
    progress: Callable[[], None] = lambda: None,
) -> _Result:
    """The result of the first attempt that does not end in an `expected` error; `period` seconds lie between two."""
    failure = Failure(report)
    while True:
        try:
            return await attempt()
        except expected as error:
            failure.failed(error)
        await wait_with_progress(asyncio.sleep(period), progress, period)


async def keep_running(
    work: Callable[[], Awaitable[None]],
    log: logging.Logger,
    period: float,
    progress: Callable[[], None] = lambda: None,
    what: str = "internal error, starting again",
) -> None:
    """Do the work, and again whenever it ends in an error, which is a defect: nothing of it ends the process."""
    while True:
        try:
            await work()
        except Exception:
            log.exception(what)
        else:
            return
        await wait_with_progress(asyncio.sleep(period), progress, period)
