"""Work that must not hold up the robot and the buses: in short pieces, and never more than a share of the loop's time.

Every request by HTTP gets its turn here. The pieces of several askers are done in turn, one at a time, and
after each the loop serves everything else for many times as long as the piece took. However many ask, and whatever
for, a PLC's request waits for one short piece now and then, and nobody is kept waiting by another who asks more.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Generator, Hashable
from contextlib import asynccontextmanager
from time import perf_counter
from typing import TYPE_CHECKING, TypeVar, cast

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

SHARE = 0.1
"""Of the loop's time, the most that all pieces together take."""
PIECE = 0.001
"""Seconds after which a longer work gives the loop back and waits for its next turn."""
BURST = 0.01
"""Seconds of work without a pause after a quiet time: a single asker is answered at once."""
OVERHEAD = 0.0003
"""Seconds that a request costs beside its answer: what reads it and what sends it."""
WAITING = 256
"""Pieces that may wait for their turn."""

_Result = TypeVar("_Result")


class Busy(Exception):
    """So much waits already that there is no use in waiting."""


class LoopShare:
    """Hands out turns. For one loop; `timer` counts the seconds that pieces take."""

    def __init__(self, timer: Callable[[], float] = perf_counter) -> None:
        self._timer = timer
        self._left = BURST
        """Seconds of work that may be done now; below zero while there has to be a pause."""
        self._since = timer()
        """When `_left` was right."""
        self._busy = False
        """A piece is under way, or a pause; others wait."""
        self._waiting: dict[str, deque[asyncio.Future[None]]] = {}
        """By asker, whose turn is next in the beginning."""
        self._announced: dict[Hashable, asyncio.Task[object]] = {}
        """Works that wait for their first turn."""

    async def request(self, asker: str, cost: float = OVERHEAD) -> None:
        """A turn for what has come, whatever it is: it costs what every request costs, or `cost`. Raises Busy."""
        async with self._turn(asker, cost):
            pass

    async def done(self, asker: str, work: Generator[object, None, _Result]) -> _Result:
        """The result of `work`, whose steps are done in pieces of `PIECE` seconds. A step should be far shorter.

        Raises what the work raises, and Busy.
        """
        while True:
            async with self._turn(asker):
                end = self._timer() + PIECE
                try:
                    next(work)
                    while self._timer() < end:
                        next(work)
                except StopIteration as result:
                    return result.value  # type: ignore[no-any-return]

    async def done_once(
        self, subject: Hashable, asker: str, begin: Callable[[], Generator[object, None, _Result]]
    ) -> _Result:
        """The same for all who ask for this subject before the work has begun: it is done once for all of them.

        Nobody gets what was true before he asked.
        """
        announced = self._announced.get(subject)
        if announced is None:

            def work() -> Generator[object, None, _Result]:
                del self._announced[subject]
                return (yield from begin())

            announced = asyncio.get_running_loop().create_task(self.done(asker, work()))
            announced.add_done_callback(lambda task: self._ended(subject, task))
            self._announced[subject] = announced
        return cast("_Result", await asyncio.shield(announced))

    def _ended(self, subject: Hashable, task: asyncio.Task[object]) -> None:
        if self._announced.get(subject) is task:  # it has ended before its first turn
            del self._announced[subject]
        if not task.cancelled():
            task.exception()  # the asker may be gone, and asyncio complains where nobody looks at it

    # -- turns ---------------------------------------------------------------------------------------------------

    @asynccontextmanager
    async def _turn(self, asker: str, cost: float = 0.0) -> AsyncIterator[None]:
        await self._wait(asker)
        begun = self._timer()
        try:
            yield
        finally:
            self._refill()
            self._left -= self._timer() - begun + cost
            self._pass_on()

    async def _wait(self, asker: str) -> None:
        self._refill()
        if not self._busy and self._left > 0:
            self._busy = True
            return
        if sum(map(len, self._waiting.values())) >= WAITING:
            raise Busy
        turn = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(asker, deque()).append(turn)
        if not self._busy:
            self._pass_on()
        try:
            await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():
                self._pass_on()
            raise

    def _pass_on(self) -> None:
        """The turn has ended. The next one begins when the loop has served all else, after a pause if one is due."""
        self._busy = True
        loop = asyncio.get_running_loop()
        if self._left > 0:
            loop.call_soon(self._begin_next)
        else:
            loop.call_later(-self._left / SHARE, self._begin_next)

    def _begin_next(self) -> None:
        while self._waiting:
            asker = next(iter(self._waiting))
            queue = self._waiting.pop(asker)
            turn = queue.popleft()
            if queue:
                self._waiting[asker] = queue
            if not turn.done():
                turn.set_result(None)
                return
        self._busy = False

    def _refill(self) -> None:
        now = self._timer()
        self._left = min(BURST, self._left + (now - self._since) * SHARE)
        self._since = now


def in_one_step(work: Callable[[], _Result]) -> Generator[None, None, _Result]:
    """A work that is short."""
    yield from ()
    return work()
