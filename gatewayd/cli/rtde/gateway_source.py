"""Packages of a robot that a running gateway serves, from its control socket: no second connection to the robot."""

from __future__ import annotations

import asyncio
from collections.abc import Generator, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from gatewayd.cli.rtde.recorder import SourceLayout, Values
from gatewayd.cli.rtde.sources import Arrivals, SourceLostError, SourceRefusedError
from gatewayd.control.client import NoDaemon
from gatewayd.loop.threads import in_daemon_thread
from gatewayd.rtde.codec import ProtocolError
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

if TYPE_CHECKING:
    from gatewayd.control.client import Client

_FIRST_LAYOUT = 2.0
"""Seconds in which a gateway that has a session with its robot says what the packages have."""
_AGAIN = 0.5
_NO_SESSION = "the gateway has no session with the robot"
_ENDED = "the gateway has ended"


class GatewaySource:
    """The packages of one cell, whose fields have to have the types that `declared` names.

    `reconnect`: wait for the robot and the gateway, and go on when they are back.
    What the gateway refuses is raised as `gatewayd.control.client.ControlError`.
    """

    def __init__(
        self,
        client: Client,
        cell: str | None,
        declared: Mapping[str, DataType | None],
        *,
        reconnect: bool = False,
    ) -> None:
        self.waiting = ""
        self._client = client
        self._cell = cell
        self._declared = declared
        self._reconnect = reconnect
        self._rows: Iterator[dict[str, Any]] | None = None
        self._pending: asyncio.Future[dict[str, Any] | None] | None = None
        self._layout: SourceLayout | None = None
        self._dropped = 0

    async def open(self) -> SourceLayout:
        """See `PackageSource`."""
        left = _FIRST_LAYOUT
        while self._layout is None:
            if left <= 0 and not self._reconnect:
                raise SourceLostError(f"{_NO_SESSION}: see gatewayd status")
            self.waiting = f"waiting: {_NO_SESSION}"
            arrivals = await self.next(0.2)
            left -= 0.2
            self.waiting = arrivals.waiting or self.waiting
        return self._layout

    async def next(self, patience: float) -> Arrivals:
        """See `PackageSource`."""
        try:
            row = await self._row(patience)
        except NoDaemon as error:
            if self._layout is None:
                raise
            if not self._reconnect:
                raise SourceLostError(str(error)) from error
            await asyncio.sleep(_AGAIN)
            return Arrivals(lost=_ENDED, waiting=f"waiting for the gateway: {error}")
        if row is None:
            return Arrivals()
        try:
            return self._arrivals(row)
        except (LookupError, TypeError, ArithmeticError, ValueError, ProtocolError) as error:
            raise SourceRefusedError(f"the gateway sent what is no package: {error}") from error

    async def close(self) -> None:
        """See `PackageSource`."""
        if self._pending is not None:
            self._pending.cancel()

    async def _row(self, patience: float) -> dict[str, Any] | None:
        """The next object; None if there is none in time."""
        if self._rows is None:
            self._rows = self._client.follow("/v1/packages", cell=self._cell)
            self._dropped = 0
        if self._pending is None:
            rows = self._rows
            self._pending = asyncio.ensure_future(in_daemon_thread(lambda: next(rows, None), "gateway"))
        await asyncio.wait((self._pending,), timeout=patience)
        if not self._pending.done():
            return None
        pending, self._pending = self._pending, None
        try:
            row = pending.result()
        except BaseException:
            self._rows = None
            raise
        if row is None:
            self._rows = None
            raise NoDaemon(_ENDED)
        return row

    def _arrivals(self, row: dict[str, Any]) -> Arrivals:
        if "layout" in row:
            self._set_up(row["layout"])
            return Arrivals()
        if "packages" in row and self._layout is not None:
            return Arrivals(list(self._packages(row["packages"])))
        if "dropped" in row:
            self._dropped, before = int(row["dropped"]), self._dropped
            return Arrivals(lost=f"the gateway dropped {self._dropped - before}: the recorder was too slow")
        if "lost" in row and self._layout is not None:
            if not self._reconnect:
                raise SourceLostError(str(row["lost"]))
            return Arrivals(lost=str(row["lost"]), waiting=f"waiting for the robot: {row['lost']}")
        return Arrivals()

    def _packages(self, rows: list[tuple[float, str]]) -> Generator[tuple[Values, float], None, None]:
        assert self._layout is not None
        unpack = self._layout.recipe.unpack
        for received, data in rows:
            yield unpack(bytes.fromhex(data)), float(received)

    def _set_up(self, layout: dict[str, Any]) -> None:
        recipe = Recipe(layout["names"], [DataType.from_word(word) for word in layout["types"]])
        for name, kind in recipe.kinds.items():
            declared = self._declared.get(name)
            if declared is not None and declared is not kind:
                raise SourceRefusedError(
                    f"{name} was declared as {declared.word}, the gateway has {kind.word}"
                )
        if self._layout is not None and recipe.kinds != self._layout.recipe.kinds:
            raise SourceRefusedError(
                "the gateway now has other fields of the robot than the recording has: begin another one"
            )
        self._layout = SourceLayout(recipe, float(layout["period"]))
