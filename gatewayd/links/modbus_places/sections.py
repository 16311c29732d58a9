"""A place in the Modbus areas as a mapping file writes it."""

from __future__ import annotations

from typing import Final, Literal

from gatewayd.links.modbus_places.scalars import BAD_ADDRESS, Address, Part
from gatewayd.mapping.scalars import Real, refuse
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import Field
from gatewayd.modbus.areas import AREA_NAMES, Area

NumberType = Literal[
    "bool",
    "bit",
    "int8",
    "uint8",
    "int16",
    "uint16",
    "int32",
    "uint32",
    "int64",
    "uint64",
    "float32",
    "float64",
]
WordOrder = Literal["ABCD", "CDAB", "BADC", "DCBA"]
AREA_KEYS: Final = {AREA_NAMES[area]: area for area in (Area.HOLDING, Area.INPUT, Area.COIL, Area.DISCRETE)}
"""The keys of which a place has exactly one, each for its table."""


class RegisterSpec(Section):
    """A place in a Modbus area, and how a number is written there."""

    holding: Address | None = Field(default=None, description="holding register (4xxxxx)")
    input: Address | None = Field(default=None, description="input register (3xxxxx), read only")
    coil: Address | None = Field(default=None, description="coil (0xxxxx), one bit")
    discrete: Address | None = Field(default=None, description="discrete input (1xxxxx), one bit, read only")
    type: NumberType | None = Field(default=None, description="number type; default: from the robot's type")
    order: WordOrder | None = Field(
        default=None,
        description="ABCD: big-endian; CDAB: words swapped; BADC: bytes swapped; DCBA: both; of one register only "
        "the bytes can be swapped",
    )
    scale: Real | None = Field(default=None, description="robot value = raw value * scale + offset")
    offset: Real | None = Field(default=None, description="robot value = raw value * scale + offset")

    def judge(self) -> None:
        """Exactly one area, and no bit of what is one."""
        given = [area for area in AREA_KEYS if getattr(self, area) is not None]
        if len(given) != 1:
            found = "none" if not given else " and ".join(given)
            message = f"a placement names exactly one of holding, input, coil and discrete; found {found}"
            refuse(BAD_ADDRESS, message, "write for example {holding: 100}; several placements make a list")
        if self.area.of_bits and self.bit is not None:
            message = f"a {given[0]} address has no bits or bytes"
            refuse(BAD_ADDRESS, message, f"write {{{given[0]}: N}} with a whole number")

    @property
    def area(self) -> Area:
        """The Modbus table."""
        return AREA_KEYS[self.area_key]

    @property
    def area_key(self) -> str:
        """The key that names the table."""
        return next(key for key in AREA_KEYS if getattr(self, key) is not None)

    @property
    def address(self) -> int:
        """Protocol address from 0."""
        return int(getattr(self, self.area_key)[0])

    @property
    def bit(self) -> int | None:
        """Bit of the register, the lowest one of a byte; or None."""
        part: Part = getattr(self, self.area_key)[1]
        return {"low": 0, "high": 8}[part] if isinstance(part, str) else part

    @property
    def is_byte(self) -> bool:
        """Whether it is a byte of the register."""
        return isinstance(getattr(self, self.area_key)[1], str)
