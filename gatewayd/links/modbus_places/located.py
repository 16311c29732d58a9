"""What lies in a Modbus area, and how its place is written."""

from __future__ import annotations

from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import Codec


def part_text(bit: int | None, *, is_byte: bool, width: int = 0) -> str:
    """The part of a register behind its address: `.3`, `.high`, `.4..7`; empty for all of it."""
    if bit is None:
        return ""
    if width:
        return f".{bit}..{bit + width - 1}"
    return f".{bit}" if not is_byte else ".high" if bit else ".low"


class Located:
    """What lies in a Modbus area: the properties of everything with these fields."""

    __slots__ = ()
    area: Area
    address: int
    """Protocol address from 0: of the first register, or of the coil."""
    bit: int | None
    """Bit of the register (0 = least significant) for a bit packed into a register, the lowest one of a byte or of
    several bits; else None."""
    codec: Codec | None
    """Number encoding of several bits, bytes and whole registers; None for coils, discrete inputs and packed bits."""

    @property
    def width(self) -> int:
        """Bits of a number that has only some of a register's; 0 of any other, bytes as well."""
        return 0

    @property
    def words(self) -> int:
        """Addresses covered: registers, or 1 for a coil, a discrete input or a part of a register."""
        return self.codec.words if self.codec is not None else 1

    @property
    def addresses(self) -> range:
        """Addresses covered."""
        return range(self.address, self.address + self.words)

    @property
    def bits(self) -> range:
        """Of a part of a register, which of its bits it has; of any other place all 16."""
        if self.bit is None:
            return range(16)
        return range(self.bit, self.bit + (self.width or (1 if self.codec is None else 8)))

    @property
    def place(self) -> str:
        """The address as the file counts: `100`, `100.3` or `100.high`."""
        return f"{self.address}{self._part}"

    @property
    def notation(self) -> str:
        """The 4xxxxx form, with the bit where there is one: `400001.3`."""
        return f"{self.area.notation(self.address)}{self._part}"

    @property
    def _part(self) -> str:
        return part_text(self.bit, is_byte=self.codec is not None, width=self.width)
