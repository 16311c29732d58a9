"""The compiled CANopen side of a mapping: one node on one bus, immutable."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Literal

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.heartbeat import Consumer
from gatewayd.canopen.identity import Identity
from gatewayd.canopen.identity import revision as release_revision
from gatewayd.canopen.product import PRODUCT_CODE, VENDOR_ID
from gatewayd.canopen.sync import SyncPlan
from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.mapping.plan import LinkPlan, Plan
from gatewayd.report.wording import number

GUARDING: Final = 0
"""Stands for the master that guards this node, which has no node-ID."""


@dataclass(frozen=True, slots=True)
class IdentityPlan:
    """1018h as the mapping declares it."""

    vendor: int = VENDOR_ID
    product: int = PRODUCT_CODE
    revision: int | Literal["auto"] | None = None
    """`auto`: it follows the dictionary; None: that of the release."""
    serial: int | Literal["fingerprint"] | None = None
    """`fingerprint`: that of the mapping; None: it follows from the name of the cell."""

    def of(self, cell: CellDefinition, follows: Callable[[], int]) -> Identity:
        """The numbers for a cell; `follows` gives the revision that follows the dictionary."""
        revision = release_revision() if self.revision is None else self.revision
        serial = zlib.crc32(cell.name.encode()) if self.serial is None else self.serial
        return Identity(
            self.vendor,
            self.product,
            follows() if revision == "auto" else revision,
            cell.fingerprint if serial == "fingerprint" else serial,
        )


@dataclass(frozen=True, slots=True)
class ObjectPlan:
    """Where one variable lies in the object dictionary."""

    variable: int
    """Index into `CellDefinition.variables`."""
    index: int
    subindex: int
    type: CanType
    linear: tuple[float, float] | None = None
    """Scale and offset: value = raw * scale + offset; None: the raw number is the value."""

    @property
    def type_text(self) -> str:
        """For people: `INTEGER16`, `INTEGER16 * 0.1`, `INTEGER16 * 0.1 + -5`."""
        if self.linear is None:
            return self.type.name
        scale, offset = self.linear
        text = f"{self.type.name} * {number(scale)}"
        return f"{text} + {number(offset)}" if offset else text


@dataclass(frozen=True, slots=True)
class PdoEntry:
    """One mapped object of a PDO: a variable, a word of the status block, or a dummy that fills a gap."""

    variable: int | None
    """Index of the variable; None for a word of the status block and for a dummy."""
    index: int
    subindex: int
    bits: int
    quality_of: int | None = None
    """Index of the variable whose quality this word of the status block is."""


@dataclass(frozen=True, slots=True)
class PdoPlan:
    """One PDO as it is after power-on."""

    number: int
    """From 1 within its direction: parameters at 1400h/1800h + number - 1."""
    direction: Direction
    """INPUT: an RPDO; OUTPUT: a TPDO."""
    cob_id: int
    predefined: bool
    """The COB-ID is the predefined one: it follows the node-ID."""
    transmission: int
    """0, 1-240, 254 or 255 (CiA 301, 7.5.2.36)."""
    inhibit: int
    """Least distance of two transmissions in 100 us; 0: none. RPDO: what its producer keeps, for the bus load."""
    event: int
    """TPDO: longest distance of two transmissions; RPDO: deadline; in ms; 0: none."""
    entries: tuple[PdoEntry, ...]
    sync_start: int = 0
    writer: int | None = None
    """RPDO: the writer that it is; None: the one that all others are (`CanopenPlan.rpdo_writer`)."""
    name: str = ""
    """As the mapping calls it; empty for a PDO of the automatic layout."""


@dataclass(frozen=True, slots=True)
class CanopenPlan(LinkPlan):
    """One node on one bus."""

    kind = "canopen"

    interface: str
    """Interface of python-can; `socketcan` has a path of its own."""
    channel: str
    bitrate: int
    node: int
    autostart: bool
    """Enter OPERATIONAL without waiting for an NMT master."""
    heartbeat: int
    """Producer heartbeat time in ms after power-on."""
    sync: SyncPlan
    consumers: tuple[Consumer, ...]
    objects: tuple[ObjectPlan, ...]
    pdos: tuple[PdoPlan, ...]
    rpdo_writer: int | None
    """The writer that RPDOs are which have none of their own; None: nobody."""
    sdo_writer: int | None
    """The writer that SDO clients are; None: variables are read-only by SDO."""
    identity: IdentityPlan = IdentityPlan()
    guarded: tuple[Consumer, ...] = ()
    """Writers that promise to guard this node, and after how long they are missed; the node is `GUARDING`."""
    guard_time: int = 0
    """Milliseconds between two requests of a guarding master (100Ch); 0: not supervised."""
    life_time_factor: int = 0
    """Guard times after which it is missed (100Dh)."""
    emcy_inhibit: int = 0
    """Least distance of two EMCY in 100 us (1015h)."""
    error_behaviour: int = 0
    """What a communication error does to the NMT state (1029h): 0 leave OPERATIONAL, 1 nothing, 2 stop."""

    @property
    def rpdo_writers(self) -> Mapping[int, int | None]:
        """Number of each RPDO with a writer of its own -> that writer."""
        return {pdo.number: pdo.writer for pdo in self.pdos if pdo.writer is not None}


def canopen_of(plan: Plan) -> CanopenPlan | None:
    """The CANopen node of a cell; None: it has none."""
    return plan.of(CanopenPlan).get("canopen")
