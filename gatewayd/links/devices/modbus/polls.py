"""What is read from a Modbus device, and what the bytes of an answer say. Pure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from gatewayd.core.definition import Value
from gatewayd.links.devices.modbus.plan import DevicePlacement
from gatewayd.modbus.areas import MAX_READ_BITS, MAX_READ_REGISTERS
from gatewayd.modbus.client.grouping import PollClass, ReadGroup, ReadLimits, WantedItem, plan_classes

_BITS_OF_REGISTER: Final = 16

Reading = Callable[[bytes], "Value | None"]
"""Bytes of the registers that a place covers, or one byte with its bit in the lowest -> the robot's value, if any."""


def polls_of(placements: Sequence[DevicePlacement], gap: int, *, single: bool) -> tuple[PollClass, ...]:
    """Poll classes for these inputs; an item's index is that of its placement.

    `gap`: addresses that may be read along, registers or 16 times as many bits.
    """
    wanted = [WantedItem(placed.area, placed.address, placed.words) for placed in placements]
    periods = [placed.poll or 0.0 for placed in placements]
    limits = ReadLimits(
        MAX_READ_REGISTERS, MAX_READ_BITS, bridge=gap, bridge_bits=gap * _BITS_OF_REGISTER, is_single=single
    )
    return plan_classes(wanted, periods, limits)


class AnswerReader:
    """Says what answers mean for the inputs of a device."""

    def __init__(self, placements: Sequence[DevicePlacement]) -> None:
        self._variables = [placed.variable for placed in placements]
        self._readings = [reading_of(placed) for placed in placements]

    def variables(self, group: ReadGroup) -> list[int]:
        """The inputs that a group has."""
        return [self._variables[member.index] for member in group.members]

    def values(self, group: ReadGroup, data: bytes) -> list[tuple[int, Value | None]]:
        """Variables and their values; None: what the device has is no value of the robot's type."""
        if group.area.of_bits:
            bits = int.from_bytes(data, "little")
            return [
                (self._variables[member.index], bool(bits >> member.offset & 1)) for member in group.members
            ]
        return [
            (
                self._variables[member.index],
                self._readings[member.index](data[2 * member.offset : 2 * (member.offset + member.size)]),
            )
            for member in group.members
        ]


def reading_of(placed: DevicePlacement) -> Reading:
    """How a place in registers is read."""
    codec, bit = placed.codec, placed.bit
    if codec is None:
        shift = bit or 0
        return lambda data: bool(int.from_bytes(data, "big") >> shift & 1)
    decode = codec.decode
    if bit is None:
        return decode
    if not placed.width:
        low = bit == 0
        return lambda data: decode(data[1:] if low else data[:1])
    mask = (1 << placed.width) - 1

    def read_bits(data: bytes) -> Value | None:
        return decode((int.from_bytes(data, "big") >> bit & mask).to_bytes(2, "big"))

    return read_bits
