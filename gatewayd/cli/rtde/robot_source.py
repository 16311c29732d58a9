"""Packages of a robot by a connection of our own."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping

from gatewayd import rtde
from gatewayd.cli.rtde.recorder import SourceLayout
from gatewayd.cli.rtde.sources import Arrivals, SourceLostError, SourceRefusedError
from gatewayd.report.format import counted
from gatewayd.rtde.types import DataType

_BUFFER_SECONDS = 60.0
_MAX_RATE = 500.0
"""Packages per second that no controller exceeds."""
_TOGETHER = 0.02
"""Seconds that packages are collected for before they are handed on together."""


class RobotSource:
    """One controller, asked for `fields` (None as type: none is declared).

    `reconnect`: wait for it, and go on after it was lost.
    """

    def __init__(
        self,
        host: str,
        port: int,
        fields: Mapping[str, DataType | None],
        *,
        frequency: float = 0.0,
        strict: bool = True,
        reconnect: bool = False,
    ) -> None:
        self.waiting = ""
        self._robot = rtde.connect(
            host,
            port=port,
            outputs=fields,
            frequency=frequency,
            strict=strict,
            buffer=round(_BUFFER_SECONDS * _MAX_RATE),
            retry=rtde.Retry() if reconnect else rtde.Retry(connect_attempts=1, setup_attempts=1),
            reconnect=rtde.Retry() if reconnect else None,
        )
        self._layout: SourceLayout | None = None

    async def open(self) -> SourceLayout:
        """See `PackageSource`."""
        opening = asyncio.ensure_future(self._robot.open())
        try:
            while not (await asyncio.wait((opening,), timeout=_TOGETHER))[0]:
                loss = self._robot.last_loss
                self.waiting = f"waiting for the robot: {loss.text}" if loss is not None else "connecting"
            opening.result()
        except (rtde.FieldsRefusedError, rtde.TypesDifferError) as error:
            raise SourceRefusedError(str(error)) from error
        except rtde.RtdeError as error:
            raise SourceLostError(str(error)) from error
        finally:
            opening.cancel()
        self._robot.events.take()
        self._layout = SourceLayout(self._robot.outputs, 1 / self._robot.frequency)
        return self._layout

    async def next(self, patience: float) -> Arrivals:
        """See `PackageSource`."""
        main = self._robot.__aiter__()
        assert isinstance(main, rtde.BoundedStream)
        samples: list[rtde.Sample] = []
        try:
            samples.append(await main.next(patience))
            await asyncio.sleep(_TOGETHER)
            samples += main.take()
        except TimeoutError:
            pass
        except rtde.TypesDifferError as error:
            raise SourceRefusedError(str(error)) from error
        except rtde.RtdeError as error:
            raise SourceLostError(str(error)) from error
        events = self._robot.events.take()
        for event in events:
            if isinstance(event, rtde.SetUpEvent):
                self._compare(self._robot.outputs if self._robot.connected else None)
        ahead = time.time() - asyncio.get_running_loop().time()
        return Arrivals(
            [(sample.values, sample.received + ahead) for sample in samples],
            next((reason for reason in map(_reason, reversed(events)) if reason), ""),
            "" if self._robot.connected else self._waiting(),
            [f"the robot says {event}" for event in events if isinstance(event, rtde.TextEvent)],
        )

    async def close(self) -> None:
        """See `PackageSource`."""
        await self._robot.close()

    def _waiting(self) -> str:
        loss = self._robot.last_loss
        return f"waiting for the robot: {loss.text}" if loss is not None else "waiting for the robot"

    def _compare(self, found: object) -> None:
        """A recording has the same columns from its beginning to its end."""
        from gatewayd.rtde.recipe import Recipe

        assert self._layout is not None
        if isinstance(found, Recipe) and found.kinds != self._layout.recipe.kinds:
            raise SourceRefusedError(
                f"{self._robot.address} came back with other fields or types than the recording has: begin another one"
            )


def _reason(event: rtde.RobotEvent) -> str:
    """Why packages are missing, if it is an event that says so."""
    if isinstance(event, rtde.LostEvent):
        return event.loss.text
    if isinstance(event, rtde.OverflowEvent):
        return f"{counted(event.lost, 'package')} came faster than the file was written"
    return ""
