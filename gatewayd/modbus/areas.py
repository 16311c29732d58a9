"""The four data tables of Modbus."""

from __future__ import annotations

from enum import Enum

__all__ = ["AREA_NAMES", "Area"]


class Area(Enum):
    """A Modbus data table (Application Protocol V1.1b3, 4.3). The value is the first digit of its 6-digit notation."""

    COIL = 0
    DISCRETE = 1
    INPUT = 3
    HOLDING = 4

    @property
    def of_bits(self) -> bool:
        """Whether an address of the area is one bit instead of one 16-bit register."""
        return self in (Area.COIL, Area.DISCRETE)

    def notation(self, address: int) -> str:
        """The 4xxxxx form of a protocol address: `Area.HOLDING.notation(0)` is `400001`."""
        return f"{self.value}{address + 1:05d}"


AREA_NAMES = {Area.COIL: "coil", Area.DISCRETE: "discrete", Area.INPUT: "input", Area.HOLDING: "holding"}
"""Areas as the mapping file names them."""
