"""A robot for programs: `connect` gives one, `async with` opens it, `async for` reads every package of it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from contextlib import suppress
from dataclasses import replace
from types import TracebackType
from typing import Self

from gatewayd.report.format import counted
from gatewayd.rtde.api.errors import ConnectionLostError, FieldsRefusedError, RtdeError
from gatewayd.rtde.api.events import RobotEvent
from gatewayd.rtde.api.feed import ConnectionState, RobotFeed
from gatewayd.rtde.api.properties import Properties, ask_properties
from gatewayd.rtde.api.retry import ONCE, Retry
from gatewayd.rtde.api.sample import Sample
from gatewayd.rtde.api.stream import BoundedStream
from gatewayd.rtde.api.verification import SHOWN_BY
from gatewayd.rtde.api.wanted import Fields, Wanted, wanted
from gatewayd.rtde.api.writing import InputWriter
from gatewayd.rtde.client import RtdeClient
from gatewayd.rtde.messages import IN_USE, TextLevel, TextMessage
from gatewayd.rtde.properties import KNOWN_PROPERTIES
from gatewayd.rtde.session import ClientSettings
from gatewayd.rtde.types import DEFAULT_PORT

BOOTED = 40.0
"""Controller time in seconds from which its RTDE service does not restart any more (UR's client library)."""
_MAX_TEXT = 255
_MAX_PORT = 65535
_FOREVER = Retry()
_PROTOCOLS = (None, 1, 2)


def connect(
    host: str,
    *,
    port: int = DEFAULT_PORT,
    outputs: Fields = (),
    inputs: Mapping[str, Fields] | None = None,
    frequency: float = 0.0,
    strict: bool = True,
    protocol: int | None = None,
    start: bool = True,
    read_back: bool = True,
    buffer: int = 5000,
    retry: Retry = ONCE,
    reconnect: Retry | None = _FOREVER,
    boot_wait: bool = False,
    claim_timeout: float = 0.0,
    connect_timeout: float = 2.0,
    handshake_timeout: float = 2.0,
    data_timeout: float = 1.0,
) -> Robot:
    """Make a robot that `async with` opens, and `async for` reads. Times are in seconds.

    outputs: fields to subscribe, in the order of `Sample.values`; `timestamp` is always there besides. Names, or types
    by name, which are compared with the controller's.
    inputs: input recipes by name, each claimed and sent by itself.
    frequency: packages per second; 0 is the controller's own rate (500 Hz, CB3 125 Hz), which it divides by a whole
    number otherwise (guide, RTDE_CONTROL_PACKAGE_SETUP_OUTPUTS): `Robot.frequency` is what came of it.
    strict: opening fails with FieldsRefusedError if a field is refused or absent; else `Robot.unavailable` has it.
    protocol: 1 or 2 to force it; None: 2, or 1 where the controller refuses it.
    start: let the output run; else it is paused until `Robot.resume`.
    read_back: subscribe the claimed `input_*` registers too, and the outputs that show what the masked inputs do, which
    is needed to verify writes. They are attributes of samples, and no part of `Sample.values`.
    buffer: samples kept for `async for`; 0: none.
    retry, reconnect: limits of the attempts at the first session, and after a loss; `reconnect=None`: by hand.
    boot_wait: open only when the controller runs for 40 s: its RTDE service restarts once after power-up.
    claim_timeout: how long `strict` waits for inputs that are in use.
    connect_timeout, handshake_timeout: for each connection attempt, for each answer of the set-up.
    data_timeout: the connection is taken for lost after that time without a package while the output runs.

    ValueError, TypeError: an argument that cannot be meant.
    """
    if protocol not in _PROTOCOLS:
        message = f"protocol {protocol!r}: RTDE has versions 1 and 2; None negotiates"
        raise ValueError(message)
    if boot_wait and not start:
        message = "boot_wait needs the output to run: it reads the controller's time"
        raise ValueError(message)
    _check_numbers(port, buffer, connect_timeout, handshake_timeout, data_timeout)
    settings = ClientSettings(
        host=host,
        port=port,
        running=start,
        read_back=read_back,
        protocol=protocol,
        every=True,
        connect_timeout=connect_timeout,
        handshake_timeout=handshake_timeout,
        data_timeout=data_timeout,
    )
    feed = RobotFeed(wanted(outputs, inputs, frequency), reconnect, running=start, buffer=buffer)
    return Robot(
        settings,
        feed,
        retry,
        reconnect or retry,
        strict=strict,
        claim_timeout=claim_timeout,
        boot_wait=boot_wait,
    )


class Robot(InputWriter):
    """One robot. Made by `connect`; once closed it stays so. An iterator over every package, in their order."""

    def __init__(
        self,
        settings: ClientSettings,
        feed: RobotFeed,
        retry: Retry,
        later: Retry,
        *,
        strict: bool,
        claim_timeout: float,
        boot_wait: bool,
    ) -> None:
        wishes = _wishing(settings, feed.wanted)
        super().__init__(feed, RtdeClient(wishes, feed, feed))
        feed.started = lambda: self._client.back_off(later.delay, later.max_delay)
        self._retry = retry
        self._strict = strict
        self._claim_timeout = claim_timeout
        self._boot_wait = boot_wait
        self._task: asyncio.Task[None] | None = None

    def __repr__(self) -> str:
        return f"<Robot {self.address} {self.state.value}>"

    # opening and closing

    async def __aenter__(self) -> Self:
        await self.open()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def open(self) -> None:
        """Connect and set up, within the limits of `retry`; what failed has been closed.

        ConnectFailedError, FieldsRefusedError, TypesDifferError.
        """
        if self._feed.state is not ConnectionState.NEW:
            message = (
                f"the robot was opened before (it is {self._feed.state.value}): connect() makes another one"
            )
            raise RtdeError(message)
        try:
            self._begin()
            await self._feed.until(lambda: self._feed.session, None)
            await self._insist()
            if self._boot_wait:
                await self.booted()
        except BaseException:
            await self.close()
            raise

    async def close(self) -> None:
        """End the connection; what was sent before is still delivered. Iterators end. May be called twice."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.wait((task,))
        if self._feed.state is not ConnectionState.CLOSED:
            self._feed.give_up(ConnectionLostError("the robot was closed"), ConnectionState.CLOSED)

    async def reconnect(self, timeout: float | None = None) -> None:  # noqa: ASYNC109  a public API in seconds
        """Set up a new connection, in place of the present one or after a loss; returns when it is up.

        ConnectFailedError or ConnectionLostError when the limits are reached; TimeoutError.
        """
        self._refuse_closed()
        sessions = self.statistics.sessions
        if self._task is not None and self._feed.given_up:
            await asyncio.wait((self._task,))  # whoever hears of a final loss may ask before it has ended
        if self._task is not None and not self._task.done():
            self._feed.limit(self._retry)
            self._client.reconnect("a new connection was asked for")
        else:
            self._begin()
        await self._feed.until(
            lambda: self._feed.session if self.statistics.sessions > sessions else None, timeout
        )

    async def booted(self, timeout: float | None = None, uptime: float = BOOTED) -> None:  # noqa: ASYNC109
        """Wait until the controller has run for `uptime` seconds, over the restart of its service; TimeoutError."""
        feed = self._feed
        await feed.until(
            lambda: True if feed.latest is not None and feed.latest.timestamp >= uptime else None, timeout
        )

    # reading

    def __aiter__(self) -> AsyncIterator[Sample]:
        return self._feed.main

    @property
    def samples(self) -> BoundedStream[Sample]:
        """The iterator that `async for sample in robot` uses, from the first package on."""
        return self._feed.main

    async def newer(self, timeout: float | None = None) -> Sample:  # noqa: ASYNC109  a public API in seconds
        """The newest sample that `newer` has not returned yet; older ones are passed over.

        TimeoutError after `timeout` seconds; ConnectionLostError once there is no session and none is tried for.
        """
        feed = self._feed

        def unseen() -> Sample | None:
            return feed.latest if feed.latest is not self._seen else None

        self._seen = sample = await feed.until(unseen, timeout)
        return sample

    _seen: Sample | None = None

    def stream(self, buffer: int = 5000) -> BoundedStream[Sample]:
        """Another iterator over every package from now on, with a buffer of its own; close it when it is done with."""
        self._refuse_closed()
        if buffer < 1:
            message = f"a buffer of {buffer} samples keeps none"
            raise ValueError(message)
        return self._feed.stream(buffer)

    @property
    def events(self) -> BoundedStream[RobotEvent]:
        """Everything that happens, in order, from the first attempt to connect on; the last thousand are kept."""
        return self._feed.events

    # recipes

    async def pause(self) -> None:
        """Have the output paused, in this session and in those to come; returns when it is.

        Guide, RTDE_CONTROL_PACKAGE_PAUSE. Without a session it is noted for the next one.
        """
        feed = self._feed
        feed.running = False
        await self._client.pause()
        await feed.until(lambda: True if feed.state is not ConnectionState.RUNNING else None, None)

    async def resume(self) -> None:
        """Have it sent again (guide, RTDE_CONTROL_PACKAGE_START); returns when it is."""
        self._feed.running = True
        await self._client.resume()

    async def set_up(
        self,
        *,
        outputs: Fields | None = None,
        inputs: Mapping[str, Fields] | None = None,
        frequency: float | None = None,
        timeout: float | None = 10.0,  # noqa: ASYNC109  a public API in seconds
    ) -> None:
        """Change recipes while paused, on the same connection; what is not given stays.

        Inputs that are no longer wanted stay claimed until the connection ends: RTDE cannot give them back. RtdeError
        if the output is not paused; FieldsRefusedError where `strict`, after the change; TypesDifferError ends the
        connection; TimeoutError. Guide, RTDE_CONTROL_PACKAGE_SETUP_OUTPUTS and _INPUTS.
        """
        if self.state is not ConnectionState.PAUSED:
            message = f"recipes can be changed while the output is paused, and it is {self.state.value}"
            raise RtdeError(message)
        former, feed = self._feed.wanted, self._feed
        new = wanted(
            outputs if outputs is not None else former.outputs,
            inputs if inputs is not None else former.inputs,
            frequency if frequency is not None else former.frequency,
        )
        feed.wanted = replace(
            new,
            declared_outputs=new.declared_outputs if outputs is not None else former.declared_outputs,
            declared_inputs=new.declared_inputs if inputs is not None else former.declared_inputs,
        )
        set_ups = feed.set_ups
        self._client.change(_wishing(self._client.settings, feed.wanted))
        await feed.until(lambda: feed.session if feed.set_ups > set_ups else None, timeout)
        await self._insist()

    # texts and properties

    async def message(self, text: str, level: TextLevel = TextLevel.INFO, source: str = "gatewayd") -> None:
        """Put a line into the controller's log (guide, RTDE_TEXT_MESSAGE); EXCEPTION says that the program has failed.

        ValueError: more than 255 bytes of UTF-8; ConnectionLostError: no session.
        """
        for what, words in (("text", text), ("source", source)):
            size = len(words.encode("utf-8", "backslashreplace"))
            if size > _MAX_TEXT:
                message = f"the {what} has {counted(size, 'byte')}; RTDE takes {_MAX_TEXT}"
                raise ValueError(message)
        self._session()
        if not self._client.say(TextMessage(text, source, level)):
            message = "the text was not sent: the connection is being lost"
            raise ConnectionLostError(message, self.last_loss)

    async def properties(
        self,
        names: tuple[str, ...] | list[str] = tuple(KNOWN_PROPERTIES),
        timeout: float = 1.0,  # noqa: ASYNC109  a public API in seconds
    ) -> Properties:
        """Ask what the controller is made of (message 82, in no guide; from 5.26 and 10.15).

        An older one is silent: `Properties.answered` is False then. ConnectionLostError: no session.
        """
        self._session()
        return await ask_properties(self._client, tuple(dict.fromkeys(names)), timeout)

    # within

    def _begin(self) -> None:
        self._feed.begin(self._retry)
        self._client.back_off(self._retry.delay, self._retry.max_delay)
        self._task = asyncio.create_task(self._client.run(), name=f"robot {self.address}")
        self._task.add_done_callback(self._ended)

    def _ended(self, task: asyncio.Task[None]) -> None:
        error = None if task.cancelled() else task.exception()
        if isinstance(error, Exception):
            self._feed.give_up(error, ConnectionState.LOST)

    async def _insist(self) -> None:
        """Where `strict`: FieldsRefusedError unless every wanted field is there, after `claim_timeout`."""
        feed = self._feed
        if not self._strict:
            return
        missing = feed.unavailable(self._session())
        if missing and self._claim_timeout and all(each.word == IN_USE for each in missing):
            with suppress(TimeoutError):
                await feed.until(
                    lambda: True if feed.session and not feed.unavailable(feed.session) else None,
                    self._claim_timeout,
                )
            missing = feed.unavailable(self._session())
        if missing:
            raise FieldsRefusedError(missing)

    def _refuse_closed(self) -> None:
        if self._feed.state is ConnectionState.CLOSED:
            message = "the robot was closed"
            raise RtdeError(message)


def _check_numbers(port: int, buffer: int, *timeouts: float) -> None:
    if not 0 < port <= _MAX_PORT:
        message = f"port {port!r}: TCP has 1 to {_MAX_PORT}"
        raise ValueError(message)
    if buffer < 0:
        message = f"a buffer of {buffer} samples cannot be; 0 keeps none"
        raise ValueError(message)
    for timeout in timeouts:
        if not timeout > 0:
            message = f"a timeout of {timeout} s: each has to be more than 0"
            raise ValueError(message)


def _wishing(settings: ClientSettings, wishes: Wanted) -> ClientSettings:
    """The settings for these wishes, with the outputs that show what masked inputs do."""
    shown: list[str] = []
    if settings.read_back:
        claimed = (name for names in wishes.inputs.values() for name in names)
        shown = [output for name in claimed for output in SHOWN_BY.get(name, ())]
    return replace(
        settings,
        outputs=tuple(dict.fromkeys((*wishes.outputs, *shown))),
        recipes=wishes.inputs,
        frequency=wishes.frequency,
    )
