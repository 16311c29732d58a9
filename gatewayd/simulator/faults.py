"""What can be made to go wrong, and with which probability: switches of the simulated controller.

Everything here is off by default, and may be thrown while the simulator runs unless it is about the start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from random import Random
from typing import NamedTuple

from gatewayd.rtde.catalogue import is_fieldbus_range
from gatewayd.rtde.fields import INPUTS

ADAPTERS = {"profinet": "PROFINET adapter", "ethernet-ip": "EtherNet/IP adapter"}
"""Fieldbus adapters of the controller that act as an RTDE client inside it, and how the log names them."""

ADAPTER_FIELDS: tuple[str, ...] = tuple(
    name for name in INPUTS if is_fieldbus_range(name) or not name.startswith(("input_", "external_"))
)
"""The inputs an enabled adapter claims, as users of real controllers report them."""


class LongLists(Enum):
    """What a controller does with a list of names that is longer than `OLD_LIST_LIMIT`."""

    TAKE = "take"
    REFUSE = "refuse"
    """Answer with recipe id 0 and the types of all fields."""
    COMPLAIN = "complain"
    """Send a text message in place of an answer."""
    IGNORE = "ignore"
    """Send nothing at all."""
    CLOSE = "close"
    """Close the connection."""


class FaultStep(Enum):
    """A step of a connection: a request, by what it asks for, or the sending of a data package."""

    VERSION = "version"
    CONTROLLER = "controller"
    OUTPUTS = "outputs"
    INPUTS = "inputs"
    START = "start"
    PAUSE = "pause"
    WRITE = "write"
    """An input package."""
    DATA = "data"
    """An output package."""


class DropAt(NamedTuple):
    """The step at which connections are closed, before it is answered or sent."""

    step: FaultStep
    number: int = 1
    """Which one of its kind on a connection."""

    @classmethod
    def parse(cls, text: str) -> DropAt:
        """Read "outputs" or "outputs:2"; ValueError names what is possible."""
        word, _, number = text.partition(":")
        steps = {step.value: step for step in FaultStep}
        if word not in steps or not (number or "1").isdecimal() or int(number or "1") < 1:
            message = f"{text!r} is not STEP or STEP:NUMBER, where STEP is one of {', '.join(steps)}"
            raise ValueError(message)
        return cls(steps[word], int(number or "1"))


class DroppedError(Exception):
    """The connection is to be closed here."""


@dataclass(slots=True)
class Faults:
    """The switches. Durations in seconds, probabilities from 0 to 1 per data package."""

    v1_only: bool = False
    """Refuse protocol version 2."""
    text_on_connect: str | None = None
    """Text message sent before anything was asked, hence in protocol v1 layout."""
    boot_restart: float | None = None
    """Restart the interface once this long after the start: connections closed, registers and timestamp back to 0."""
    adapter: str | None = None
    """One of `ADAPTERS`: claims `ADAPTER_FIELDS` for good."""
    hold: tuple[str, ...] = ()
    """Inputs claimed by the controller itself from the start."""
    long_lists: LongLists = LongLists.TAKE
    """What becomes of lists of names beyond `OLD_LIST_LIMIT`."""
    unreadable: frozenset[str] = frozenset()
    """Inputs that are NOT_FOUND as outputs: they can be claimed and not be read back."""
    drop_at: DropAt | None = None
    """Close connections at this step."""
    drop_times: float = 1
    """How many connections to close there from now on; infinity: each."""
    delay: float = 0.0
    """How late everything leaves, in order."""
    linger: float = 0.0
    """How long claims outlive their connection."""
    overflow_close: float | None = 1.0
    """Close a client that has not read for this long once its buffers are full, or whose machine has acknowledged
    nothing for this long: its power or cable is gone. None only skips its packages."""
    drop: float = 0.0
    """Probability that a package is not sent."""
    duplicate: float = 0.0
    """Probability that a package is sent twice."""
    split: float = 0.0
    """Probability that a package leaves in two segments, one cycle apart."""
    seed: int = 0
    """Seed of the three probabilities; each connection draws its own sequence from it."""
    freeze: bool = False
    """Packages go on, the timestamp and everything that follows from it stands still."""
    creep: bool = False
    """As `freeze`, but the timestamp goes on by 1 ns a cycle: it changes, and says nothing."""
    silence: bool = False
    """No data packages; everything else is answered."""

    def drops(self, step: FaultStep, number: int) -> bool:
        """Whether the connection is to be closed at this step, its `number`th of the kind; counts those closed."""
        if self.drop_at != (step, number) or self.drop_times < 1:
            return False
        if self.drop_times < math.inf:
            self.drop_times -= 1
        return True

    @property
    def mangles(self) -> bool:
        """Whether any data package may be touched."""
        return bool(self.drop or self.duplicate or self.split)


class Mangler:
    """Loses, doubles and splits the data packages of one connection, reproducibly."""

    def __init__(self, faults: Faults, connection: int) -> None:
        self._faults = faults
        self._random = Random(f"{faults.seed}/{connection}")
        self._rest = b""

    def mangle(self, package: bytes) -> bytes:
        """The bytes to send in this cycle in place of `package`, the held back rest of the last one first."""
        chance, faults = self._random.random, self._faults
        drop, duplicate, split = chance() < faults.drop, chance() < faults.duplicate, chance() < faults.split
        out = b"" if drop else package * 2 if duplicate else package
        if not split or not out:
            return self.flush() + out
        cut = self._random.randrange(1, len(package))
        now, rest = self.flush() + out[:cut], out[cut:]
        self._rest = rest
        return now

    def flush(self) -> bytes:
        """The rest of a split package: it must leave before anything else does."""
        rest, self._rest = self._rest, b""
        return rest
