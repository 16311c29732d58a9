"""Properties of a controller: what it is made of, by message 82, which is in no guide (UR's newest client libraries).

Pure. Controllers before 5.26 and 10.15 do not know the message and stay silent: a question may remain without an
answer for good.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from gatewayd.report.format import counted
from gatewayd.rtde.codec import ProtocolError
from gatewayd.rtde.messages import PropertiesReply
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.types import DataType

_MOST_OPEN = 8

PropertyValue = Scalar | tuple[Scalar, ...]
"""A number, or one for each element of a vector."""


@dataclass(frozen=True, slots=True)
class KnownProperty:
    """A property that UR's client libraries name."""

    name: str
    type: DataType
    comment: str


KNOWN_PROPERTIES: Mapping[str, KnownProperty] = {
    known.name: known
    for known in (
        KnownProperty(
            "v1.software.version", DataType.UINT64, "software: major << 48 | minor << 32 | bugfix << 16"
        ),
        KnownProperty("v1.control_box.type", DataType.UINT32, "control box: type << 24 | subtype << 16"),
        KnownProperty(
            "v1.robot_arm.tool_flange.type", DataType.UINT32, "tool flange: type << 24 | revision << 16"
        ),
    )
}
"""By name."""


class PropertyQuestions:
    """The questions of one connection that are not answered yet; answers come in the order of the questions."""

    def __init__(self) -> None:
        self._open: deque[tuple[int, Callable[[PropertiesReply], None]]] = deque()

    def ask(self, names: tuple[str, ...], answered: Callable[[PropertiesReply], None]) -> bool:
        """Note a question; False if so many are open that no answer is to be expected."""
        if len(self._open) >= _MOST_OPEN:
            return False
        self._open.append((len(names), answered))
        return True

    def answer(self, reply: PropertiesReply) -> str:
        """Hand an answer to the caller that asked; in words what is odd about it, if anything is."""
        if not self._open:
            return "properties that were not asked for"
        count, answered = self._open.popleft()
        if len(reply.types) != count:
            return f"{counted(len(reply.types), 'type')} for {counted(count, 'property')}"
        answered(reply)
        return ""


def sort_properties(
    names: tuple[str, ...], reply: PropertiesReply
) -> tuple[dict[str, PropertyValue], dict[str, str]]:
    """The values by name, and the words of the names that have none: NOT_FOUND, NOT_SET, a type unknown to us.

    No values if any name has none. ProtocolError if the values do not fit the types.
    """
    missing = {
        name: word for name, word in zip(names, reply.types, strict=True) if word not in DataType.__members__
    }
    if missing:
        return {}, missing
    recipe = Recipe(names, [DataType.from_word(word) for word in reply.types])
    if len(reply.payload) < recipe.size:
        reason = f"properties with {counted(len(reply.payload), 'byte')} of values, {recipe.size} expected"
        raise ProtocolError(reason, len(reply.payload), reply.payload, within="payload")
    flat = recipe.unpack(reply.payload[: recipe.size])
    return {
        name: flat[slot.start] if kind.count == 1 else flat[slot]
        for (name, kind), slot in zip(recipe.kinds.items(), recipe.slots.values(), strict=True)
    }, {}
