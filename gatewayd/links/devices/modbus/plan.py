"""The compiled Modbus device, immutable."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.links.modbus_places.located import Located
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import Codec
from gatewayd.report.format import address as address_text


@dataclass(frozen=True, slots=True)
class SerialSettings:
    """How a serial port is set up: 8 bits of data, and these."""

    baudrate: int
    parity: str = "none"
    stop_bits: int = 1

    @property
    def text(self) -> str:
        """`115200 8N1`."""
        return f"{self.baudrate} 8{self.parity[0].upper()}{self.stop_bits}"


@dataclass(frozen=True, slots=True)
class LineAddress:
    """A connection that several devices may share: what is equal is one connection."""

    path: str
    """Host, or path of the serial port."""
    port: int = 0
    """TCP port; 0 of a serial port."""
    framing: str = "tcp"
    """`tcp`, or `rtu` on serial ports and through converters."""
    serial: SerialSettings | None = None

    @property
    def is_serial(self) -> bool:
        """Whether it is a serial port of this machine."""
        return self.serial is not None

    @property
    def text(self) -> str:
        """`192.0.2.30:502`, `/dev/ttyUSB0 115200 8N1`."""
        if self.serial is not None:
            return f"{self.path} {self.serial.text}"
        return address_text(self.path, self.port) + (" RTU" if self.framing == "rtu" else "")


@dataclass(frozen=True, slots=True)
class DevicePlacement(Located):
    """Where one variable lies in the device."""

    variable: int
    """Index into `CellDefinition.variables`."""
    area: Area
    address: int
    bit: int | None
    codec: Codec | None
    width: int = 0
    poll: float | None = None
    """Of an input: seconds between two reads."""
    keeps_rest: bool | None = None
    """Of an output with some bits of a register: whether a write keeps the others as they are in the device; else they
    become 0. None: it has the whole register."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModbusDevicePlan(DevicePlan):
    """One unit that answers Modbus requests."""

    family: ClassVar[str] = "modbus"

    line: LineAddress
    unit: int
    timeout: float
    """Seconds within which a request is answered."""
    placements: tuple[DevicePlacement, ...]
    failures: int = 3
    """Requests in a row without an answer that make it lost at once."""
    gap: int = 0
    """Addresses with nothing mapped that one request may read along."""
    single: bool = False
    """Whether each value is read by a request of its own."""
    per_request: bool = False
    """Whether each request has a connection of its own."""
    in_flight: int = 1
    write: str = "auto"
    """Function codes of writes: `auto`, `single` (5, 6), `multiple` (15, 16) or `read_write` (23)."""
    mask_write: bool = True
    """Whether function code 22 is used where some bits of a register are written."""
    poll: float = 0.1
    """Seconds between two requests to a device of which nothing is read."""
    identify: bool = False
    """Whether it is asked which device it is whenever it is found."""
    serial_number: tuple[int, int] | None = None
    """First holding register with a serial number, and how many."""

    def identity(self, cell: CellDefinition) -> object:
        """Everything; variables and writer by name."""
        placements = tuple(
            (
                cell.variables[placed.variable].name,
                cell.variables[placed.variable].direction,
                placed.codec.meaning if placed.codec is not None else None,
                replace(placed, variable=0, codec=None),
            )
            for placed in self.placements
        )
        sendings = tuple(
            (cell.variables[each.variable].name, each.brings_up_to_date, each.every) for each in self.sendings
        )
        writer = cell.writers[self.writer].name if self.writer is not None else None
        return placements, sendings, writer, replace(self, writer=None, number=0, placements=(), sendings=())

    def inputs(self, cell: CellDefinition) -> tuple[DevicePlacement, ...]:
        """What is read: inputs of the robot."""
        return self._of(cell, Direction.INPUT)

    def outputs(self, cell: CellDefinition) -> tuple[DevicePlacement, ...]:
        """What is written: outputs of the robot."""
        return self._of(cell, Direction.OUTPUT)

    def _of(self, cell: CellDefinition, direction: Direction) -> tuple[DevicePlacement, ...]:
        return tuple(
            placed for placed in self.placements if cell.variables[placed.variable].direction is direction
        )
