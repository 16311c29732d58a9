"""A controller that serves a session properly and says what a terminal should never get.

python -m tests.e2e.talking_controller HOST WORD TEXT
    Prints its port. Every output_int_register_1 has the type WORD; TEXT is said once in each session, each of them
    written in ASCII with escapes (`unicode_escape`).
"""

from __future__ import annotations

import asyncio
import struct
import sys
from contextlib import suppress

_HEAD = struct.Struct(">HB")
_TYPES = {"timestamp": "DOUBLE", "runtime_state": "UINT32", "actual_TCP_pose": "VECTOR6D"}
_SIZES = {"DOUBLE": 8, "UINT32": 4, "INT32": 4, "VECTOR6D": 48}
_PERIOD = 0.01
_STRANGE = b"output_int_register_1"


def _type(name: str) -> str:
    if "bit_registers" in name:
        return "UINT32"
    return "INT32" if "int_register" in name else _TYPES.get(name, "DOUBLE")


class TalkingController:
    """One session after the other."""

    def __init__(self, word: bytes, text: bytes) -> None:
        self._word, self._text = word, text
        self._sent = 0

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        streaming: asyncio.Task[None] | None = None
        recipe: list[str] = []
        with suppress(OSError, asyncio.IncompleteReadError):
            while True:
                size, kind = _HEAD.unpack(await reader.readexactly(_HEAD.size))
                payload = await reader.readexactly(size - _HEAD.size)
                if kind == ord("O"):
                    recipe = payload[8:].decode("ascii").split(",")
                if kind != ord("U"):
                    writer.write(self._answer(kind, payload))
                if kind == ord("S") and streaming is None:
                    body = bytes((len(self._text),)) + self._text + b"\x03\x1b[m\x00"
                    writer.write(self._message(b"M" + body))
                    streaming = asyncio.create_task(self._stream(writer, recipe))
        if streaming is not None:
            streaming.cancel()
        writer.transport.abort()

    def _answer(self, kind: int, payload: bytes) -> bytes:
        names = payload[8:] if kind == ord("O") else payload
        return self._message(
            {
                ord("V"): b"V\x01",
                ord("v"): b"v" + struct.pack(">4I", 5, 12, 0, 1101),
                ord("O"): b"O\x01" + b",".join(map(self._word_for, names.split(b","))),
                ord("I"): b"I\x01" + b",".join(map(self._word_for, names.split(b","))),
            }.get(kind, bytes((kind, 1)))
        )

    def _word_for(self, name: bytes) -> bytes:
        return self._word if name == _STRANGE else _type(name.decode("ascii")).encode("ascii")

    def _message(self, body: bytes) -> bytes:
        return struct.pack(">H", len(body) + 2) + body

    async def _stream(self, writer: asyncio.StreamWriter, recipe: list[str]) -> None:
        while True:
            self._sent += 1
            values = [
                struct.pack(">d", self._sent * _PERIOD) if name == "timestamp" else bytes(_SIZES[_type(name)])
                for name in recipe
            ]
            writer.write(self._message(b"U\x01" + b"".join(values)))
            await writer.drain()
            await asyncio.sleep(_PERIOD)


async def _serve(host: str, word: str, text: str) -> None:
    said = [argument.encode("ascii").decode("unicode_escape").encode("utf-8") for argument in (word, text)]
    server = await asyncio.start_server(TalkingController(*said).serve, host, 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(_serve(*sys.argv[1:4]))
