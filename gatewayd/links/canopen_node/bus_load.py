"""How much of a CAN bus the cells on it can take in the worst case.

Counted is what goes on without anybody asking: PDOs of both directions, SYNC, heartbeats. SDO, NMT and EMCY come on
top, and so do other nodes. All frames are taken at their greatest length (worst-case bit stuffing) and all PDOs at
their greatest rate:

- synchronous: each SYNC, or every n-th; without a known period one SYNC for each package of the robot;
- event-driven with an inhibit time: one after the other at that distance;
- event-driven without one: with each package of the robot, which neither reports nor takes values more often; the event
  timer may add some.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Final

from gatewayd.core.definition import Direction
from gatewayd.links.canopen_node.expand import CanopenCell, ExpandedPdo
from gatewayd.links.canopen_node.sections import CanopenWriter
from gatewayd.mapping.expanded import ExpandedCell

__all__ = [
    "BIT_RATES",
    "ERROR_ABOVE",
    "FIRST_EVENT_TYPE",
    "WARNING_ABOVE",
    "Share",
    "Station",
    "bus_shares",
    "frame_bits",
    "load",
    "pdo_bits",
    "pdo_rate",
    "station_of",
]

BIT_RATES: Final = (10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)
"""Bit-rates of CiA 301, 5.2, in bit/s."""
WARNING_ABOVE: Final = 0.4
"""Share of the bus above which SDO and other nodes become slow."""
ERROR_ABOVE: Final = 0.7
"""Share of the bus above which low-priority frames may wait for ever."""
FIRST_EVENT_TYPE: Final = 254
"""Transmission types below are synchronous."""

_STUFFED: Final = 34
"""Bits of a frame that are stuffed, without the data: start, identifier, control, CRC (ISO 11898-1)."""
_OVERHEAD: Final = 47
"""Bits of a frame without data and stuff bits, with the three of the interframe space."""
_HEARTBEATS_PER_TIMEOUT: Final = 2


def frame_bits(length: int) -> int:
    """Greatest length of a frame with an 11-bit identifier and `length` bytes, interframe space included, in bits."""
    return _OVERHEAD + 8 * length + (_STUFFED + 8 * length - 1) // 4


@dataclass(frozen=True, slots=True)
class Share:
    """What one frame takes of the bus."""

    what: str
    bits: int
    rate: float
    """Frames per second."""

    @property
    def bits_per_second(self) -> float:
        """Bits per second."""
        return self.bits * self.rate


@dataclass(frozen=True, slots=True)
class Station:
    """One cell on the bus, as far as the load goes."""

    node: CanopenCell
    rate: float
    """Packages of the robot per second at most."""
    writers: tuple[CanopenWriter, ...]


def station_of(cell: ExpandedCell, node: CanopenCell) -> Station:
    """What a cell means for the bus that its node is on."""
    writers = tuple(part.spec.by(CanopenWriter) for part in cell.document.writers.values())
    return Station(node, cell.settings.rate, writers)


def pdo_bits(pdo: ExpandedPdo) -> int:
    """Greatest length of its frame, in bits."""
    return frame_bits(ceil(min(pdo.bits, 64) / 8))


def pdo_rate(pdo: ExpandedPdo, rate: float, sync_period: float | None) -> float:
    """Frames per second in the worst case; `rate` is that of the robot's packages."""
    if pdo.transmission < FIRST_EVENT_TYPE:
        syncs = rate if sync_period is None else 1 / sync_period
        if pdo.transmission == 0:
            return min(syncs, rate)
        return syncs if pdo.direction is Direction.INPUT else syncs / pdo.transmission
    greatest = rate
    if pdo.direction is Direction.OUTPUT and pdo.event is not None:
        greatest = rate * max(ceil(1 / (rate * pdo.event)), 1)
    return greatest if pdo.inhibit is None else min(greatest, 1 / pdo.inhibit)


def bus_shares(stations: Sequence[Station]) -> tuple[Share, ...]:
    """What the cells on one bus send, and what is sent to them; SYNC and watched heartbeats once for all."""
    periods = _sync_periods(stations)
    found: list[Share] = []
    for station in stations:
        spec = station.node.part.spec
        for pdo in station.node.pdos:
            rate = pdo_rate(pdo, station.rate, periods.get(spec.sync.cob_id))
            found.append(Share(f"node {spec.node}: {pdo.label}", pdo_bits(pdo), rate))
        if spec.heartbeat is not None:
            found.append(Share(f"node {spec.node}: heartbeat", frame_bits(1), 1 / spec.heartbeat))
    found.extend(_syncs(stations, periods))
    found.extend(_watched(stations))
    return tuple(found)


def load(shares: Iterable[Share], bit_rate: int) -> float:
    """The share of the bus, 1.0 for all of it."""
    return sum(share.bits_per_second for share in shares) / bit_rate


def _sync_periods(stations: Sequence[Station]) -> dict[int, float]:
    """The shortest period that is stated for a COB-ID of SYNC."""
    periods: dict[int, float] = {}
    for station in stations:
        sync = station.node.part.spec.sync
        if sync.period is not None:
            periods[sync.cob_id] = min(sync.period, periods.get(sync.cob_id, sync.period))
    return periods


def _syncs(stations: Sequence[Station], periods: Mapping[int, float]) -> Iterable[Share]:
    for cob_id, period in sorted(periods.items()):
        counted = any(
            sync.counter and sync.cob_id == cob_id
            for sync in (station.node.part.spec.sync for station in stations)
        )
        yield Share("SYNC", frame_bits(1 if counted else 0), 1 / period)


def _watched(stations: Sequence[Station]) -> Iterable[Share]:
    """Heartbeats of nodes that are no cells."""
    own = {station.node.part.spec.node for station in stations}
    shortest: dict[int, float] = {}
    for writer in (writer for station in stations for writer in station.writers):
        if writer.node is not None and writer.heartbeat is not None and writer.node not in own:
            shortest[writer.node] = min(writer.heartbeat, shortest.get(writer.node, writer.heartbeat))
    for node, timeout in sorted(shortest.items()):
        yield Share(f"node {node}: heartbeat", frame_bits(1), _HEARTBEATS_PER_TIMEOUT / timeout)
