"""Why a reload must not happen unasked: what it would take from an owner or leave in a robot, and the like.

Each objection has a kind by which it may be accepted (`gatewayd reload --accept KIND`). The words are a
contract: scripts name them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType


class ObjectionKind(StrEnum):
    """What it is that must not happen unasked; `MEANINGS` says it in words."""

    RELEASE = "release"
    OWNED = "owned"
    LEFT = "left"
    WATCHDOG = "watchdog"
    DIRECTION = "direction"
    WEAKENING = "weakening"
    NUMBERS = "numbers"
    IDENTITY = "identity"
    GONE = "gone"


MEANINGS: Mapping[ObjectionKind, str] = MappingProxyType(
    {
        ObjectionKind.RELEASE: "an owner would lose what it owns now, and the robot would get the release fallback",
        ObjectionKind.OWNED: "a variable that is owned now would mean something else, and its owner would keep it",
        ObjectionKind.LEFT: "the robot would keep a value that nobody could clear any more",
        ObjectionKind.WATCHDOG: "the robot's watchdog would not be fed for a moment: its program may stop",
        ObjectionKind.DIRECTION: "a variable would turn from input to output or back",
        ObjectionKind.WEAKENING: "a promise that others rely on would become weaker",
        ObjectionKind.NUMBERS: "requests for locks by number, which were used, would mean other variables",
        ObjectionKind.IDENTITY: "a master that checks the identity of a node would not know it again",
        ObjectionKind.GONE: "many variables of a cell, or a whole cell, would be gone: is it the right file?",
    }
)


@dataclass(frozen=True, slots=True)
class Objection:
    """One reason why not, in words; the cell is not named."""

    kind: ObjectionKind
    text: str
