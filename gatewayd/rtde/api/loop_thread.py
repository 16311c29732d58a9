"""An event loop in a thread of its own, and turns of it that another thread takes."""

from __future__ import annotations

import asyncio
import selectors
import threading
import time
from collections.abc import Callable, Coroutine
from contextvars import Context
from typing import Any, TypeVar, TypeVarTuple, Unpack

from gatewayd.rtde.api.errors import RtdeError

_Result = TypeVar("_Result")
_Args = TypeVarTuple("_Args")


class _Selector(selectors.DefaultSelector):
    """Lets go of the loop's turn while it waits."""

    def __init__(self, turn: threading.Lock) -> None:
        super().__init__()
        self._turn = turn

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """See selectors.BaseSelector."""
        self._turn.release()
        try:
            return super().select(timeout)
        finally:
            self._turn.acquire()


class SharedLoop(asyncio.SelectorEventLoop):
    """A loop whose callbacks run while it holds `turn`: a thread that holds it may do what a callback may.

    It may call `call_soon`, `call_later` and `call_at`, so complete futures and write to transports, but not add or
    remove readers. asyncio's debug mode is off, as it takes that for an error.
    """

    def __init__(self) -> None:
        self.turn = threading.Lock()
        self._runner = 0
        super().__init__(_Selector(self.turn))
        self.set_debug(False)
        self.__dict__["time"] = time.monotonic  # as asyncio has it, without a call around it

    def run_forever(self) -> None:
        """See asyncio."""
        self._runner = threading.get_ident()
        with self.turn:
            super().run_forever()

    def call_soon(
        self,
        callback: Callable[[Unpack[_Args]], object],
        *args: *_Args,
        context: Context | None = None,
    ) -> asyncio.Handle:
        """See asyncio; the loop is woken if need be."""
        if threading.get_ident() == self._runner:
            return super().call_soon(callback, *args, context=context)
        return self.call_soon_threadsafe(callback, *args, context=context)

    def call_at(
        self,
        when: float,
        callback: Callable[[Unpack[_Args]], object],
        *args: *_Args,
        context: Context | None = None,
    ) -> asyncio.TimerHandle:
        """See asyncio; the loop is woken if need be."""
        handle = super().call_at(when, callback, *args, context=context)
        if threading.get_ident() != self._runner:
            self.call_soon_threadsafe(lambda: None)  # it waits for a later timer
        return handle


class LoopThread:
    """An event loop in a daemon thread: it runs on while the program does something else, and ends with it."""

    def __init__(self, name: str) -> None:
        self.loop = SharedLoop()
        self._thread = threading.Thread(target=self.loop.run_forever, name=name, daemon=True)
        self._thread.start()

    def check(self) -> None:
        """RtdeError if the loop was closed, or from its own thread, which would wait for itself."""
        if self.loop.is_closed():
            message = "the robot was closed"
            raise RtdeError(message)
        if threading.get_ident() == self._thread.ident:
            message = "this would wait for itself"
            raise RtdeError(message)

    def run(self, work: Coroutine[Any, Any, _Result]) -> _Result:
        """The result of `work`, or what it raises; an interrupt of the caller, as Ctrl-C, cancels it. See `check`."""
        try:
            self.check()
        except RtdeError:
            work.close()
            raise
        future = asyncio.run_coroutine_threadsafe(work, self.loop)
        try:
            return future.result()
        except BaseException:
            future.cancel()
            raise

    def close(self) -> None:
        """End the loop; may be called twice."""
        if not self.loop.is_closed():
            self.loop.call_soon_threadsafe(self.loop.stop)
            self._thread.join()
            self.loop.close()
