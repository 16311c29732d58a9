"""How a blocking robot waits: it reads the packages itself while they come, and leaves all else to the loop's thread.

Only what is waited for again and again is read directly. A call in between, as a write, needs the loop's thread, and it
is cheaper then to leave the socket to it.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from gatewayd.rtde.api.loop_thread import LoopThread
from gatewayd.rtde.client import RtdeClient
from gatewayd.rtde.receiving import PackageReceiver

_PATIENCE = 0.02
"""Seconds for which a package is awaited here. What comes less often is no matter of CPU time."""
_Result = TypeVar("_Result")


class DirectReader:
    """What the calls of a blocking robot do with the thread of its client's loop."""

    __slots__ = ("_client", "_looked", "_receiver", "_thread", "_turn", "_waited")

    def __init__(self, thread: LoopThread, client: RtdeClient) -> None:
        self._thread = thread
        self._turn = thread.loop.turn
        self._client = client
        self._waited = False
        """Whether the last call was `wait`."""
        self._looked: Callable[[], object] | None = None
        """Who has seen all that was read."""
        self._receiver: PackageReceiver | None = None
        """What was read directly last; still is, if it says so."""

    def run(self, work: Coroutine[Any, Any, _Result]) -> _Result:
        """Have the loop's thread do it; see `LoopThread.run`."""
        self._waited = False
        self._leave()
        return self._thread.run(work)

    def wait(
        self,
        found: Callable[[], _Result | None],
        otherwise: Callable[[float | None], Coroutine[Any, Any, _Result]],
        timeout: float | None,
    ) -> _Result:
        """What `found` returns when it is not None any more; `otherwise` waits for the same, in the loop's thread.

        TimeoutError after `timeout` seconds; what `otherwise` raises.
        """
        end = None if timeout is None else self._thread.loop.time() + timeout
        result, left = None, _PATIENCE
        receiver, turn = self._receiver, self._turn
        if receiver is None or not receiver.direct or found != self._looked:
            result, receiver = self._begin(found)
        while result is None and receiver is not None:
            if end is not None:
                left = min(_PATIENCE, end - self._thread.loop.time())
            if left < 0 or receiver.wait(1000 * left) != receiver.readable:
                break
            with turn:
                if not receiver.read():
                    break
                result = found()
        self._waited = True
        if result is not None:
            return result
        self._leave()
        return self._thread.run(otherwise(None if end is None else end - self._thread.loop.time()))

    def now(self, look: Callable[[], _Result]) -> _Result:
        """What `look` returns once what is there has been read."""
        self._thread.check()
        self._looked = look
        with self._turn:
            if self._receiver is not None:
                self._receiver.read()
            return look()

    def _begin(self, found: Callable[[], _Result | None]) -> tuple[_Result | None, PackageReceiver | None]:
        """What is found without a further package; else have packages read here, if they were waited for before."""
        self._thread.check()
        self._looked = found
        with self._turn:
            result = found()
            if result is None and self._waited and (self._receiver is None or not self._receiver.direct):
                self._receiver = self._client.receiver
                if self._receiver is not None:
                    self._receiver.detach()
        return result, self._receiver

    def _leave(self) -> None:
        """Leave the socket to the loop, and nothing in it that was there before."""
        receiver, self._receiver = self._receiver, None
        if receiver is not None:
            with self._turn:
                receiver.read()
                receiver.attach()
