"""Requests that nothing here serves, from any peer: no write is refused by them, and nobody owns what they are about.

They are what everybody meets on the first day: a wrong unit, an address beside the mapped ones. A cell counts and
records them, worded by the link that they came to.
"""

from __future__ import annotations

from enum import IntEnum


class Unserved(IntEnum):
    """Why. The numbers stand in the status block: never renumber, only append."""

    NO_SUCH_UNIT = 1
    NO_SUCH_ADDRESS = 2
    NO_SUCH_FUNCTION = 3
    MALFORMED = 4
    NOT_ALLOWED = 5
    ROBOT_LOST = 6
    NOT_IN_ROLE = 7

    @property
    def text(self) -> str:
        """The reason in words, for logs and tables."""
        return _TEXTS[self]


_TEXTS = {
    Unserved.NO_SUCH_UNIT: "no such unit",
    Unserved.NO_SUCH_ADDRESS: "nothing at this address",
    Unserved.NO_SUCH_FUNCTION: "function not served",
    Unserved.MALFORMED: "quantity, length or value out of range",
    Unserved.NOT_ALLOWED: "not readable, or not writable",
    Unserved.ROBOT_LOST: "held back without the robot",
    Unserved.NOT_IN_ROLE: "no right to it by role",
}
