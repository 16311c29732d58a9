"""The API of `gatewayd.rtde` for scripts and notebooks: the same robot, blocking.

    with sync.connect(host, outputs=["actual_q"]) as robot:
        for sample in robot:
            print(sample.actual_q)

The robot lives in an event loop of its own, in a daemon thread, so that no package is missed while the script does
something else. A script that does nothing but wait for packages reads them itself, which takes a third of the CPU
time; 0.2 s after its last call, at most, the loop reads again. Ctrl-C ends any wait. Arguments, names and errors are
those of `gatewayd.rtde`.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterable, Mapping
from functools import partial, wraps
from types import TracebackType
from typing import Any, Generic, ParamSpec, Self, TypeVar

from gatewayd.rtde.api.direct import DirectReader
from gatewayd.rtde.api.errors import RtdeError
from gatewayd.rtde.api.events import RobotEvent
from gatewayd.rtde.api.information import RobotInformation
from gatewayd.rtde.api.loop_thread import LoopThread
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


class BlockingStream(Generic[_Item]):
    """A blocking iterator over everything that a stream of a robot gets; ends when the robot is closed."""

    __slots__ = ("_finished", "_first", "_reader", "_stream")

    def __init__(self, stream: BoundedStream[_Item], reader: DirectReader) -> None:
        self._stream = stream
        self._first = stream.first
        self._reader = reader
        self._finished = False

    @property
    def overflowed(self) -> int:
        """Items lost so far because they were not read in time."""
        return self._stream.overflowed

    def __iter__(self) -> Self:
        return self

    def __next__(self, timeout: float | None = None) -> _Item:
        item = self._first() if self._finished else self._reader.wait(self._first, self._next, timeout)
        if item is None:
            raise StopIteration
        return item

    def next(self, timeout: float | None = None) -> _Item:
        """The next item; TimeoutError after `timeout` seconds, StopIteration at the end."""
        return self.__next__(timeout)

    def take(self) -> list[_Item]:
        """All that is there, without waiting."""
        return self._stream.take() if self._finished else self._reader.run(self._taken())

    def finish(self) -> None:
        """Take nothing more in; what is there can still be read."""
        self._finished = True

    async def _next(self, timeout: float | None) -> _Item | None:  # noqa: ASYNC109
        """The next item; None at the end."""
        try:
            return await self._stream.next(timeout)
        except StopAsyncIteration:
            return None

    async def _taken(self) -> list[_Item]:
        return self._stream.take()


class BlockingRobot(RobotInformation):
    """A robot as `gatewayd.rtde.Robot`, of which every call blocks until it is done. For one thread at a time."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot._feed, robot._client)  # noqa: SLF001  the same robot
        self._robot = robot
        self._thread: LoopThread | None = None
        self._reader: DirectReader | None = None
        self._seen: Sample | None = None
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
            reader = self._reader = DirectReader(thread, self._client)
            self._streams = BlockingStream(self._feed.main, reader), BlockingStream(self._feed.events, reader)
        try:
            self._run(self._robot.open())
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """See `Robot.close`."""
        if self._thread is not None:
            self._run(self._robot.close())
            for stream in self._streams or ():
                stream.finish()
            thread, self._thread, self._reader = self._thread, None, None
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

    @property
    def latest(self) -> Sample | None:
        """See `Robot.latest`."""
        return self._feed.latest if self._reader is None else self._reader.now(lambda: self._feed.latest)

    def newer(self, timeout: float | None = None) -> Sample:
        """See `Robot.newer`."""
        if self._reader is None:
            raise RtdeError(_NOT_OPEN)
        self._seen = sample = self._reader.now(self._unseen) or self._reader.wait(
            self._unseen, partial(self._feed.until, self._unseen), timeout
        )
        return sample

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
        if self._reader is None:
            work.close()
            raise RtdeError(_NOT_OPEN)
        return self._reader.run(work)

    def _unseen(self) -> Sample | None:
        latest = self._feed.latest
        return latest if latest is not self._seen else None

    def _opened(self) -> tuple[BlockingStream[Sample], BlockingStream[RobotEvent]]:
        if self._streams is None:
            raise RtdeError(_NOT_OPEN)
        return self._streams


connect = _blocking(connect_asynchronously)
"""As `gatewayd.rtde.connect`, for `with` instead of `async with`."""
