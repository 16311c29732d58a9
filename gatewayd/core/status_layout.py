"""Where what lies in the status block: fixed addresses, which PLC programs have built in. Entries are only appended."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.program import STATES
from gatewayd.core.refusal import Reason
from gatewayd.core.unserved import Unserved

LAYOUT_VERSION = 1
BASE = 60000
"""Protocol address of the first word, in holding and in input registers."""
MAX_VARIABLES = 1024
MAX_WRITERS = 32
REQUEST = 40
"""Offset of the word into which a writer puts the number of a variable whose lock it wants."""
RELEASE = 41
"""Offset of the word into which a writer puts the number of a variable whose lock it gives back."""
RELEASE_ALL = 0xFFFF
"""Written to `RELEASE`: give back every lock I own."""


def _numbered(numbers: Iterable[IntEnum]) -> str:
    return ", ".join(f"{number.value} {number.name.lower().replace('_', ' ')}" for number in numbers)


def _program_states() -> str:
    return ", ".join(f"{state + 1} {name}" for state, (name, _) in STATES.items())


@dataclass(frozen=True, slots=True)
class StatusField:
    """One number of the header, `offset` words after `BASE`, `words` long."""

    offset: int
    words: int
    name: str
    meaning: str


class StatusTable(StatusField):
    """A table with one entry for each variable or writer, `offset` words after `BASE`."""


@dataclass(frozen=True, slots=True)
class LinkTable(StatusTable):
    """A table that links report (`Cell.health.tables`), each its own entries: by number from 0, several words each."""

    entry: tuple[tuple[str, str], ...]
    """Name and meaning of each word of an entry."""


FIELDS = (
    StatusField(0, 1, "layout", "version of this layout, 1"),
    StatusField(
        1,
        1,
        "flags",
        "bit 0 robot values fresh, 1 robot connected and writable, 2 every variable good, 3 some lock is owned, "
        "4 something was refused since the start, 5 read-back differed since the start, 6 robot watchdog is fed",
    ),
    StatusField(2, 2, "fingerprint", "32 bits that change with the meaning of the mapping"),
    StatusField(4, 1, "heartbeat", "counts up every 100 ms while the gateway lives, wraps"),
    StatusField(5, 1, "variables", "number of variables"),
    StatusField(6, 1, "writers", "number of declared writers"),
    StatusField(7, 1, "robot_state", _numbered(Source)),
    StatusField(8, 2, "uptime", "seconds since the gateway started"),
    StatusField(10, 2, "robot_age", "age of the newest package that reported anything new, in milliseconds"),
    StatusField(12, 1, "frequency", "packages per second, measured, in 0.1 Hz"),
    StatusField(13, 1, "sessions", "sessions with the controller since the start, wraps"),
    StatusField(14, 2, "packages", "packages received"),
    StatusField(16, 2, "skipped", "packages that the controller left out"),
    StatusField(18, 2, "late", "packages that came late"),
    StatusField(20, 2, "accepted", "write requests applied"),
    StatusField(22, 2, "refused", "requests refused"),
    StatusField(24, 2, "mismatches", "inputs whose read-back differed from what was written"),
    StatusField(30, 1, "refusal_reason", "last refusal: " + ", ".join(f"{r.value} {r.text}" for r in Reason)),
    StatusField(31, 1, "refusal_variable", "number of the variable in the last refusal"),
    StatusField(
        32,
        1,
        "refusal_writer",
        "number of the writer that was refused; 0 if it is not declared, 255 the local operator",
    ),
    StatusField(33, 1, "refusal_holder", "number of the writer that held it; 255 the local operator"),
    StatusField(34, 2, "refusal_age", "milliseconds since the last refusal"),
    StatusField(REQUEST, 1, "request", "write a variable's number to take its lock; reads 0"),
    StatusField(
        RELEASE, 1, "release", "write a variable's number to give its lock back, 65535 for all; reads 0"
    ),
    StatusField(42, 1, "unadopted", "inputs whose content in the robot is not known"),
    StatusField(43, 1, "differing", "inputs for which the robot holds something else than it was given"),
    StatusField(
        44,
        2,
        "lag",
        "milliseconds by which the newest package came later than the quickest ones; part of ages",
    ),
    StatusField(
        46,
        1,
        "adoption",
        "seconds until adopted inputs that nobody owns fall back; 0: they have, or never will",
    ),
    StatusField(47, 1, "program", f"state of the robot program: 0 unknown, {_program_states()}"),
    StatusField(48, 1, "gaps", "times that the gateway stood still, wraps"),
    StatusField(49, 2, "unserved", "requests that nothing here serves: wrong unit, address or quantity"),
    StatusField(
        51, 1, "unserved_reason", "the last of them: " + ", ".join(f"{u.value} {u.text}" for u in Unserved)
    ),
)
"""The core's own numbers; kinds of links have others between them (`LinkKind.status_fields`)."""
HEADER_WORDS = 64
TABLES = (
    StatusTable(
        64, 64, "good", "one bit for each variable, 1 = good; variable n is bit (n-1)%16 of word (n-1)/16"
    ),
    StatusTable(128, 64, "writers_alive", "one word for each writer: 1 = connected and heard in time"),
    StatusTable(
        192,
        MAX_VARIABLES,
        "owner",
        "one word for each variable: number of the writer that owns it; 255 the local operator",
    ),
    StatusTable(
        1216, MAX_VARIABLES, "lease", "one word for each variable: milliseconds of its owner's lease left"
    ),
    StatusTable(2240, MAX_VARIABLES, "age", "one word for each variable: age of its value in milliseconds"),
    StatusTable(3264, MAX_VARIABLES, "quality", f"one word for each variable: {_numbered(Quality)}"),
)
LINK_TABLES = 4288
"""Offset of the first table of links."""
LENGTH = 4800
"""Words of the whole block."""
_END = BASE + LENGTH


def covers(address: int, count: int) -> bool:
    """Whether `count` registers from `address` on all belong to the block."""
    return address >= BASE and address + count <= _END
