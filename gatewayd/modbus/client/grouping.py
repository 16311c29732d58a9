"""Wanted items -> the requests that read them (the plan of a poll). Pure.

Neighbours come in one request; a gap between two is read along where that is shorter than another request. An item
never lies in two requests, except where it is longer than one can be (a device that answers one register at a time):
then it is a group of its own, read by several requests, and its bytes may be of different moments.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import NamedTuple

from gatewayd.modbus.areas import MAX_READ_BITS, MAX_READ_REGISTERS, Area
from gatewayd.modbus.client.requests import ModbusRequest, read

DEFAULT_BRIDGE = 8
"""Registers: 16 bytes more of an answer cost less than another request, on TCP and on a serial line."""
DEFAULT_BRIDGE_BITS = 128


class WantedItem(NamedTuple):
    """What is to be read."""

    area: Area
    address: int
    size: int
    """Registers, or bits in areas of bits; 1 at least."""


@dataclass(frozen=True, slots=True)
class ReadLimits:
    """What one request may read."""

    registers: int = MAX_READ_REGISTERS
    bits: int = MAX_READ_BITS
    bridge: int = DEFAULT_BRIDGE
    """Greatest gap of unwanted registers that is read along; 0: none, for devices that refuse addresses they lack."""
    bridge_bits: int = DEFAULT_BRIDGE_BITS
    is_single: bool = False
    """Whether the device answers one register, or one bit, at a time: limits and gaps do not count then."""

    def __post_init__(self) -> None:
        if not (1 <= self.registers <= MAX_READ_REGISTERS and 1 <= self.bits <= MAX_READ_BITS):
            raise ValueError(
                f"a request reads 1 to {MAX_READ_REGISTERS} registers, 1 to {MAX_READ_BITS} bits"
            )

    def size(self, area: Area) -> int:
        """Elements of one request at most."""
        if self.is_single:
            return 1
        return self.bits if area.of_bits else self.registers

    def gap(self, area: Area) -> int:
        """Unwanted elements between two wanted ones at most."""
        if self.is_single:
            return 0
        return self.bridge_bits if area.of_bits else self.bridge


@dataclass(frozen=True, slots=True)
class GroupMember:
    """A wanted item in a group."""

    index: int
    """Its place among those that were wanted."""
    offset: int
    """Of its first element in the group's data: a register is 2 bytes there, a bit one bit, from the lowest on."""
    size: int


@dataclass(frozen=True, slots=True)
class ReadGroup:
    """Elements that are read together, and what is wanted of them."""

    area: Area
    address: int
    size: int
    """Registers or bits."""
    members: tuple[GroupMember, ...]
    requests: tuple[ModbusRequest, ...] = field(repr=False, compare=False)
    """One, except for a long item. Their data in this order are the group's."""


@dataclass(frozen=True, slots=True)
class PollClass:
    """What is read with one period."""

    period: float
    """Seconds from one beginning to the next. What takes longer begins again when it has ended."""
    groups: tuple[ReadGroup, ...]


def plan_poll(wanted: Sequence[WantedItem], limits: ReadLimits | None = None) -> tuple[ReadGroup, ...]:
    """The groups that read all of `wanted`, each item in one of them, in the order of areas and addresses."""
    limits = limits or ReadLimits()
    order = sorted(
        range(len(wanted)), key=lambda index: (wanted[index].area.value, *wanted[index][1:], index)
    )
    groups: list[ReadGroup] = []
    for area, indices in groupby(order, key=lambda index: wanted[index].area):
        members = [(index, wanted[index]) for index in indices]
        groups += (_group(area, run, limits) for run in _runs(members, limits.size(area), limits.gap(area)))
    return tuple(groups)


def plan_classes(
    wanted: Sequence[WantedItem], periods: Sequence[float], limits: ReadLimits | None = None
) -> tuple[PollClass, ...]:
    """Poll classes, the quickest first: item i is wanted every `periods[i]` seconds. Indices are those of `wanted`."""
    classes = []
    for period in sorted(set(periods)):
        chosen = [index for index, own in enumerate(periods) if own == period]
        groups = plan_poll([wanted[index] for index in chosen], limits)
        classes.append(PollClass(period, tuple(_renumbered(group, chosen) for group in groups)))
    return tuple(classes)


def _renumbered(group: ReadGroup, indices: Sequence[int]) -> ReadGroup:
    members = tuple(
        GroupMember(indices[member.index], member.offset, member.size) for member in group.members
    )
    return ReadGroup(group.area, group.address, group.size, members, group.requests)


_Run = list[tuple[int, WantedItem]]


def _runs(members: _Run, most: int, gap: int) -> Iterable[_Run]:
    """Members, sorted by address, in runs that one request reads each; what is too long for one is a run alone."""
    run: _Run = []
    start = end = 0
    for index, item in members:
        behind = item.address + item.size
        if run and (item.address - end > gap or max(end, behind) - start > most):
            yield run
            run = []
        if not run:
            start = end = item.address
        run.append((index, item))
        end = max(end, behind)
    if run:
        yield run


def _group(area: Area, run: _Run, limits: ReadLimits) -> ReadGroup:
    start = run[0][1].address
    size = max(item.address + item.size for _, item in run) - start
    members = tuple(GroupMember(index, item.address - start, item.size) for index, item in run)
    most = limits.size(area)
    requests = tuple(read(area, start + done, min(most, size - done)) for done in range(0, size, most))
    return ReadGroup(area, start, size, members, requests)
