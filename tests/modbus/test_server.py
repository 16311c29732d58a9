from __future__ import annotations

from collections.abc import Awaitable, Callable

Ask = Callable[..., Awaitable[str]]


async def test_answers_a_read(ask: Ask) -> None:
    assert await ask("03 0000 0001") == "03 02 00 00"


async def test_applies_a_write_and_shows_it(ask: Ask) -> None:
    assert await ask("10 000b 0002 04 ffff fffe") == "10 00 0b 00 02"
    assert await ask("03 000b 0002") == "03 04 ff ff ff fe"
