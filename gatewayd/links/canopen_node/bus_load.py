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
from math import ceil
from typing import Final

from gatewayd.canopen import lss
from gatewayd.canopen.load import Share, frame_bits
from gatewayd.core.definition import Direction
from gatewayd.links.can_buses import BusUse
from gatewayd.links.canopen_node.expand import ExpandedPdo, the_node
from gatewayd.links.canopen_node.sections import CanopenWriter
from gatewayd.mapping.expanded import ExpandedCell

BIT_RATES: Final = tuple(sorted(rate for rate in lss.BIT_RATES if rate is not None))
"""Bit-rates of CiA 301, 5.2, in bit/s, from the slowest on."""
FIRST_EVENT_TYPE: Final = 254
"""Transmission types below are synchronous."""

_HEARTBEATS_PER_TIMEOUT: Final = 2


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


def bus_shares(cells: Sequence[ExpandedCell]) -> tuple[Share, ...]:
    """What the cells on one bus send, and what is sent to them; SYNC and watched heartbeats once for all."""
    periods = _sync_periods(cells)
    found: list[Share] = []
    for cell in cells:
        node = the_node(cell)
        spec = node.part.spec
        for pdo in node.pdos:
            rate = pdo_rate(pdo, cell.settings.rate, periods.get(spec.sync.cob_id))
            found.append(Share(f"node {spec.node}: {pdo.label}", pdo_bits(pdo), rate))
        if spec.heartbeat is not None:
            found.append(Share(f"node {spec.node}: heartbeat", frame_bits(1), 1 / spec.heartbeat))
    found.extend(_syncs(cells, periods))
    found.extend(_watched(cells))
    return tuple(found)


def _sync_periods(cells: Sequence[ExpandedCell]) -> dict[int, float]:
    """The shortest period that is stated for a COB-ID of SYNC."""
    periods: dict[int, float] = {}
    for cell in cells:
        sync = the_node(cell).part.spec.sync
        if sync.period is not None:
            periods[sync.cob_id] = min(sync.period, periods.get(sync.cob_id, sync.period))
    return periods


def _syncs(cells: Sequence[ExpandedCell], periods: Mapping[int, float]) -> Iterable[Share]:
    counted = {sync.cob_id for sync in (the_node(cell).part.spec.sync for cell in cells) if sync.counter}
    for cob_id, period in sorted(periods.items()):
        yield Share("SYNC", frame_bits(1 if cob_id in counted else 0), 1 / period)


def _watched(cells: Sequence[ExpandedCell]) -> Iterable[Share]:
    """Heartbeats of nodes that are no cells."""
    own = {the_node(cell).part.spec.node for cell in cells}
    shortest: dict[int, float] = {}
    for part in (part for cell in cells for part in cell.document.writers.values()):
        writer = part.spec.by(CanopenWriter)
        if writer.node is not None and writer.heartbeat is not None and writer.node not in own:
            shortest[writer.node] = min(writer.heartbeat, shortest.get(writer.node, writer.heartbeat))
    for node, timeout in sorted(shortest.items()):
        yield Share(f"node {node}: heartbeat", frame_bits(1), _HEARTBEATS_PER_TIMEOUT / timeout)


def bus_use(cell: ExpandedCell) -> BusUse:
    """What the node of a cell is on its bus, for other kinds of links on it."""
    node = the_node(cell)
    spec = node.part.spec
    sends = {
        pdo.slot.cob_id: f"{pdo.label} of node {spec.node}"
        for pdo in node.pdos
        if pdo.direction is Direction.OUTPUT and pdo.slot.cob_id is not None
    }
    return BusUse(
        spec.interface,
        spec.channel,
        spec.bitrate,
        spec.node,
        "the gateway's own node (`canopen`)",
        node.part.at("node"),
        node.part.at("bitrate"),
        sends,
        bus_shares([cell]),
    )
