"""The four data tables of Modbus, and how much of them one request reads or writes."""

from __future__ import annotations

from enum import Enum
from typing import Final

# Application Protocol V1.1b3, 6.1, 6.3, 6.11, 6.12 and 6.17.
MAX_READ_BITS: Final = 2000
MAX_READ_REGISTERS: Final = 125
MAX_WRITE_BITS: Final = 1968
MAX_WRITE_REGISTERS: Final = 123
MAX_WRITE_WITH_READ: Final = 121


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
