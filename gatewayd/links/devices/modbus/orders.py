"""What is written to a Modbus device: from values of the robot to requests. Pure.

Each order has a key: of those with the same the newest wins. Whole values and coils have one each. Outputs with parts
of a register that keep the rest have one each as well, and write their own bits alone. Those whose rest is 0 share one
with all others in their register, since a write gives all of it.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from typing import Final

from gatewayd.core.definition import Value
from gatewayd.links.devices.modbus.plan import DevicePlacement
from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.requests import (
    ModbusRequest,
    read_write,
    write_coil,
    write_coils,
    write_register,
    write_registers,
)
from gatewayd.modbus.client.writes import PartWrite

_FULL: Final = 0xFFFF

Order = tuple[Hashable, "ModbusRequest | PartWrite"]


class OrderMaker:
    """Makes orders for the outputs of a device; `write`: which function codes (`ModbusDevicePlan.write`)."""

    def __init__(self, placements: Sequence[DevicePlacement], write: str) -> None:
        self._write = write
        self._places: dict[int, list[DevicePlacement]] = {}
        self._shared: dict[int, list[DevicePlacement]] = {}
        """By address: outputs with parts of a register whose rest is 0."""
        for placed in placements:
            self._places.setdefault(placed.variable, []).append(placed)
            if placed.bit is not None and not placed.keeps_rest:
                self._shared.setdefault(placed.address, []).append(placed)

    def variable_of(self, key: Hashable) -> int | None:
        """The first variable that has this key in any of its orders."""
        for variable, places in self._places.items():
            if any(key in self._keys(placed) for placed in places):
                return variable
        return None

    def orders(self, variable: int, values: Sequence[Value]) -> Iterator[Order]:
        """What brings the device up to date with a variable; `values`: of all variables of the cell."""
        for placed in self._places.get(variable, ()):
            yield from self._orders(placed, values)

    def _keys(self, placed: DevicePlacement) -> Sequence[Hashable]:
        if placed.bit is not None and placed.keeps_rest:
            return ((placed.area, placed.address, placed.bit),)
        return [(placed.area, address, None) for address in placed.addresses]

    def _orders(self, placed: DevicePlacement, values: Sequence[Value]) -> Iterator[Order]:
        value = values[placed.variable]
        keys = self._keys(placed)
        if placed.area is Area.COIL:
            on = bool(value)
            request = (
                write_coils(placed.address, (on,))
                if self._write == "multiple"
                else write_coil(placed.address, on)
            )
            yield keys[0], request
        elif placed.bit is None:
            assert placed.codec is not None
            data = placed.codec.encode(value)
            if self._write == "single":
                for number, key in enumerate(keys):
                    yield key, write_register(placed.address + number, data[2 * number : 2 * number + 2])
            else:
                yield keys[0], self._registers(placed.address, data)
        elif placed.keeps_rest:
            mask, bits = part_of(placed, value)
            yield keys[0], PartWrite(placed.address, mask, bits)
        else:
            register = 0
            for other in self._shared[placed.address]:
                register |= part_of(other, values[other.variable])[1]
            yield keys[0], self._registers(placed.address, register.to_bytes(2, "big"))

    def _registers(self, address: int, data: bytes) -> ModbusRequest:
        if self._write == "read_write":
            return read_write(address, 1, address, data)
        if self._write == "auto" and len(data) == 2:
            return write_register(address, data)
        return write_register(address, data) if self._write == "single" else write_registers(address, data)


def part_of(placed: DevicePlacement, value: Value) -> tuple[int, int]:
    """The bits of a register that a place has, and what they are for a value: both in their places."""
    bits = placed.bits
    mask = (1 << len(bits)) - 1
    if placed.codec is None:
        number = int(bool(value))
    elif placed.width:
        number = min(int.from_bytes(placed.codec.encode(value), "big"), mask)
    else:
        number = placed.codec.encode(value)[0]
    return mask << bits.start & _FULL, number << bits.start
