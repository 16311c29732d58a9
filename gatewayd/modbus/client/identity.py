"""Which device a unit is: identification by FC 43 with MEI type 14 (V1.1b3, 6.21), and a serial number. Pure.

A device that was replaced, or that a gateway's table of addresses points elsewhere now, is noticed by what has changed.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from gatewayd.modbus.client import pdus
from gatewayd.modbus.client.grouping import WantedItem
from gatewayd.modbus.client.requests import ModbusRequest, read, read_identification

_NAMES = {0: "vendor", 1: "product code", 2: "revision", 3: "URL", 4: "product", 5: "model", 6: "application"}
_MAX_PIECES = 16
"""Answers in which one identification may come."""


@dataclass(frozen=True, slots=True)
class UnitIdentity:
    """What a unit has said of itself."""

    objects: tuple[tuple[int, str], ...] = ()
    """Identification objects by their ids, in their order; empty where it has none."""
    serial: bytes | None = None
    """Registers of its serial number, as they are; None where nobody asked, or it did not answer."""

    def changes(self, former: UnitIdentity) -> list[str]:
        """What differs from what `former` has too, as in `revision 1.2 instead of 1.1`."""
        before, after = dict(former.objects), dict(self.objects)
        found = [
            f"{_NAMES.get(number, f'object {number}')} {after[number]} instead of {text}"
            for number, text in before.items()
            if after.get(number, text) != text
        ]
        if former.serial is not None and self.serial is not None and former.serial != self.serial:
            found.append(f"serial number {self.serial.hex()} instead of {former.serial.hex()}")
        return found


@dataclass(slots=True)
class IdentityReader:
    """The requests that find out, one after the other. A unit that refuses one has simply no such data."""

    is_identified: bool
    """Whether to ask for the identification objects."""
    serial: WantedItem | None
    """Where the serial number lies, if anywhere."""
    _objects: dict[int, bytes] = field(default_factory=dict)
    _serial: bytes | None = None
    _steps: list[ModbusRequest] = field(default_factory=list)
    _pieces: int = 0

    def begin(self) -> None:
        """From the start."""
        self._objects, self._serial, self._steps, self._pieces = {}, None, [], 0
        if self.serial is not None:
            self._steps.append(read(*self.serial))
        if self.is_identified:
            self._steps.append(read_identification())

    @property
    def request(self) -> ModbusRequest | None:
        """The next one; None: that was all."""
        return self._steps[-1] if self._steps else None

    def answered(self, data: bytes | None) -> UnitIdentity | None:
        """The answer to `request`, None if it was refused. The identity, after the last."""
        request = self._steps.pop()
        if data is not None:
            if request.answer_size:
                self._serial = data
            else:
                self._take_objects(data)
        if self._steps:
            return None
        texts = ((key, content.decode("ascii", "replace")) for key, content in sorted(self._objects.items()))
        return UnitIdentity(tuple(texts), self._serial)

    def _take_objects(self, data: bytes) -> None:
        try:
            objects, following = pdus.identification(data)
        except ValueError:
            return
        self._objects |= objects
        self._pieces += 1
        if following is not None and following not in self._objects and self._pieces < _MAX_PIECES:
            self._steps.append(read_identification(following))
