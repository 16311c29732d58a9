"""The sending side of a connection: messages to packages on a transport, for as long as it is open."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from gatewayd.rtde.codec import ClientProtocol
from gatewayd.rtde.messages import ExecutableMessage

_GOODBYE = 0.2

StreamTap = Callable[[bytes, bool, tuple[str, int] | None], None]
"""Takes bytes, whether we sent them, and our end of the connection as its socket has it."""


class PackageSender:
    """Writes to one transport by the codec of its connection."""

    def __init__(self, codec: ClientProtocol) -> None:
        self.tap: StreamTap | None = None
        """Gets all bytes as they pass, while somebody traces."""
        self.own: tuple[str, int] | None = None
        """Our end, as its socket has it."""
        self.peer: tuple[str, int] | None = None
        """The controller's end."""
        self._codec = codec
        self._transport: asyncio.Transport | None = None

    def open(self, transport: asyncio.Transport) -> None:
        """Write to this transport from now on."""
        self._transport = transport
        self.own = transport.get_extra_info("sockname")
        self.peer = transport.get_extra_info("peername")

    def received(self, data: bytes) -> None:
        """Show what came to the trace."""
        if self.tap is not None:
            self.tap(data, False, self.own)

    def write(self, message: ExecutableMessage) -> int:
        """Send a message; how many bytes are waiting to be taken."""
        transport = self._transport
        assert transport is not None
        package = self._codec.send(message)
        if self.tap is not None:
            self.tap(package, True, self.own)
        transport.write(package)
        return transport.get_write_buffer_size()

    def abort(self) -> None:
        """Close at once."""
        if self._transport is not None:
            self._transport.abort()

    async def close(self, lost: asyncio.Future[None]) -> None:
        """Let what was sent reach the controller, then close; `lost` is done when the connection is."""
        transport = self._transport
        if transport is None or lost.done():
            return
        try:
            if not transport.is_closing():
                transport.write_eof()
                await asyncio.wait((lost,), timeout=_GOODBYE)
        finally:
            transport.abort()
