"""Lines whose frames can be traced."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from gatewayd.links.contract import Passage, Tap
from gatewayd.links.devices.concerned import Concerned
from gatewayd.loop import clock
from gatewayd.modbus.client.runner import Channel, LineRunner
from gatewayd.modbus.client.tcp import TcpLine
from gatewayd.modbus.frames import HEADER_SIZE

_UNIT_IN_HEADER: Final = HEADER_SIZE - 1


class TappedRunner(LineRunner):
    """Hands its tap what passes, while there is one."""

    tap: Tap | None = None
    peer = ""
    """How the line is called in a trace."""
    is_rtu = False
    """Frames begin with the unit, and have no header."""
    concerned: Callable[[int], Concerned] = staticmethod(lambda _unit: Concerned())
    """The devices that a frame from or to a unit concerns."""
    _asked = 0
    """The unit that the last request went to."""

    def received(self, data: bytes) -> None:
        """See LineRunner."""
        if self.tap is not None:
            # Without a header a piece does not say whose it is: one unit at a time is asked.
            has_header = not self.is_rtu and len(data) >= HEADER_SIZE
            self._pass(data, data[_UNIT_IN_HEADER] if has_header else self._asked, outgoing=False)
        super().received(data)

    def sent(self, data: bytes) -> None:
        """A frame goes out."""
        if self.tap is not None:
            self._asked = data[0 if self.is_rtu else _UNIT_IN_HEADER]
            self._pass(data, self._asked, outgoing=True)

    def _pass(self, data: bytes, unit: int, *, outgoing: bool) -> None:
        assert self.tap is not None
        cell, links = self.concerned(unit)
        self.tap(Passage(clock.now(), data, outgoing, peer=self.peer, cell=cell, links=links))


class TappedChannel:
    """A connection of such a line."""

    def __init__(self, runner: TappedRunner, channel: Channel) -> None:
        self._runner = runner
        self._channel = channel

    def send(self, data: bytes) -> None:
        """See Channel."""
        self._runner.sent(data)
        self._channel.send(data)

    def close(self) -> None:
        """See Channel."""
        self._channel.close()


class TappedTcpLine(TappedRunner, TcpLine):
    """A line on a TCP connection."""

    async def open(self) -> TappedChannel:  # type: ignore[override]
        """See LineRunner."""
        return TappedChannel(self, await super().open())
