"""Inputs that act through companions: a mask that selects them, and for analog outputs a type that says what they mean.

A *line* is one actuator of the controller: a digital or analog output, the speed slider. A release has to reach the
actuator: for `STAGE` seconds the fallback goes out with the line's mask bit set, in the domain that was last driven;
then the mask takes its own value. Without a release a mask bit goes out set only where the line's value was given in
this session, and an analog output only in a domain that somebody chose or that the controller is in.

Pure: flat tuples in and out, time as a parameter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from gatewayd.core.definition import Direction, Value, Variable
from gatewayd.links.robot.transfer import ElementPlace, InputTransfer
from gatewayd.rtde.companions import COMPANIONS

STAGE = 0.01
"""Seconds at least for which a fallback goes out with its mask set, and never less than two control cycles."""
CYCLES = 2
DOMAINS = "analog_io_types"
"""The output with the domain of each analog output, from bit 2 on: 0 current, 1 voltage."""
_FIRST_OUTPUT_DOMAIN = 2
_DOMAIN_BITS = 0b11

Key = tuple[str, int | None]
"""A line: the field of its value, and its bit where several lines share the field."""

_DIGITAL_LINES = {"standard_digital_output": 8, "configurable_digital_output": 8, "tool_digital_output": 2}


def all_outputs(mapped: Sequence[str], variables: Sequence[Variable]) -> tuple[str, ...]:
    """Outputs to subscribe: the `mapped` ones, and what the inputs among `variables` need to act as they are meant."""
    return tuple(dict.fromkeys((*mapped, *((DOMAINS,) if _types(variables) else ()))))


def all_inputs(mapped: Sequence[str], variables: Sequence[Variable]) -> tuple[str, ...]:
    """Inputs to claim: the `mapped` ones and their companions."""
    return tuple(dict.fromkeys((*mapped, *_types(variables))))


def _types(variables: Sequence[Variable]) -> list[str]:
    """The fields that choose the domains of the inputs among `variables`."""
    inputs = (variable.field for variable in variables if variable.direction is Direction.INPUT)
    needs = (COMPANIONS[name] for name in inputs if name in COMPANIONS)
    return [companions.type for companions in needs if companions.type is not None]


@dataclass(slots=True)
class Driven:
    """Which lines were driven, over all sessions and mappings of the process."""

    lines: dict[Key, bool] = field(default_factory=dict)
    """Whether the line's mask bit went out set since its last release; not there: unknown, since before the start."""
    releasing: set[Key] = field(default_factory=set)
    """Lines whose release is not known to have reached the robot."""
    domains: dict[Key, bool] = field(default_factory=dict)
    """The type bit that the line was last driven with."""

    def may_act(self, line: Key) -> bool:
        """Whether something that was given may still stand in the actuator."""
        return self.lines.get(line, True) or line in self.releasing


@dataclass(slots=True)
class Stage:
    """A fallback that goes out with its mask set."""

    value: Value
    domain: bool | None
    until: float | None = None
    """When the mask takes its own value; None: it has not been sent."""


@dataclass(frozen=True, slots=True)
class _Line:
    key: Key
    place: ElementPlace
    mask: ElementPlace
    type: ElementPlace | None
    bit: int
    """Its bit of mask and type."""
    value_by: int | None
    """Index of the variable that carries the value; None: no variable does."""
    is_part: bool
    """Whether that variable is an integer for several lines."""
    is_masked: bool
    """Whether a variable carries the mask bit: only then the line can have been driven."""
    type_by: int | None
    """Index of the variable that carries the domain."""


class Actuation:
    """The lines of one recipe; `stages` are those of the session, `driven` those of the process."""

    __slots__ = ("_driven", "_lines", "_stages", "_type", "_zeros", "domains")

    def __init__(
        self,
        variables: Sequence[Variable],
        transfer: InputTransfer,
        driven: Driven,
        stages: dict[Key, Stage],
    ) -> None:
        self.domains: int | None = None
        """What the controller's `DOMAINS` held last; None: not known."""
        self._zeros = tuple((index, variables[index].kind.zero) for index in transfer.members)
        self._driven = driven
        self._stages = stages
        self._lines = tuple(_lines(variables, transfer))
        self._type = _unmapped_types(variables, transfer)

    def __bool__(self) -> bool:
        """Whether the recipe has a line at all."""
        return bool(self._lines)

    def undecided(self, given_at: Sequence[float]) -> list[int]:
        """Domains that somebody has to choose: their outputs were given, and the controller does not say its own."""
        return [
            line.type_by
            for line in self._lines
            if line.type_by is not None and self._present(line) is None and _given(line.value_by, given_at)
            if not _given(line.type_by, given_at)
        ]

    def compose(
        self, transfer: InputTransfer, values: Sequence[Value], given_at: Sequence[float]
    ) -> tuple[Value, ...]:
        """The recipe's flat tuple as it has to go out now. What was not given in this session counts as zero."""
        given = list(values)
        for index, zero in self._zeros:
            if not _given(index, given_at):
                given[index] = zero
        flat = list(transfer.gather(given))
        if self._type is not None and self.domains is not None:
            slot, free = self._type
            flat[slot] = int(flat[slot]) & ~free | self.domains >> _FIRST_OUTPUT_DOMAIN & free
        for line in self._lines:
            stage = self._stages.get(line.key)
            if stage is not None:
                line.place.put(flat, stage.value)
                line.mask.put(flat, value=True)
                if stage.domain is not None and line.type is not None:
                    line.type.put(flat, stage.domain)
                continue
            acts = _given(line.value_by, given_at)
            if line.type is not None and not _given(line.type_by, given_at):
                domain = self._present(line)
                acts = acts and domain is not None
                line.type.put(flat, bool(domain))
            if not acts:
                line.mask.put(flat, value=False)
        return tuple(flat)

    def sent(self, flat: Sequence[Value], until: float) -> None:
        """A package went out; the stages that begin with it last until then."""
        for line in self._lines:
            stage = self._stages.get(line.key)
            if stage is not None:
                stage.until = until if stage.until is None else stage.until
            elif line.mask.of(flat):
                self._driven.lines[line.key] = True
                if line.type is not None:
                    self._driven.domains[line.key] = bool(line.type.of(flat))

    def release(self, index: int, value: Value) -> None:
        """A variable was given its fallback: have it act on every line that it may have driven."""
        for line in self._of(index):
            if line.is_part and not self._driven.may_act(line.key):
                continue
            mask = line.place.mask if line.is_part else None
            part = value if mask is None else bool(int(value) & mask)
            domain = self._driven.domains.get(line.key, self._present(line))
            self._stages[line.key] = Stage(part, domain)
            self._driven.lines[line.key] = False
            self._driven.releasing.add(line.key)

    def is_releasing(self, index: int) -> bool:
        """Whether a stage of the variable is not over."""
        return any(line.key in self._stages for line in self._of(index))

    def delivered(self, index: int) -> None:
        """The variable's release has reached the robot."""
        self._driven.releasing.difference_update(line.key for line in self._of(index))

    def _of(self, index: int) -> Iterator[_Line]:
        return (line for line in self._lines if line.value_by == index and line.is_masked)

    def _present(self, line: _Line) -> bool | None:
        """The domain that the controller is in."""
        if self.domains is None or line.type is None:
            return None
        return bool(self.domains >> _FIRST_OUTPUT_DOMAIN + line.bit & 1)


def _lines(variables: Sequence[Variable], transfer: InputTransfer) -> Iterator[_Line]:
    carriers = {(variables[i].field, variables[i].bit): i for i in transfer.members}

    def carrier(name: str, bit: int | None) -> int | None:
        return carriers.get((name, bit), carriers.get((name, None)))

    def place(name: str, bit: int | None) -> ElementPlace:
        return ElementPlace(transfer.slots[name].start, None if bit is None else 1 << bit)

    for name, needs in COMPANIONS.items():
        if name not in transfer.slots or needs.mask not in transfer.slots:
            continue
        bits: list[tuple[int | None, int]] = [(bit, bit) for bit in range(_DIGITAL_LINES.get(name, 0))]
        for bit, mask_bit in bits if needs.bit is None else [(None, needs.bit)]:
            kind, value = needs.type, carrier(name, bit)
            yield _Line(
                key=(name, bit),
                place=place(name, bit),
                mask=place(needs.mask, mask_bit),
                type=place(kind, mask_bit) if kind in transfer.slots else None,
                bit=mask_bit,
                value_by=value,
                is_part=value is not None and bit is not None and variables[value].bit is None,
                is_masked=carrier(needs.mask, mask_bit) is not None,
                type_by=carrier(kind, mask_bit) if kind is not None else None,
            )


def _unmapped_types(variables: Sequence[Variable], transfer: InputTransfer) -> tuple[int, int] | None:
    """Where the domains are in the flat tuple, and those of them that no variable carries."""
    fields = {needs.type for needs in COMPANIONS.values() if needs.type is not None}
    for name in fields.intersection(transfer.slots):
        bits = [variables[index].bit for index in transfer.members if variables[index].field == name]
        carried = sum(1 << bit for bit in bits if bit is not None)
        return transfer.slots[name].start, 0 if None in bits else _DOMAIN_BITS & ~carried
    return None


def _given(index: int | None, given_at: Sequence[float]) -> bool:
    return index is not None and given_at[index] > -math.inf
