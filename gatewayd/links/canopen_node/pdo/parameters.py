"""Communication and mapping parameters of the PDOs: objects 1400h, 1600h, 1800h and 1A00h on (CiA 301, 7.5.2.35-38).

What an SDO client may change, and when, with the abort code of everything else:

| entry | may be written | else |
|---|---|---|
| COB-ID | with bit 31 set always; a valid one again only unchanged in bits 0-29; made valid with 11 bits, neither \
restricted nor that of another TPDO, a TPDO with bit 30 set, and with something mapped | 0609 0030 |
| transmission type | always: 0-240, 254, 255 | 0609 0030 |
| inhibit time, SYNC start value (0-240) | while the PDO is invalid | 0609 0030 |
| event timer | always | |
| number of mapped objects | while the PDO is invalid | 0601 0000 |
| ... other than 0 | all these entries are set and aligned / at most 64 bits in all | 0604 0041 / 0604 0042 |
| mapped object | while the PDO is invalid and the number is 0 | 0601 0000 |
| ... | the object exists / may be mapped in this direction with its whole length | 0602 0000 / 0604 0041 |

A TPDO is made valid only with bit 30 of its COB-ID ("no RTR allowed"), since remote frames are not answered; made
invalid it may be without. A mapped object written as 0 is an unset one. Where CiA 301 leaves the code open, these are
CANopenNode's, which its conformance test accepts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from gatewayd.canopen.cob_ids import BASIC_FRAME, INVALID, is_restricted, predefined_pdo
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, AbortCode, Access, Entry, Object, Pdo, record
from gatewayd.core.definition import Direction, Variable
from gatewayd.links.canopen_node.pdo.codec import MAX_BITS, Layout, Mapped, is_aligned
from gatewayd.links.canopen_node.plan import CanopenPlan, PdoPlan
from gatewayd.links.canopen_node.status_objects import status_word

MIN_NUMBER: Final = 4
"""PDOs per direction that a node has even if its mapping uses fewer, so that a master can map its own."""

NO_RTR: Final = 0x4000_0000
"""Bit 30 of a TPDO's COB-ID: remote frames are not answered."""
_IDENTIFIER: Final = 0x3FFF_FFFF
_SYNCHRONOUS: Final = 240
"""Greatest synchronous transmission type, and greatest value of the SYNC counter."""
_EVENT_DRIVEN: Final = (254, 255)
_DUMMIES: Final = {
    can_type.code: can_type
    for can_type in (
        CanType.INTEGER8,
        CanType.INTEGER16,
        CanType.INTEGER32,
        CanType.UNSIGNED8,
        CanType.UNSIGNED16,
        CanType.UNSIGNED32,
    )
}
"""Types whose own index may be mapped into an RPDO to skip that many bits (CiA 301, 7.4.7.1)."""


@dataclass(frozen=True, slots=True)
class Configuration:
    """A valid PDO as its parameters are now."""

    number: int
    """From 1 within its direction."""
    can_id: int
    transmission: int
    """0, 1-240, 254 or 255."""
    mapping: tuple[Mapped, ...]
    layout: Layout = field(compare=False)
    inhibit: float = 0.0
    """TPDO: least distance of two transmissions in seconds."""
    event: float = 0.0
    """TPDO: longest distance of two transmissions, RPDO: deadline; in seconds; 0: none."""
    sync_start: int = 0
    """Counter value of the SYNC that counts as the first one; 0: any."""

    @property
    def is_synchronous(self) -> bool:
        """Whether SYNC decides when it takes effect."""
        return self.transmission <= _SYNCHRONOUS


Changed = Callable[[Direction, int, Configuration | None], None]
"""Gets the direction and number of a PDO and what it is now; None: it does not exist."""
Find = Callable[[int, int], Entry]
"""The entry at index and sub-index. Raises Abort if there is none. Called when parameters are written, not before."""


@dataclass(frozen=True, slots=True)
class _Surroundings:
    """What all PDOs of a node look things up in."""

    objects: Mapping[tuple[int, int], Mapped]
    variables: Sequence[Variable]
    find: Find
    taken: Callable[[PdoParameters, int], bool]
    changed: Changed


@dataclass(frozen=True, slots=True)
class _Kind:
    """What the two directions do not have in common."""

    name: str
    communication: int
    mapping: int
    pdo: Pdo
    flags: int
    dummies: Mapping[int, CanType]


_KINDS: Final = {
    Direction.INPUT: _Kind("RPDO", 0x1400, 0x1600, Pdo.RECEIVE, 0, _DUMMIES),
    Direction.OUTPUT: _Kind("TPDO", 0x1800, 0x1A00, Pdo.TRANSMIT, NO_RTR, {}),
}


class PdoParameters:
    """The parameters of one PDO. Its entries in the dictionary are its state; `configuration` follows from them."""

    def __init__(self, plan: PdoPlan, around: _Surroundings) -> None:
        self.direction = plan.direction
        self.number = plan.number
        self.configuration: Configuration | None = None
        self._kind = _KINDS[plan.direction]
        self._plan = plan
        self._around = around
        self._cob_id = self._entry(1, "COB-ID", CanType.UNSIGNED32, self._check_cob_id)
        self._transmission = self._entry(2, "Transmission type", CanType.UNSIGNED8, _check_transmission)
        self._inhibit = self._entry(3, "Inhibit time", CanType.UNSIGNED16, self._check_inhibit)
        self._event = self._entry(5, "Event timer", CanType.UNSIGNED16)
        self._sync_start = self._entry(6, "SYNC start value", CanType.UNSIGNED8, self._check_sync_start)
        self._count = self._entry(0, "Number of mapped objects", CanType.UNSIGNED8, self._check_count)
        self._slots = tuple(
            self._entry(number, f"Mapped object {number}", CanType.UNSIGNED32, self._check_slot)
            for number in range(1, MAX_BITS + 1)
        )
        self._entries = (
            self._cob_id,
            self._transmission,
            self._inhibit,
            self._event,
            self._sync_start,
            self._count,
            *self._slots,
        )

    @property
    def can_id(self) -> int | None:
        """The identifier; None while the PDO is invalid."""
        return self._cob_id.number & BASIC_FRAME if self.is_valid else None

    @property
    def is_valid(self) -> bool:
        """Whether the PDO exists (bit 31 of its COB-ID is clear)."""
        return not self._cob_id.number & INVALID

    def objects(self) -> tuple[Object, Object]:
        """The communication and the mapping parameter."""
        kind, offset = self._kind, self.number - 1
        communication = (
            (self._cob_id, self._transmission, self._event)
            if self.direction is Direction.INPUT
            else (self._cob_id, self._transmission, self._inhibit, self._event, self._sync_start)
        )
        return (
            record(
                kind.communication + offset,
                f"{kind.name} communication parameter {self.number}",
                communication,
            ),
            record(
                kind.mapping + offset,
                f"{kind.name} mapping parameter {self.number}",
                (self._count, *self._slots),
            ),
        )

    def restore(self, node: int) -> None:
        """Put the defaults back; those that follow the node-ID follow `node`."""
        plan = self._plan
        cob_id, self._cob_id.plus_node = self._default_cob_id(node)
        mapped = [entry.index << 16 | entry.subindex << 8 | entry.bits for entry in plan.entries]
        unset = [0] * (MAX_BITS - len(mapped))
        defaults = (cob_id, plan.transmission, plan.inhibit, plan.event, plan.sync_start, len(mapped))
        for entry, value in zip(self._entries, (*defaults, *mapped, *unset), strict=True):
            assert entry.type.size is not None
            entry.value = entry.default = value.to_bytes(entry.type.size, "little")

    def verify(self) -> None:
        """Check values that did not come through `Entry.write`. Raises Abort for what could not have been written."""
        for entry in self._entries:
            if len(entry.value) != entry.type.size:
                raise Abort(AbortCode.LENGTH)
        self._verify_cob_id(self._cob_id.number)
        _check_transmission(self._transmission.value)
        if self._sync_start.number > _SYNCHRONOUS:
            raise Abort(AbortCode.INVALID_VALUE)
        self._mapping(self._count.number)

    def apply(self) -> None:
        """Work out `configuration` anew, and report it if it has changed."""
        configuration = self._configured() if self.is_valid else None
        if configuration != self.configuration:
            self.configuration = configuration
            self._around.changed(self.direction, self.number, configuration)

    # -- checks of single writes ---------------------------------------------------------------------------------

    def _check_cob_id(self, data: bytes) -> None:
        new = int.from_bytes(data, "little")
        changes = (new ^ self._cob_id.number) & _IDENTIFIER
        asks_rtr = self._kind.flags and not new & (INVALID | NO_RTR)
        if asks_rtr or (not new & INVALID and self.is_valid and changes):
            raise Abort(AbortCode.INVALID_VALUE)
        self._verify_cob_id(new)

    def _verify_cob_id(self, cob_id: int) -> None:
        identifier = cob_id & _IDENTIFIER
        if identifier > BASIC_FRAME:
            raise Abort(AbortCode.INVALID_VALUE)
        if cob_id & INVALID:
            return
        if is_restricted(identifier) or self._around.taken(self, identifier) or not self._count.number:
            raise Abort(AbortCode.INVALID_VALUE)

    def _check_inhibit(self, _data: bytes) -> None:
        if self.is_valid:
            raise Abort(AbortCode.INVALID_VALUE)

    def _check_sync_start(self, data: bytes) -> None:
        if self.is_valid or data[0] > _SYNCHRONOUS:
            raise Abort(AbortCode.INVALID_VALUE)

    def _check_count(self, data: bytes) -> None:
        if self.is_valid:
            raise Abort(AbortCode.UNSUPPORTED_ACCESS)
        self._mapping(data[0])

    def _check_slot(self, data: bytes) -> None:
        if self.is_valid or self._count.number:
            raise Abort(AbortCode.UNSUPPORTED_ACCESS)
        value = int.from_bytes(data, "little")
        if value:
            self._mapped(value)

    # -- mapping -------------------------------------------------------------------------------------------------

    def _mapping(self, count: int) -> tuple[Mapped, ...]:
        """The first `count` mapped objects. Raises Abort if they make no PDO."""
        if count > len(self._slots):
            raise Abort(AbortCode.PDO_LENGTH)
        values = [slot.number for slot in self._slots[:count]]
        if 0 in values:
            raise Abort(AbortCode.NOT_MAPPABLE)
        mapping = tuple(self._mapped(value) for value in values)
        if sum(mapped.type.bits for mapped in mapping) > MAX_BITS:
            raise Abort(AbortCode.PDO_LENGTH)
        if not is_aligned(mapped.type for mapped in mapping):
            raise Abort(AbortCode.NOT_MAPPABLE)
        return mapping

    def _mapped(self, value: int) -> Mapped:
        """A mapped object as it is written. Raises Abort if a PDO of this direction cannot hold it."""
        index, subindex, bits = value >> 16, value >> 8 & 0xFF, value & 0xFF
        if bits > MAX_BITS:
            raise Abort(AbortCode.PDO_LENGTH)
        mapped = self._known(value)
        if mapped is None or not mapped.is_dummy:
            try:
                entry = self._around.find(index, subindex)
            except Abort as abort:
                raise Abort(AbortCode.NO_OBJECT) from abort
            if entry.pdo is not self._kind.pdo:
                raise Abort(AbortCode.NOT_MAPPABLE)
        if mapped is None or mapped.type.bits != bits:
            raise Abort(AbortCode.NOT_MAPPABLE)
        return mapped

    def _known(self, value: int) -> Mapped | None:
        """The same without a look into the dictionary."""
        index, subindex = value >> 16, value >> 8 & 0xFF
        dummy = self._kind.dummies.get(index) if subindex == 0 else None
        if dummy is not None:
            return Mapped(None, dummy)
        return self._around.objects.get((index, subindex)) or status_word(index, subindex)

    # -- inside --------------------------------------------------------------------------------------------------

    def _configured(self) -> Configuration:
        # What is in the entries was verified when it was written, so nothing is looked up in a dictionary here: the
        # plan's own PDOs are configured before there is one.
        known = (self._known(slot.number) for slot in self._slots[: self._count.number])
        mapping = tuple(mapped for mapped in known if mapped is not None)
        assert len(mapping) == self._count.number
        return Configuration(
            number=self.number,
            can_id=self._cob_id.number & BASIC_FRAME,
            transmission=self._transmission.number,
            mapping=mapping,
            layout=Layout(mapping, self._around.variables),
            inhibit=self._inhibit.number / 10_000,
            event=self._event.number / 1_000,
            sync_start=self._sync_start.number,
        )

    def _default_cob_id(self, node: int) -> tuple[int, bool]:
        """The COB-ID, and whether it follows the node-ID."""
        plan, flags = self._plan, self._kind.flags
        predefined = predefined_pdo(self.number, node, transmit=self.direction is Direction.OUTPUT)
        if predefined is not None and plan.predefined:
            return flags | plan.cob_id & INVALID | predefined, True
        return flags | plan.cob_id, False

    def _entry(
        self, subindex: int, name: str, can_type: CanType, check: Callable[[bytes], None] | None = None
    ) -> Entry:
        return Entry(subindex, name, can_type, Access.RW, stored=True, check=check, changed=self.apply)


class PdoTable:
    """The parameters of all PDOs of a node: those of the plan, and unused ones up to `MIN_NUMBER` in each direction.

    `changed` is called for every PDO that is valid from the start, while the table is made, and of every change
    afterwards.
    """

    def __init__(
        self, plan: CanopenPlan, variables: Sequence[Variable], find: Find, changed: Changed
    ) -> None:
        around = _Surroundings(
            objects={
                (placed.index, placed.subindex): Mapped(placed.variable, placed.type, linear=placed.linear)
                for placed in plan.objects
            },
            variables=variables,
            find=find,
            taken=self._is_taken,
            changed=changed,
        )
        self._node = plan.node
        self.pdos = tuple(
            PdoParameters(planned.get(number) or _unused(direction, number), around)
            for direction in (Direction.INPUT, Direction.OUTPUT)
            for planned in [{pdo.number: pdo for pdo in plan.pdos if pdo.direction is direction}]
            for number in range(1, max(MIN_NUMBER, *planned, 0) + 1)
        )
        """RPDOs, then TPDOs, by number."""
        self.restore()

    def objects(self) -> Iterable[Object]:
        """The objects of all PDOs."""
        return (parameter for pdo in self.pdos for parameter in pdo.objects())

    def restore(self, node: int | None = None) -> None:
        """Put the defaults of the mapping back, for another node-ID if one is given."""
        self._node = node if node is not None else self._node
        for pdo in self.pdos:
            pdo.restore(self._node)
        for pdo in self.pdos:
            pdo.apply()

    def reload(self) -> list[int]:
        """Take over values that were put into the entries directly, as stored parameters are.

        A PDO whose values could not have been written goes back to its defaults whole; returns the indices of these
        PDOs' communication parameters.
        """
        broken: list[PdoParameters] = []
        # A PDO that goes back to its default identifier may take it from one that was sound until then.
        while news := [pdo for pdo in self.pdos if pdo not in broken and not _is_sound(pdo)]:
            for pdo in news:
                pdo.restore(self._node)
            broken += news
        for pdo in self.pdos:
            pdo.apply()
        return sorted(pdo.objects()[0].index for pdo in broken)

    def _is_taken(self, asking: PdoParameters, can_id: int) -> bool:
        # Several RPDOs may listen to one identifier. Of two TPDOs with one, the queue would keep the newer frame only.
        return asking.direction is Direction.OUTPUT and any(
            pdo.can_id == can_id
            for pdo in self.pdos
            if pdo is not asking and pdo.direction is Direction.OUTPUT
        )


def _is_sound(pdo: PdoParameters) -> bool:
    try:
        pdo.verify()
    except Abort:
        return False
    return True


def _check_transmission(data: bytes) -> None:
    if data[0] > _SYNCHRONOUS and data[0] not in _EVENT_DRIVEN:
        raise Abort(AbortCode.INVALID_VALUE)


def _unused(direction: Direction, number: int) -> PdoPlan:
    """A PDO that the mapping does not use: invalid, with nothing mapped."""
    return PdoPlan(
        number, direction, INVALID, predefined=True, transmission=255, inhibit=0, event=0, entries=()
    )
