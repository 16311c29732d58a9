"""Calls that may take long, by a thread of their own, without holding up anything: not the loop, and not its end.

asyncio waits for its executor when a loop is closed: a name server or an adapter that does not answer would delay the
shutdown by many seconds. A daemon thread is left alone.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

_Result = TypeVar("_Result")


async def in_daemon_thread(
    work: Callable[[], _Result], name: str, unwanted: Callable[[_Result], object] = lambda _result: None
) -> _Result:
    """The result of `work`, or what it raises. `name` is the thread's.

    A result that comes after a cancellation is given to `unwanted`, by a thread too, so that what was opened is closed.
    """
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[_Result] = loop.create_future()

    def refuse(result: _Result) -> None:
        threading.Thread(target=unwanted, args=(result,), name=name, daemon=True).start()

    def accept(result: _Result) -> None:
        if answer.done():
            refuse(result)
        else:
            answer.set_result(result)

    def fail(error: Exception) -> None:
        if not answer.done():
            answer.set_exception(error)

    def run() -> None:
        try:
            result = work()
        except Exception as error:  # noqa: BLE001 - whatever it is, it is raised where the result is waited for
            with suppress(RuntimeError):  # the loop was closed meanwhile
                loop.call_soon_threadsafe(fail, error)
            return
        try:
            loop.call_soon_threadsafe(accept, result)
        except RuntimeError:
            refuse(result)

    threading.Thread(target=run, name=name, daemon=True).start()
    return await answer
