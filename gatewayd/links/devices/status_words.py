"""What the status block has of each device."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from gatewayd.links.contract import Level, LinkHealth

MAX_DEVICES: Final = 32
"""Devices of a cell that have words in the status block."""
NEVER: Final = 0xFFFF
"""An age that is none, or too great for a word."""
CODES: Final = (1, 2, 3, 4, 5, 6, 10, 11)
"""Exception codes of Modbus that have a word each (Application Protocol V1.1b3, 7)."""


class DeviceState(IntEnum):
    """State of a device. The numbers stand in the status block: never renumber, only append."""

    NONE = 0
    STARTING = 1
    GOOD = 2
    PARTIAL = 3
    LOST = 4
    REFUSING = 5

    @property
    def text(self) -> str:
        """As the control interface has it."""
        return self.name.lower()


STATUS_WORDS: Final = (
    (
        "state",
        "0 no device, 1 starting, 2 good, 3 partial (some values are lost), 4 lost, 5 refuses everything",
    ),
    ("round_trip", "0.1 ms from the last request to its answer"),
    ("age", "milliseconds since the last answer; 65535: never, or longer"),
    ("answers", "requests that were answered, wraps"),
    ("timeouts", "requests that were not answered in time, wraps"),
    ("errors", "answers that could not be read, and connections that were lost, wraps"),
    ("refused", "requests that the device refused, by whatever code, wraps"),
    ("refused_01", "of these exception 01: function not known"),
    ("refused_02", "exception 02: no such address"),
    ("refused_03", "exception 03: no such value"),
    ("refused_04", "exception 04: device failure"),
    ("refused_05", "exception 05: it takes longer"),
    ("refused_06", "exception 06: busy"),
    ("refused_0A", "exception 0A: no path to the unit"),
    ("refused_0B", "exception 0B: the unit does not answer"),
    ("losses", "times that it was lost, wraps"),
)
"""Name and meaning of the words of one device."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceFigures:
    """How a device is at one moment, whatever its family."""

    state: DeviceState
    reason: str
    """Why it is not good; empty where it is."""
    round_trip: float | None
    """Seconds from the last request to its answer."""
    age: float | None
    """Seconds since the last answer."""
    answers: int
    timeouts: int
    errors: int
    refused: Mapping[int, int]
    """Requests that the device refused, by its code."""
    losses: int

    @property
    def words(self) -> tuple[int, ...]:
        """For the status block."""
        counts = (self.answers, self.timeouts, self.errors, sum(self.refused.values()))
        by_code = (self.refused.get(code, 0) for code in CODES)
        return (
            self.state,
            0 if self.round_trip is None else min(NEVER, round(10_000 * self.round_trip)),
            NEVER if self.age is None else min(NEVER, max(0, round(1000 * self.age))),
            *(count & NEVER for count in (*counts, *by_code, self.losses)),
        )

    @property
    def fields(self) -> dict[str, object]:
        """For the control interface, and metrics."""
        return {
            "state": self.state.text,
            "reason": self.reason,
            "up": int(self.state in (DeviceState.GOOD, DeviceState.PARTIAL)),
            "round_trip": self.round_trip,
            "age": None if self.age is None else round(self.age, 3),
            "answers": self.answers,
            "timeouts": self.timeouts,
            "errors": self.errors,
            "exceptions": {f"{code:02X}": count for code, count in sorted(self.refused.items())},
            "losses": self.losses,
        }

    def health(self, name: str, figures: Mapping[str, object]) -> LinkHealth:
        """For verdict, picture and page; `figures`: what the family says besides."""
        level = _LEVELS[self.state]
        remedy = _REMEDIES.get(self.state, "")
        problems = (f"device {name} {_WORDS[self.state]}: {self.reason}{remedy}",) if self.reason else ()
        detail = "" if self.round_trip is None else f"{1000 * self.round_trip:.1f} ms"
        found = {**figures, **self.fields}
        return LinkHealth(f"device {name}", level, self.reason or "answers", detail, problems, found)


_LEVELS: Final = {
    DeviceState.NONE: Level.IDLE,
    DeviceState.STARTING: Level.WARN,
    DeviceState.GOOD: Level.GOOD,
    DeviceState.PARTIAL: Level.WARN,
    DeviceState.LOST: Level.BAD,
    DeviceState.REFUSING: Level.BAD,
}
_REMEDIES: Final = {
    DeviceState.LOST: "; look at its power, its cable and its address",
    DeviceState.REFUSING: "; look at the number of the unit or node, and at the addresses in the device's manual",
}
_WORDS: Final = {
    DeviceState.NONE: "is none",
    DeviceState.STARTING: "is not there yet",
    DeviceState.GOOD: "answers",
    DeviceState.PARTIAL: "is there in part",
    DeviceState.LOST: "is lost",
    DeviceState.REFUSING: "refuses everything",
}
