"""What Modbus devices and places in them have in the mapping language."""

from __future__ import annotations

from typing import ClassVar, Final, Literal

from gatewayd.links.devices.scalars import Bits, PortPath, Registers, Rest, Target
from gatewayd.links.modbus_places.scalars import BAD_ADDRESS
from gatewayd.links.modbus_places.sections import AREA_KEYS, RegisterSpec, WordOrder
from gatewayd.mapping.scalars import Whole, refuse
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import Field

MAX_BRIDGED: Final = 124
"""Registers that a request can read besides the wanted ones."""


class ModbusDeviceKeys(Section):
    """How a Modbus device is reached and asked."""

    modbus: Target | None = Field(
        default=None, description="host and port (default 502) of a device reached by TCP"
    )
    serial: PortPath | None = Field(default=None, description="serial port that the device is at")
    baudrate: Whole | None = Field(
        default=None, ge=300, le=4_000_000, description="bits per second of the serial port"
    )
    parity: Literal["none", "even", "odd"] = Field(default="none", description="parity of the serial port")
    stop_bits: Literal[1, 2] = Field(default=1, description="stop bits of the serial port")
    framing: Literal["tcp", "rtu"] | None = Field(
        default=None,
        description="by TCP: frames of Modbus TCP (tcp, default), or those of a serial line as a converter passes them "
        "through (rtu)",
    )
    unit: Whole = Field(default=1, ge=0, le=255, description="unit identifier, the address on a serial line")
    failures: Whole = Field(
        default=3,
        ge=1,
        le=20,
        description="how many requests in a row without an answer make it lost at once",
    )
    gap: Whole = Field(
        default=0,
        ge=0,
        le=MAX_BRIDGED,
        description="how many addresses that nothing is mapped to may be read along, so that one request reads more",
    )
    single: bool = Field(default=False, description="whether it answers requests for one value only")
    connect: Literal["keep", "per_request"] = Field(
        default="keep", description="keep the connection open, or open one for each request"
    )
    in_flight: Whole = Field(
        default=1,
        ge=1,
        le=16,
        description="how many requests may wait for their answers at a time, by Modbus TCP",
    )
    write: Literal["auto", "single", "multiple", "read_write"] = Field(
        default="auto",
        description="function codes of writes: 5, 6 or 16 as the value needs it (auto), one coil or register each "
        "(5, 6), always 15 and 16, or 23 for registers",
    )
    mask_write: bool = Field(
        default=True,
        description="write some bits of a register by function code 22, unless the device refuses it; else they are "
        "read, changed and written back",
    )
    identify: bool = Field(
        default=False,
        description="ask which device it is whenever it is found (function code 43), and report another one",
    )
    serial_number: Registers | None = Field(
        default=None,
        description="holding registers that differ between two devices, read for the same purpose",
    )
    order: WordOrder = Field(
        default="ABCD",
        description="order of values of two or more registers that do not name their own",
    )


class ModbusPlaceKeys(RegisterSpec):
    """A place in a Modbus device."""

    AREA_SELECTORS: ClassVar[tuple[str, ...]] = tuple(AREA_KEYS)

    bits: Bits | None = Field(
        default=None,
        description="bits of the register that the number has, for example 0..7; 0 is the least significant",
    )
    rest: Rest | None = Field(
        default=None,
        description="outputs with some bits of a register: what a write gives the bits that nothing is mapped to: "
        "keep them as they are in the device, or 0",
    )

    def judge_area(self) -> None:
        """An area has the parts that it can have."""
        super().judge()
        if self.bits is not None and (self.area.of_bits or self.bit is not None):
            message = f"`bits` are those of a whole register, not of {self.area_key} {self.address}"
            hint = f"write {{holding: {self.address}, bits: 0..7}}"
            refuse(BAD_ADDRESS, message, hint)
