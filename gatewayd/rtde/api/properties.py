"""The properties that a controller tells, as a program sees them."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from gatewayd.rtde.api.errors import RtdeError
from gatewayd.rtde.client import RtdeClient
from gatewayd.rtde.codec import ProtocolError
from gatewayd.rtde.messages import PropertiesReply
from gatewayd.rtde.properties import PropertyValue, sort_properties


@dataclass(frozen=True, slots=True, eq=False)
class Properties(Mapping[str, PropertyValue]):
    """What a controller has reported of itself: a mapping of the names that have a value."""

    answered: bool
    """False: no answer came in time, as from every controller before 5.26 and 10.15."""
    found: Mapping[str, PropertyValue] = field(default_factory=dict)
    missing: Mapping[str, str] = field(default_factory=dict)
    """The controller's word for each name without a value: NOT_FOUND, NOT_SET."""

    def __getitem__(self, name: str) -> PropertyValue:
        try:
            return self.found[name]
        except KeyError:
            reason = self.missing.get(name, "was not asked for" if self.answered else "no answer")
            message = f"{name}: {reason}"
            raise KeyError(message) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self.found)

    def __len__(self) -> int:
        return len(self.found)


async def ask_properties(client: RtdeClient, names: tuple[str, ...], seconds: float) -> Properties:
    """Ask once, and once more without the names that have no value: one of them keeps all values back.

    RtdeError for an answer that cannot be read.
    """
    reply = await _ask(client, names, seconds)
    if reply is None:
        return Properties(answered=False)
    found, missing = _sorted(names, reply)
    rest = tuple(name for name in names if name not in missing)
    if missing and rest:
        reply = await _ask(client, rest, seconds)
        if reply is not None:
            found, more = _sorted(rest, reply)
            missing |= more
    return Properties(True, found, missing)


def _sorted(
    names: tuple[str, ...], reply: PropertiesReply
) -> tuple[dict[str, PropertyValue], dict[str, str]]:
    try:
        return sort_properties(names, reply)
    except ProtocolError as error:
        raise RtdeError(str(error)) from error


async def _ask(client: RtdeClient, names: tuple[str, ...], seconds: float) -> PropertiesReply | None:
    answer: asyncio.Future[PropertiesReply] = asyncio.get_running_loop().create_future()

    def answered(reply: PropertiesReply) -> None:
        if not answer.done():
            answer.set_result(reply)

    if not client.properties(names, answered):
        return None
    try:
        async with asyncio.timeout(seconds):
            return await answer
    except TimeoutError:
        return None
