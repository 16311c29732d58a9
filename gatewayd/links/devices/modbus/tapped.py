"""Lines whose frames can be traced."""

from __future__ import annotations

from gatewayd.links.contract import Passage, Tap
from gatewayd.loop import clock
from gatewayd.modbus.client.runner import Channel, LineRunner
from gatewayd.modbus.client.tcp import TcpLine


class TappedRunner(LineRunner):
    """Hands its tap what passes, while there is one."""

    tap: Tap | None = None
    peer = ""
    """How the line is called in a trace."""

    def received(self, data: bytes) -> None:
        """See LineRunner."""
        if self.tap is not None:
            self.tap(Passage(clock.now(), data, outgoing=False, peer=self.peer, cell=None))
        super().received(data)


class TappedChannel:
    """A connection of such a line."""

    def __init__(self, runner: TappedRunner, channel: Channel) -> None:
        self._runner = runner
        self._channel = channel

    def send(self, data: bytes) -> None:
        """See Channel."""
        if self._runner.tap is not None:
            self._runner.tap(Passage(clock.now(), data, outgoing=True, peer=self._runner.peer, cell=None))
        self._channel.send(data)

    def close(self) -> None:
        """See Channel."""
        self._channel.close()


class TappedTcpLine(TappedRunner, TcpLine):
    """A line on a TCP connection."""

    async def open(self) -> TappedChannel:  # type: ignore[override]
        """See LineRunner."""
        return TappedChannel(self, await super().open())
