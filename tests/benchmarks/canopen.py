"""What a PDO costs, beside python-canopen's own way; how soon a SYNC is answered; a saturated bus."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from statistics import median
from typing import TypeVar

from tests.benchmarks.can_node import BITS, INTEGERS
from tests.benchmarks.can_peer import (
    Peer,
    Reception,
    in_process,
    leave_operational,
    make_synchronous,
    node,
    receive,
    syncs,
    transmit,
)
from tests.benchmarks.report import Table, against, at_least, at_most, histogram, percentile
from tests.benchmarks.samples import NOISE, RULE, Samples
from tests.benchmarks.trees import Job

SATURATED = 8752
"""Frames of 8 bytes that a bus of 1 Mbit/s carries in a second, with stuffing as it falls."""
ROUNDS = 2
STOCK = "canopen"
RECEIVED, WITHOUT_BUS, SENT = "received", "without a bus", "sent"
TO_NODE = "received, up to the node"
CPU_AIMS = {f"{RECEIVED}, 2 integers": 8.0, f"{RECEIVED}, 64 bits": 40.0, TO_NODE: 5.0}
"""us of CPU per frame."""
BOUNDS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0)

COST = f"""\
Both nodes are processes at the end of a pair of sockets that carries SocketCAN's frames, so both run the code that they
run on SocketCAN. Received: RPDOs with new values, the whole way into the cell (gatewayd: checked for owner and limits,
and told to the listeners) or into Python variables (canopen: its notifier, a callback, `.raw`); integers at the rate of
a saturated bus of 1 Mbit/s, bits at a tenth of it. Without a bus: the same from the node on, in one process. Up to the
node: the same in PRE-OPERATIONAL, where gatewayd drops RPDOs as CiA 301 demands, so that only driver and dispatch are
left; a LocalNode knows no such state. Sent: values of the robot up to the frame in the socket (canopen: `.raw`,
`transmit`). User and system time of the process per frame, median of {ROUNDS} rounds in which the nodes take turns.
{RULE}"""
SATURATION = """\
The same frames: as many in each slot of 10 ms as the bus carries. Lost: no room in the socket, or never counted."""
LATENCY = """\
SYNC handed to the kernel by another process -> a TPDO of type 1 in its hands, socket pair both ways included."""

T = TypeVar("T")


def run(job: Job) -> list[Table]:
    """Three tables."""
    samples = Samples()
    nodes = {tree.name: (tree, "gatewayd") for tree in job.trees} | {STOCK: (job.trees[0], STOCK)}
    found = {name: _Figures() for name in nodes}
    for _ in range(ROUNDS):
        for name, (tree, kind) in nodes.items():
            with node(tree, kind) as peer:
                _measure(found[name], peer, kind, job.seconds / ROUNDS, samples)
    return [_costs(found, samples), _saturated(found), _latency(found)]


@dataclass
class _Figures:
    """What was measured of one node, in all rounds."""

    costs: dict[str, list[float]] = field(default_factory=dict)
    """CPU seconds per frame, by row."""
    saturated: list[Reception] = field(default_factory=list)
    syncs: list[float] = field(default_factory=list)

    def cost(self, row: str) -> float | None:
        return median(self.costs[row]) if row in self.costs else None


def _measure(figures: _Figures, peer: Peer, kind: str, seconds: float, samples: Samples) -> None:
    def take(row: str, measure: Callable[[], T]) -> T:
        return samples.take(row, peer.process.pid, measure)

    def note(row: str, cost: float) -> None:
        figures.costs.setdefault(row, []).append(cost)

    reception = take(f"{RECEIVED}, 2 integers", partial(receive, peer, INTEGERS, SATURATED, seconds))
    figures.saturated.append(reception)
    note(f"{RECEIVED}, 2 integers", reception.cpu)
    bits = take(f"{RECEIVED}, 64 bits", partial(receive, peer, BITS, SATURATED / 10, seconds))
    note(f"{RECEIVED}, 64 bits", bits.cpu)
    for what, pdo in (("2 integers", INTEGERS), ("64 bits", BITS)):
        if kind != STOCK:
            note(f"{WITHOUT_BUS}, {what}", take(f"{WITHOUT_BUS}, {what}", partial(in_process, peer, pdo)))
        note(f"{SENT}, {what}", take(f"{SENT}, {what}", partial(transmit, peer, pdo)))
    if kind != STOCK:
        make_synchronous(peer)
    figures.syncs += take("SYNC", partial(syncs, peer, seconds))
    if kind != STOCK:
        leave_operational(peer)
        note(TO_NODE, take(TO_NODE, partial(receive, peer, INTEGERS, SATURATED, seconds)).cpu)


def _costs(found: dict[str, _Figures], samples: Samples) -> Table:
    own, *others = found
    table = Table(
        "CPU per PDO frame", COST, ("frame", *found, *(f"{name} / {own}" for name in others), *NOISE)
    )
    for row in found[own].costs:
        costs = {name: figures.cost(row) for name, figures in found.items()}
        cells = [f"{cost * 1e6:.3g} us" if cost is not None else "-" for cost in costs.values()]
        mine = costs[own]
        if mine is not None and row in CPU_AIMS:
            cells[0] = at_most(mine * 1e6, CPU_AIMS[row], " us")
        cells += [against(costs[name], mine, at_least, 1.0 if name == STOCK else None) for name in others]
        table.add(row, *cells, *samples.noise(row))
    table.note = samples.note
    return table


def _saturated(found: dict[str, _Figures]) -> Table:
    table = Table("A saturated bus of 1 Mbit/s", SATURATION, ("node", "frames/s", "lost", "share of a core"))
    for name, figures in found.items():
        lost = sum(one.lost for one in figures.saturated)
        rate = median(one.rate for one in figures.saturated)
        cpu = median(one.cpu for one in figures.saturated)
        told = str(lost) if name == STOCK else at_most(lost, 0)
        table.add(name, f"{rate:.0f}", told, f"{100 * cpu * rate:.1f} %")
    return table


def _latency(found: dict[str, _Figures]) -> Table:
    table = Table("SYNC -> TPDO", LATENCY, ("time", *found, ""))
    times = {name: figures.syncs for name, figures in found.items()}
    for name, share in (("p50", 0.5), ("p99", 0.99)):
        table.add(name, *(f"{percentile(values, share) * 1000:.3f} ms" for values in times.values()))
    first, *rest = (histogram(values, BOUNDS) for values in times.values())
    for number, (bound, part, bar) in enumerate(first):
        table.add(bound, part, *(rows[number][1] for rows in rest), bar)
    return table
