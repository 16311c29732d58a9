"""The Prometheus view: every number the cells and the probes keep, read when it is asked for. All that is known of
prometheus-client is here.

`METRICS` is the list of what there is; docs/reference/metrics.md, the dashboard and the alert rules are held to it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum

from prometheus_client import CollectorRegistry, ProcessCollector, generate_latest
from prometheus_client.core import HistogramMetricFamily, Metric
from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily

from gatewayd.core.cell import Cell
from gatewayd.core.events import EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.refusal import Reason
from gatewayd.links.contract import LinkMetric
from gatewayd.links.registry import kind_of, kinds
from gatewayd.loop import clock
from gatewayd.report.printable import printable
from gatewayd.service.cell_runtime import CellRuntime
from gatewayd.web.health import readiness
from gatewayd.web.histogram import Histogram
from gatewayd.web.probes import Probes

__all__ = ["CONTENT_TYPE", "METRICS", "PROCESS_METRICS", "Exposition", "MetricInfo", "MetricKind"]

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"


class MetricKind(Enum):
    """What Prometheus calls the type of a metric."""

    COUNTER = "counter"
    GAUGE = "gauge"
    HISTOGRAM = "histogram"


@dataclass(frozen=True, slots=True)
class MetricInfo:
    """One metric."""

    name: str
    """As it is asked for; counters end in `_total`."""
    kind: MetricKind
    labels: tuple[str, ...]
    meaning: str


def _of_link(metric: LinkMetric) -> MetricInfo:
    kind = MetricKind.COUNTER if metric.name.endswith("_total") else MetricKind.GAUGE
    return MetricInfo(metric.name, kind, metric.labels, metric.meaning)


_CELL = ("cell",)
METRICS = (
    MetricInfo("gatewayd_info", MetricKind.GAUGE, ("version",), "1, with the version of the gateway"),
    MetricInfo("gatewayd_ready", MetricKind.GAUGE, (), "1 while every cell is served, as /readyz tells it"),
    MetricInfo(
        "gatewayd_parts_hanging",
        MetricKind.GAUGE,
        (),
        "parts of the gateway that do not turn; /healthz names them",
    ),
    MetricInfo(
        "gatewayd_troubles",
        MetricKind.GAUGE,
        (),
        "what is wrong with no cell in particular, say a mapping not served or a reload refused; /readyz names it",
    ),
    MetricInfo(
        "gatewayd_loop_lag_seconds",
        MetricKind.HISTOGRAM,
        (),
        "by how much the event loop came late, ten times a second",
    ),
    MetricInfo(
        "gatewayd_cell_info",
        MetricKind.GAUGE,
        ("cell", "fingerprint"),
        "1, with the fingerprint of the mapping",
    ),
    MetricInfo("gatewayd_uptime_seconds", MetricKind.GAUGE, _CELL, "seconds since the cell was first served"),
    MetricInfo(
        "gatewayd_robot_up",
        MetricKind.GAUGE,
        _CELL,
        "1 while the robot's values are fresh and its inputs can be written",
    ),
    MetricInfo(
        "gatewayd_robot_state",
        MetricKind.GAUGE,
        ("cell", "state"),
        "1 for the state the robot is in, 0 for all others",
    ),
    MetricInfo("gatewayd_robot_package_rate_hertz", MetricKind.GAUGE, _CELL, "packages per second, measured"),
    MetricInfo(
        "gatewayd_robot_age_seconds",
        MetricKind.GAUGE,
        _CELL,
        "seconds since the robot last told anything new; +Inf: never",
    ),
    MetricInfo("gatewayd_robot_packages_total", MetricKind.COUNTER, _CELL, "packages received"),
    MetricInfo(
        "gatewayd_robot_packages_skipped_total", MetricKind.COUNTER, _CELL, "packages the controller left out"
    ),
    MetricInfo("gatewayd_robot_packages_late_total", MetricKind.COUNTER, _CELL, "packages that came late"),
    MetricInfo(
        "gatewayd_robot_sessions_total",
        MetricKind.COUNTER,
        _CELL,
        "sessions with the controller; the first is no reconnect",
    ),
    MetricInfo("gatewayd_robot_watchdog_fed", MetricKind.GAUGE, _CELL, "1 while the robot's watchdog is fed"),
    MetricInfo(
        "gatewayd_read_back_mismatches_total",
        MetricKind.COUNTER,
        _CELL,
        "inputs whose read-back differed from what was written",
    ),
    MetricInfo(
        "gatewayd_lag_seconds",
        MetricKind.GAUGE,
        _CELL,
        "by how much the newest package of the robot is later than the quickest ones were; part of every age",
    ),
    MetricInfo(
        "gatewayd_differing",
        MetricKind.GAUGE,
        _CELL,
        "inputs for which the robot holds something else than it was given",
    ),
    MetricInfo(
        "gatewayd_unadopted", MetricKind.GAUGE, _CELL, "inputs whose content in the robot is not known"
    ),
    MetricInfo(
        "gatewayd_adoption_seconds",
        MetricKind.GAUGE,
        _CELL,
        "seconds until adopted inputs without an owner fall back; 0: none will",
    ),
    MetricInfo(
        "gatewayd_gaps_total",
        MetricKind.COUNTER,
        _CELL,
        "times the gateway stood still: stopped, suspended or starved of the CPU",
    ),
    MetricInfo("gatewayd_variables", MetricKind.GAUGE, ("cell", "quality"), "variables by quality"),
    MetricInfo(
        "gatewayd_input_age_seconds",
        MetricKind.GAUGE,
        _CELL,
        "seconds since any input was last written; +Inf: never",
    ),
    MetricInfo("gatewayd_locks", MetricKind.GAUGE, _CELL, "locks, owned or not"),
    MetricInfo(
        "gatewayd_locks_owned",
        MetricKind.GAUGE,
        ("cell", "writer"),
        "locks that the writer owns; `operator` is the local operator",
    ),
    MetricInfo(
        "gatewayd_writer_up",
        MetricKind.GAUGE,
        ("cell", "writer"),
        "1 while the writer is connected and heard in time",
    ),
    MetricInfo("gatewayd_writes_accepted_total", MetricKind.COUNTER, _CELL, "write requests applied"),
    MetricInfo("gatewayd_writes_refused_total", MetricKind.COUNTER, _CELL, "requests refused"),
    MetricInfo(
        "gatewayd_refusals_total",
        MetricKind.COUNTER,
        ("cell", "reason"),
        "requests refused by reason; equal ones are added every 10 s, so it may lag behind the total",
    ),
    MetricInfo("gatewayd_events_total", MetricKind.COUNTER, ("cell", "kind"), "events by kind"),
    *(_of_link(metric) for kind in kinds() for metric in kind.metrics),
    MetricInfo(
        "gatewayd_package_to_image_seconds",
        MetricKind.HISTOGRAM,
        _CELL,
        "from the arrival of a robot's package to its values standing in every fieldbus's image",
    ),
    MetricInfo(
        "gatewayd_write_to_package_seconds",
        MetricKind.HISTOGRAM,
        _CELL,
        "from the arrival of a write to the package with it to the robot, its wait for the control cycle included",
    ),
)
"""In the order in which they are reported."""

PROCESS_METRICS = {
    "process_cpu_seconds_total": "user and system time used",
    "process_max_fds": "file descriptors the process may open",
    "process_open_fds": "file descriptors it has open",
    "process_resident_memory_bytes": "memory it occupies",
    "process_start_time_seconds": "when it started, seconds since 1970",
    "process_virtual_memory_bytes": "address space it has",
}
"""What prometheus-client tells of the process itself."""

_INFO = {info.name: info for info in METRICS}
LINK_LABEL = "link"
"""Behind all others, the name of a link that is not called as its kind: a cell may have several of that."""
_Sample = tuple[tuple[str, ...], float]
_LEVELS = {False: 0.0, True: 1.0}


class Exposition:
    """Makes the text that Prometheus reads."""

    def __init__(self, probes: Probes, version: str) -> None:
        self._probes = probes
        self._version = version
        self._registry = CollectorRegistry(auto_describe=False)
        self._registry.register(self)
        ProcessCollector(registry=self._registry)

    def text(self) -> bytes:
        """Everything at this moment, in `CONTENT_TYPE`."""
        return generate_latest(self._registry)

    def describe(self) -> Iterator[Metric]:
        """Called when registering: names only."""
        for info in METRICS:
            yield _family(info)

    def collect(self) -> Iterator[Metric]:
        """Called for each `text`."""
        now = clock.now()
        daemon, probes = self._probes.daemon, self._probes
        troubles = probes.troubles()
        ready, _ = readiness(probes.verdicts(now), probes.late, troubles)
        samples: dict[str, list[_Sample]] = {
            "gatewayd_info": [((self._version,), 1)],
            "gatewayd_ready": [((), _LEVELS[ready])],
            "gatewayd_parts_hanging": [((), len(probes.late))],
            "gatewayd_troubles": [((), len(troubles))],
        }
        histograms: dict[str, list[tuple[tuple[str, ...], Histogram]]] = {
            "gatewayd_loop_lag_seconds": [((), probes.lag)],
            "gatewayd_package_to_image_seconds": [],
            "gatewayd_write_to_package_seconds": [],
        }
        for runtime in daemon.runtimes:
            name, probe = runtime.cell.definition.name, probes.of(runtime.cell)
            for metric, found in _cell(runtime, now).items():
                samples.setdefault(metric, []).extend(((name, *labels), value) for labels, value in found)
            for metric, link_samples in _links(runtime).items():
                samples.setdefault(metric, []).extend(link_samples)
            for metric, counted in _counted(probe.events, probe.refusals).items():
                samples.setdefault(metric, []).extend(((name, label), value) for label, value in counted)
            histograms["gatewayd_package_to_image_seconds"].append(((name,), probe.package_to_image))
            histograms["gatewayd_write_to_package_seconds"].append(((name,), probe.write_to_package))
        for info in METRICS:
            if info.kind is MetricKind.HISTOGRAM:
                yield _histogram(info, histograms[info.name])
            elif samples.get(info.name):
                # What several cells share is reported by each of them, and counts once.
                yield _family(info, dict(samples[info.name]).items())


def _cell(runtime: CellRuntime, now: float) -> dict[str, list[_Sample]]:
    cell = runtime.cell
    health, image = cell.health, cell.image
    state = cell.freshness.state
    up = state is Source.FRESH and cell.accepts_writes
    return {
        "gatewayd_cell_info": [((f"{cell.definition.fingerprint:08X}",), 1)],
        "gatewayd_uptime_seconds": [((), max(0.0, now - health.started))],
        "gatewayd_robot_up": [((), _LEVELS[up])],
        "gatewayd_robot_state": [((source.name.lower(),), _LEVELS[source is state]) for source in Source],
        "gatewayd_robot_package_rate_hertz": [((), health.frequency)],
        "gatewayd_robot_age_seconds": [((), now - cell.freshness.last_progress)],
        "gatewayd_robot_packages_total": [((), health.packages)],
        "gatewayd_robot_packages_skipped_total": [((), health.skipped)],
        "gatewayd_robot_packages_late_total": [((), health.late)],
        "gatewayd_robot_sessions_total": [((), health.sessions)],
        "gatewayd_robot_watchdog_fed": [((), _LEVELS[health.watchdog_fed])],
        "gatewayd_read_back_mismatches_total": [((), health.read_back_mismatches)],
        "gatewayd_lag_seconds": [((), health.lag)],
        "gatewayd_differing": [((), health.differing)],
        "gatewayd_unadopted": [((), health.unadopted)],
        "gatewayd_adoption_seconds": [((), health.adoption)],
        "gatewayd_gaps_total": [((), health.gaps)],
        "gatewayd_variables": [
            ((quality.name.lower(),), image.quality.count(quality)) for quality in Quality
        ],
        "gatewayd_input_age_seconds": [
            ((), now - max((image.times[i] for i in image.inputs), default=-math.inf))
        ],
        "gatewayd_locks": [((), len(cell.ownership.owners))],
        "gatewayd_writes_accepted_total": [((), health.writes_accepted)],
        "gatewayd_writes_refused_total": [((), health.writes_refused)],
        **_owners(cell),
    }


def _owners(cell: Cell) -> dict[str, list[_Sample]]:
    owners = cell.ownership.owners
    names = {index: writer.name for index, writer in enumerate(cell.definition.writers)}
    names |= {owner: cell.definition.writer_name(owner) for owner in owners if owner is not None}
    return {
        "gatewayd_locks_owned": [((name,), owners.count(index)) for index, name in names.items()],
        "gatewayd_writer_up": [
            ((writer.name,), _LEVELS[alive])
            for writer, alive in zip(cell.definition.writers, cell.writers.alive, strict=True)
        ],
    }


def _links(runtime: CellRuntime) -> dict[str, list[_Sample]]:
    found: dict[str, list[_Sample]] = {}
    for name, link in runtime.links.items():
        figures, kind = link.health().figures, kind_of(runtime.plan.links[name].kind)
        for metric in kind.metrics:
            first = str(figures[metric.shared[1]]) if metric.shared else runtime.cell.definition.name
            own_name = () if metric.shared or name == kind.key else (name,)
            value = figures.get(metric.figure)
            samples = found.setdefault(metric.name, [])
            if isinstance(value, Mapping):
                samples += (((first, label, *own_name), number) for label, number in value.items())
            elif isinstance(value, int | float):
                samples.append(((first, *own_name), float(value)))
    return found


def _counted(
    events: Mapping[EventKind, int], refusals: Mapping[Reason, int]
) -> dict[str, list[tuple[str, float]]]:
    return {
        "gatewayd_events_total": [(kind.value, events.get(kind, 0)) for kind in EventKind],
        "gatewayd_refusals_total": [(reason.name.lower(), refusals.get(reason, 0)) for reason in Reason],
    }


def _family(info: MetricInfo, samples: Iterable[_Sample] = ()) -> Metric:
    family: CounterMetricFamily | GaugeMetricFamily | HistogramMetricFamily
    if info.kind is MetricKind.HISTOGRAM:
        return HistogramMetricFamily(info.name, info.meaning, labels=info.labels)
    make = CounterMetricFamily if info.kind is MetricKind.COUNTER else GaugeMetricFamily
    # Samples that have no further value have no such label either.
    family = make(info.name, info.meaning, labels=(*info.labels, LINK_LABEL))
    for labels, value in samples:
        family.add_metric(list(map(printable, labels)), value)
    return family


def _histogram(info: MetricInfo, found: Iterable[tuple[tuple[str, ...], Histogram]]) -> Metric:
    family = HistogramMetricFamily(info.name, info.meaning, labels=info.labels)
    for labels, histogram in found:
        buckets = [
            ("+Inf" if bound == math.inf else f"{bound:g}", count) for bound, count in histogram.buckets()
        ]
        family.add_metric(labels, buckets, histogram.total)
    return family
