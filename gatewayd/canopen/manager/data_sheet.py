"""Data sheets of devices (EDS and DCF, CiA 306): python-canopen reads them, a manager's plan comes out.

All that is known of python-canopen's dictionary is here; what its importer cannot read is in `sheet_text`.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import StringIO
from typing import Final

import canopen
from canopen.objectdictionary import ODVariable

from gatewayd.canopen.cob_ids import BASIC_FRAME, INVALID
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.describe import object_text
from gatewayd.canopen.manager.configuration import NO_REMOTE
from gatewayd.canopen.manager.plan import ExpectedIdentity, ManagedPdo, PdoObject, Setting
from gatewayd.canopen.manager.sheet_text import SheetText, decoded, number, repaired

MAX_PDOS: Final = 512
"""PDOs of each direction (CiA 301)."""
MAX_MAPPED: Final = 64
"""Objects of a PDO."""
FIRST_DEVICE_INDEX: Final = 0x2000
"""Where the objects of the communication end."""

_KINDS = {kind.code: kind for kind in CanType}
_ODD_WIDTHS = {0x10: 24, 0x12: 40, 0x13: 48, 0x14: 56, 0x16: 24, 0x18: 40, 0x19: 48, 0x1A: 56}
"""Integers of odd widths (CiA 301, table 44): type code -> bits."""
_SIGNED_ODD = range(0x10, 0x15)
_NOT_SET = (0x1010, 0x1011, 0x1016, 0x1017, 0x1020)
"""What a manager writes by itself, or nobody writes as a value: store and restore, heartbeats, configuration date."""
_PDO_PARAMETERS = range(0x1400, 0x1C00)


class DataSheetError(Exception):
    """A data sheet cannot be read; the text says why."""


@dataclass(frozen=True, slots=True)
class SheetObject:
    """One entry of a device's dictionary, as its data sheet describes it."""

    index: int
    subindex: int
    name: str
    code: int
    """Of its data type."""
    access: str
    """`ro`, `rw`, `wo`, `const`, `rwr`, `rww`."""
    mappable: bool
    default: str | None = None
    """As it stands in the file."""
    value: str | None = None
    """Value of a DCF, as it stands in the file."""

    @property
    def type(self) -> CanType | None:
        """Its type; None for one that is not known here."""
        return _KINDS.get(self.code)

    @property
    def bits(self) -> int:
        """Its length in a PDO; 0 for what no PDO carries."""
        kind = self.type
        return kind.bits if kind is not None else _ODD_WIDTHS.get(self.code, 0)

    @property
    def readable(self) -> bool:
        """Whether an SDO upload is allowed."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """Whether an SDO download is allowed."""
        return self.access in ("rw", "wo", "rwr", "rww")

    @property
    def transmitted(self) -> bool:
        """Whether a TPDO may carry it."""
        return self.mappable and self.access in ("ro", "rw", "rwr", "const")

    @property
    def received(self) -> bool:
        """Whether an RPDO may carry it."""
        return self.mappable and self.access in ("rw", "wo", "rww")

    @property
    def text(self) -> str:
        """`6004h:00 Position value`."""
        return f"{object_text(self.index, self.subindex)} {self.name}"


class DataSheet:
    """The data sheet of a device with a certain node-ID."""

    def __init__(self, data: bytes, node: int) -> None:
        """`data`: the content of the file. DataSheetError if it is no data sheet."""
        self.node = node
        self._sheet = repaired(decoded(data))
        self._dictionary = _imported(self._sheet, node)

    def find(self, index: int, subindex: int) -> SheetObject | None:
        """The entry of that address; None if there is none."""
        found = self._dictionary.get(index)
        if isinstance(found, ODVariable):
            return _entry(found) if subindex == 0 else None
        if found is None:
            return None
        part = found.subindices.get(subindex)
        if part is None and 1 <= subindex <= self._sheet.compact.get(index, 0):
            part = found[subindex]
        return _entry(part, subindex) if isinstance(part, ODVariable) else None

    def objects(self) -> Iterator[SheetObject]:
        """All entries, in their order."""
        for index in sorted(self._dictionary):
            found = self._dictionary[index]
            if isinstance(found, ODVariable):
                yield _entry(found)
                continue
            numbers = {*found.subindices, *range(1, self._sheet.compact.get(index, 0) + 1)}
            for subindex in sorted(numbers):
                entry = self.find(index, subindex)
                if entry is not None:
                    yield entry

    def number(self, index: int, subindex: int) -> int | None:
        """The number that an entry has by its data sheet: of the DCF where it says one, else the default."""
        entry = self.find(index, subindex)
        return self.number_of(entry) if entry is not None else None

    def number_of(self, entry: SheetObject) -> int | None:
        """The same of an entry."""
        text = entry.value if entry.value is not None else entry.default
        return number(text, self.node, signed_bits=_signed_bits(entry)) if text is not None else None

    @property
    def identity(self) -> ExpectedIdentity:
        """What the device should say of itself. 0 in a data sheet says nothing; serial numbers are never in one.

        Product codes are optional in devices: one that is named only for tools ([DeviceInfo]) is not asked for.
        """
        about = self._dictionary.device_information
        return ExpectedIdentity(
            self.number(0x1000, 0) or None,
            self.number(0x1018, 1) or about.vendor_number or None,
            (self.number(0x1018, 2) or about.product_number or None) if self.find(0x1018, 2) else None,
            None,
            None,
        )

    @property
    def modified(self) -> tuple[int, int] | None:
        """Days since 1984 and milliseconds of the file's last change, for 1020h."""
        return self._sheet.modified

    def pdos(self) -> tuple[ManagedPdo, ...]:
        """The PDOs as the device has them by its data sheet, without those that are switched off or empty.

        DataSheetError for a PDO that no frame can carry.
        """
        return tuple(
            pdo
            for transmit in (True, False)
            for order in range(1, MAX_PDOS + 1)
            if (pdo := self.pdo(order, transmit=transmit)) is not None and pdo.objects
        )

    def pdo(self, order: int, *, transmit: bool) -> ManagedPdo | None:
        """PDO `order` (from 1); None if there is none, or it is switched off."""
        parameter = (0x1800 if transmit else 0x1400) + order - 1
        cob_id = self.number(parameter, 1)
        if cob_id is None or cob_id & INVALID:
            return None
        kind = self.number(parameter, 2)
        return ManagedPdo(
            order,
            transmit,
            cob_id & BASIC_FRAME,
            tuple(self._mapped((0x1A00 if transmit else 0x1600) + order - 1)),
            transmission=kind if kind in range(256) else None,
            no_remote=bool(cob_id & NO_REMOTE),
        )

    def is_fixed(self, order: int, *, transmit: bool) -> bool:
        """Whether the layout of a PDO cannot be written."""
        count = self.find((0x1A00 if transmit else 0x1600) + order - 1, 0)
        return count is None or not count.writable

    def mapped(self, entry: SheetObject) -> PdoObject:
        """An entry as a part of a PDO."""
        return PdoObject(entry.index, entry.subindex, entry.bits, entry.type)

    def settings(self) -> tuple[Setting, ...]:
        """What a DCF has beyond its defaults, without PDOs, which are laid out in an order of their own.

        DataSheetError for a value that its type cannot have.
        """
        return tuple(
            Setting(entry.index, entry.subindex, self._bytes(entry))
            for entry in self.objects()
            if entry.value is not None
            and entry.value != entry.default
            and entry.writable
            and entry.index not in _NOT_SET
            and entry.index not in _PDO_PARAMETERS
        )

    def _mapped(self, index: int) -> Iterator[PdoObject]:
        count = self.number(index, 0)
        for subindex in range(1, (MAX_MAPPED if count is None else min(count, MAX_MAPPED)) + 1):
            mapping = self.number(index, subindex)
            if not mapping:
                return
            found = self.find(mapping >> 16, mapping >> 8 & 0xFF)
            yield PdoObject(mapping >> 16, mapping >> 8 & 0xFF, mapping & 0xFF, found.type if found else None)

    def _bytes(self, entry: SheetObject) -> bytes:
        text, kind = entry.value or "", entry.type
        try:
            if kind is CanType.VISIBLE_STRING:
                return text.encode("latin-1")
            if kind is CanType.DOMAIN:
                return bytes.fromhex(text)
            if kind is not None and kind.is_real:
                return kind.pack(float(text))
            value = self.number_of(entry)
            if value is not None and kind is not None:
                return kind.pack(value)
            if value is not None and entry.bits:
                return value.to_bytes(entry.bits // 8, "little", signed=entry.code in _SIGNED_ODD)
        except (ValueError, OverflowError, struct.error):
            pass
        raise DataSheetError(f"{entry.text}: {text!r} is no value of its type {entry.code:04X}h")


def _imported(sheet: SheetText, node: int) -> canopen.ObjectDictionary:
    source = StringIO(sheet.text)
    source.name = "device.eds"  # the importer looks at the name
    try:
        return canopen.import_od(source, node_id=node)
    except (
        Exception
    ) as error:  # the importer raises what its parts raise, and files of vendors find all of it
        raise DataSheetError(
            f"this is no data sheet that can be read: {' '.join(str(error).split())}"
        ) from error


def _entry(found: ODVariable, subindex: int | None = None) -> SheetObject:
    return SheetObject(
        found.index,
        found.subindex if subindex is None else subindex,
        found.name,
        found.data_type or 0,
        found.access_type,
        found.pdo_mappable,
        getattr(found, "default_raw", None),
        getattr(found, "value_raw", None),
    )


def _signed_bits(entry: SheetObject) -> int:
    kind = entry.type
    if kind is None:
        return _ODD_WIDTHS[entry.code] if entry.code in _SIGNED_ODD else 0
    return kind.bits if kind.char.islower() and not kind.is_real else 0
