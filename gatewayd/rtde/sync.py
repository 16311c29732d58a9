"""The API of `gatewayd.rtde` for scripts and notebooks: the same robot, blocking.

    with sync.connect(host, outputs=["actual_q"]) as robot:
        for sample in robot:
            print(sample.actual_q)

The robot lives in an event loop of its own, in a daemon thread, so that no package is missed while the script does
something else. Ctrl-C ends any wait. Arguments, names and errors are those of `gatewayd.rtde`.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable, Coroutine, Iterable, Mapping
from functools import wraps
from types import TracebackType
from typing import Any, Generic, ParamSpec, Self, TypeVar

from gatewayd.rtde.api.errors import RtdeError
from gatewayd.rtde.api.events import RobotEvent
from gatewayd.rtde.api.information import RobotInformation
from gatewayd.rtde.api.properties import Properties
from gatewayd.rtde.api.robot import BOOTED, Robot
from gatewayd.rtde.api.robot import connect as connect_asynchronously
from gatewayd.rtde.api.sample import Sample, Value
from gatewayd.rtde.api.stream import BoundedStream
from gatewayd.rtde.api.wanted import Fields
from gatewayd.rtde.api.writing import Values
from gatewayd.rtde.messages import TextLevel
from gatewayd.rtde.properties import KNOWN_PROPERTIES
from gatewayd.rtde.recipe import Scalar

_Result = TypeVar("_Result")
_Item = TypeVar("_Item")
_Wishes = ParamSpec("_Wishes")
_NOT_OPEN = "the robot is not open: `with sync.connect(...) as robot` opens it"


def _blocking(make: Callable[_Wishes, Robot]) -> Callable[_Wishes, BlockingRobot]:
    """The same call for a blocking robot."""

    @wraps(make)
    def connect(*wishes: _Wishes.args, **named: _Wishes.kwargs) -> BlockingRobot:
        return BlockingRobot(make(*wishes, **named))

    return connect


class LoopThread:
    """An event loop in a daemon thread: it runs on while the program does something else, and ends with it."""

    def __init__(self, name: str) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name=name, daemon=True)
        self._thread.start()

    def run(self, work: Coroutine[Any, Any, _Result]) -> _Result:
        """The result of `work`, or what it raises; an interrupt of the caller, as Ctrl-C, cancels it.

        RtdeError from the loop's own thread, which would wait for itself.
        """
        if threading.current_thread() is self._thread or self._loop.is_closed():
            work.close()
            message = "the robot was closed" if self._loop.is_closed() else "this would wait for itself"
            raise RtdeError(message)
        future = asyncio.run_coroutine_threadsafe(work, self._loop)
        try:
            return future.result()
        except BaseException:
            future.cancel()
            raise

    def close(self) -> None:
        """End the loop; may be called twice."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()
            self._loop.close()


class BlockingStream(Generic[_Item]):
    """A blocking iterator over everything that a stream of a robot gets; ends when the robot is closed."""

    def __init__(self, stream: BoundedStream[_Item], thread: LoopThread) -> None:
        self._stream = stream
        self._thread = thread
        self._rest: deque[_Item] = deque()
        self._finished = False

    @property
    def overflowed(self) -> int:
        """Items lost so far because they were not read in time."""
        return self._stream.overflowed

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> _Item:
        if not (self._rest or self._finished):
            self._rest.extend(self._thread.run(self._batch(None)))
        if not self._rest:
            raise StopIteration
        return self._rest.popleft()

    def next(self, timeout: float | None = None) -> _Item:
        """The next item; TimeoutError after `timeout` seconds, StopIteration at the end."""
        if not (self._rest or self._finished):
            self._rest.extend(self._thread.run(self._batch(timeout)))
        return next(self)

    def take(self) -> list[_Item]:
        """All that is there, without waiting."""
        taken = [*self._rest, *(() if self._finished else self._thread.run(self._taken()))]
        self._rest.clear()
        return taken

    def finish(self) -> None:
        """Take nothing more in; what is there can still be read."""
        if not self._finished:
            self._rest.extend(self._thread.run(self._taken()))
            self._finished = True

    async def _batch(self, timeout: float | None) -> list[_Item]:  # noqa: ASYNC109
        """What is there, at least one item; empty at the end. One change of threads for all of them."""
        try:
            first = await self._stream.next(timeout)
        except StopAsyncIteration:
            return []
        return [first, *self._stream.take()]

    async def _taken(self) -> list[_Item]:
        return self._stream.take()


class BlockingRobot(RobotInformation):
    """A robot as `gatewayd.rtde.Robot`, of which every call blocks until it is done. For one thread at a time."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot._feed, robot._client)  # noqa: SLF001  the same robot
        self._robot = robot
        self._thread: LoopThread | None = None
        self._streams: tuple[BlockingStream[Sample], BlockingStream[RobotEvent]] | None = None

    def __repr__(self) -> str:
        return f"<BlockingRobot {self.address} {self.state.value}>"

    # opening and closing

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def open(self) -> None:
        """See `Robot.open`."""
        if self._thread is None:
            thread = self._thread = LoopThread(f"robot {self.address}")
            self._streams = BlockingStream(self._feed.main, thread), BlockingStream(self._feed.events, thread)
        try:
            self._thread.run(self._robot.open())
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """See `Robot.close`."""
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.run(self._robot.close())
            for stream in self._streams or ():
                stream.finish()
            thread.close()

    def reconnect(self, timeout: float | None = None) -> None:
        """See `Robot.reconnect`."""
        self._run(self._robot.reconnect(timeout))

    def booted(self, timeout: float | None = None, uptime: float = BOOTED) -> None:
        """See `Robot.booted`."""
        self._run(self._robot.booted(timeout, uptime))

    # reading

    def __iter__(self) -> BlockingStream[Sample]:
        return self.samples

    @property
    def samples(self) -> BlockingStream[Sample]:
        """Every package, in order: what `for sample in robot` reads."""
        return self._opened()[0]

    @property
    def events(self) -> BlockingStream[RobotEvent]:
        """Everything that happens; `take()` has what has happened so far."""
        return self._opened()[1]

    def newer(self, timeout: float | None = None) -> Sample:
        """See `Robot.newer`."""
        return self._run(self._robot.newer(timeout))

    # recipes

    def pause(self) -> None:
        """See `Robot.pause`."""
        self._run(self._robot.pause())

    def resume(self) -> None:
        """See `Robot.resume`."""
        self._run(self._robot.resume())

    def set_up(
        self,
        *,
        outputs: Fields | None = None,
        inputs: Mapping[str, Fields] | None = None,
        frequency: float | None = None,
        timeout: float | None = 10.0,
    ) -> None:
        """See `Robot.set_up`."""
        self._run(self._robot.set_up(outputs=outputs, inputs=inputs, frequency=frequency, timeout=timeout))

    # writing

    def write(
        self,
        recipe: str,
        values: Values | None = None,
        /,
        *,
        verify: bool = False,
        timeout: float = 1.0,
        **fields: Value | Iterable[Scalar],
    ) -> None:
        """See `Robot.write`."""
        self._run(self._robot.write(recipe, {**(values or {}), **fields}, verify=verify, timeout=timeout))

    def known(self, recipe: str) -> dict[str, Value]:
        """See `Robot.known`."""
        return self._robot.known(recipe)

    def set_standard_digital_outputs(
        self, values: Mapping[int, bool], *, verify: bool = False, timeout: float = 1.0
    ) -> None:
        """See `Robot.set_standard_digital_outputs`."""
        self._run(self._robot.set_standard_digital_outputs(values, verify=verify, timeout=timeout))

    def set_configurable_digital_outputs(
        self, values: Mapping[int, bool], *, verify: bool = False, timeout: float = 1.0
    ) -> None:
        """See `Robot.set_configurable_digital_outputs`."""
        self._run(self._robot.set_configurable_digital_outputs(values, verify=verify, timeout=timeout))

    def set_tool_digital_outputs(
        self, values: Mapping[int, bool], *, verify: bool = False, timeout: float = 1.0
    ) -> None:
        """See `Robot.set_tool_digital_outputs`."""
        self._run(self._robot.set_tool_digital_outputs(values, verify=verify, timeout=timeout))

    def set_speed_slider(
        self, fraction: float, *, allow_zero: bool = False, verify: bool = False, timeout: float = 1.0
    ) -> None:
        """See `Robot.set_speed_slider`."""
        self._run(
            self._robot.set_speed_slider(fraction, allow_zero=allow_zero, verify=verify, timeout=timeout)
        )

    def set_analog_output(
        self,
        number: int,
        *,
        volts: float | None = None,
        milliamperes: float | None = None,
        verify: bool = False,
        timeout: float = 1.0,
    ) -> None:
        """See `Robot.set_analog_output`."""
        self._run(
            self._robot.set_analog_output(
                number, volts=volts, milliamperes=milliamperes, verify=verify, timeout=timeout
            )
        )

    def set_input_bits(
        self, values: Mapping[int, bool], *, verify: bool = False, timeout: float = 1.0
    ) -> None:
        """See `Robot.set_input_bits`."""
        self._run(self._robot.set_input_bits(values, verify=verify, timeout=timeout))

    # texts and properties

    def message(self, text: str, level: TextLevel = TextLevel.INFO, source: str = "gatewayd") -> None:
        """See `Robot.message`."""
        self._run(self._robot.message(text, level, source))

    def properties(
        self, names: tuple[str, ...] | list[str] = tuple(KNOWN_PROPERTIES), timeout: float = 1.0
    ) -> Properties:
        """See `Robot.properties`."""
        return self._run(self._robot.properties(names, timeout))

    def _run(self, work: Coroutine[Any, Any, _Result]) -> _Result:
        if self._thread is None:
            work.close()
            raise RtdeError(_NOT_OPEN)
        return self._thread.run(work)

    def _opened(self) -> tuple[BlockingStream[Sample], BlockingStream[RobotEvent]]:
        if self._streams is None:
            raise RtdeError(_NOT_OPEN)
        return self._streams


connect = _blocking(connect_asynchronously)
"""As `gatewayd.rtde.connect`, for `with` instead of `async with`."""
