"""What a simulated robot is made of, however it was asked for: by options of the command line or by a scenario file."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from gatewayd.rtde.fields import INPUTS, Field, Series, SoftwareVersion
from gatewayd.rtde.types import DataType
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.faults import Faults
from gatewayd.simulator.program import ProgramRule


@dataclass(frozen=True, slots=True)
class RobotSettings:
    """One robot. `faults` are attributes of `Faults`, since that changes while the robot runs."""

    series: Series = Series.E
    version: SoftwareVersion | None = None
    model: str = "ur5e"
    frequency: float | None = None
    uptime: float | None = None
    program: tuple[ProgramRule, ...] = ()
    fields: tuple[Field, ...] = ()
    faults: Mapping[str, Any] = field(default_factory=dict)
    replayed: tuple[str, ...] | None = None

    def controller(self) -> Controller:
        """A new controller. ProgramError and ValueError as `Controller` raises them."""
        return Controller(
            self.series,
            self.version,
            frequency=self.frequency,
            uptime=self.uptime,
            program=self.program,
            faults=Faults(**self.faults),
            fields=self.fields,
            model=self.model,
            replayed=self.replayed,
        )


def read_field(text: str) -> Field:
    """Read "dexterity:DOUBLE"; ValueError names what is possible."""
    name, _, word = text.partition(":")
    try:
        return Field(name, DataType.from_word(word), "of this simulator")
    except KeyError:
        types = ", ".join(kind.word for kind in DataType)
        message = f"{text!r} is not NAME:TYPE, where TYPE is one of {types}"
        raise ValueError(message) from None


def read_inputs(names: Iterable[str]) -> frozenset[str]:
    """Names of inputs; ValueError names those that do not exist."""
    fields = frozenset(names)
    unknown = sorted(fields - INPUTS.keys())
    if unknown:
        message = f"no such input: {', '.join(unknown)}"
        raise ValueError(message)
    return fields


def read_generation(series: str | None, version: str | None) -> tuple[Series, SoftwareVersion | None]:
    """Series and software of a robot, of which either decides the other; ValueError if they contradict each other."""
    if version is None:
        return Series.from_word(series or "e"), None
    software = SoftwareVersion.parse(version)
    own = Series.from_major(software.major)
    if own is None:
        message = f"{version}: software versions begin with 3 (cb3), 5 (e) or 10 (x)"
        raise ValueError(message)
    if series is not None and own.word != series:
        message = f"{version} is software of series {own.word}, not of {series}"
        raise ValueError(message)
    return own, software


def read_seconds(value: float | str) -> float:
    """A number of seconds; ValueError for anything else."""
    try:
        seconds = float(value)
    except ValueError:
        seconds = math.nan
    if not 0 <= seconds < math.inf:
        message = f"{value!r} is not a number of seconds"
        raise ValueError(message)
    return seconds
