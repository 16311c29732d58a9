"""What the node says of itself, and what it does when communication fails (CiA 301, 7.5.2.1 to .29)."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from gatewayd import __version__
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, AbortCode, Access, Entry, Object, array, record, variable
from gatewayd.canopen.nmt import NmtCommand, NmtState


def revision(version: str = __version__) -> int:
    """Revision number of a release: major in the high word, minor in the low one."""
    numbers = re.match(r"(\d+)\.(\d+)", version)
    assert numbers is not None
    return int(numbers[1]) << 16 | int(numbers[2])


@dataclass(frozen=True, slots=True)
class Identity:
    """1018h, and the LSS address."""

    vendor: int
    product: int
    revision: int
    serial: int


def revision_of(objects: Iterable[Object], node: int) -> int:
    """A revision number that is another one for every other dictionary: objects, types, access, limits, defaults.

    Defaults that contain the node-ID count without it.
    """
    digest = 0
    for item in objects:
        for entry in item.entries:
            default = b"" if entry.is_volatile else entry.default
            if entry.plus_node:
                default = (int.from_bytes(default, "little") - node).to_bytes(len(default), "little")
            what = (item.index, item.name, item.code, entry.subindex, entry.name, entry.type.name)
            how = (entry.access.value, entry.pdo.value, entry.low, entry.high, default.hex())
            digest = zlib.crc32(repr((what, how)).encode(), digest)
    return digest


def identity_objects(identity: Identity, name: str, status: Callable[[], int]) -> Iterable[Object]:
    """1000h, 1002h, 1008h to 100Ah, 1018h. `name`: of the device; `status` gives the flags of the status block."""
    yield variable(0x1000, Entry.constant(0, "Device type", 0))
    register = Entry.constant(0, "Manufacturer status register", 0)
    register.source = lambda: CanType.UNSIGNED32.pack(status())
    yield variable(0x1002, register)
    yield variable(0x1008, _text("Manufacturer device name", name))
    yield variable(0x1009, _text("Manufacturer hardware version", "none"))
    yield variable(0x100A, _text("Manufacturer software version", __version__))
    yield record(
        0x1018,
        "Identity object",
        (
            Entry.constant(1, "Vendor-ID", identity.vendor),
            Entry.constant(2, "Product code", identity.product),
            Entry.constant(3, "Revision number", identity.revision),
            Entry.constant(4, "Serial number", identity.serial),
        ),
    )


REACTIONS: dict[tuple[int, NmtState], NmtCommand] = {
    (0, NmtState.OPERATIONAL): NmtCommand.ENTER_PRE_OPERATIONAL,
    (2, NmtState.OPERATIONAL): NmtCommand.STOP,
    (2, NmtState.PRE_OPERATIONAL): NmtCommand.STOP,
}
"""What a communication error does, by 1029h sub-index 1 and NMT state; nothing where nothing is listed."""


class ErrorBehaviour:
    """1029h: the change of NMT state after a communication error (heartbeat, guarding, bus-off)."""

    def __init__(self, behaviour: int = 0) -> None:
        """`behaviour`: that after power-on."""
        self._communication = Entry.parameter(
            1, "Communication error", CanType.UNSIGNED8, behaviour, check=_check_behaviour
        )

    def objects(self) -> Iterable[Object]:
        """1029h."""
        yield array(0x1029, "Error behaviour", (self._communication,))

    def reaction(self, state: NmtState) -> NmtCommand | None:
        """What a communication error does in this state."""
        return REACTIONS.get((self._communication.number, state))


def _check_behaviour(data: bytes) -> None:
    if data[0] > 2:
        raise Abort(AbortCode.INVALID_VALUE)


def _text(name: str, text: str) -> Entry:
    return Entry(0, name, CanType.VISIBLE_STRING, Access.CONST, text.encode("ascii"))
