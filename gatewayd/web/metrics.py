"""The Prometheus view: every number the cells and the probes keep, read when it is asked for. All that is known of
prometheus-client is here.

`METRICS` is the list of what there is; docs/reference/metrics.md, the dashboard and the alert rules are held to it.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from prometheus_client import CollectorRegistry, ProcessCollector, generate_latest
from prometheus_client.core import HistogramMetricFamily, Metric
from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily

from gatewayd.core.cell import Cell
from gatewayd.core.events import EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.refusal import Reason
from gatewayd.links.registry import kind_of, kinds
from gatewayd.loop import clock
from gatewayd.report.printable import printable
from gatewayd.service.cell_runtime import CellRuntime
from gatewayd.web.access_control import AccessControl
from gatewayd.web.histogram import Histogram
from gatewayd.web.probes import CellProbe, Probes

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


_TIMES = MetricKind.HISTOGRAM


def _info(name: str, meaning: str, *labels: str, kind: MetricKind | None = None) -> MetricInfo:
    by_name = MetricKind.COUNTER if name.endswith("_total") else MetricKind.GAUGE
    return MetricInfo(name, kind or by_name, labels, meaning)


class _Moment:
    """A cell that is served, and what was measured of it, at one moment."""

    def __init__(self, cell: Cell, probe: CellProbe, now: float) -> None:
        self.cell, self.health, self.probe, self.now = cell, cell.health, probe, now

    def is_up(self) -> bool:
        """Whether the robot's values are fresh and its inputs can be written."""
        return self.cell.freshness.state is Source.FRESH and self.cell.accepts_writes

    def input_age(self) -> float:
        """Seconds since any input was written."""
        image = self.cell.image
        return self.now - max((image.times[index] for index in image.inputs), default=-math.inf)

    def locks_owned(self) -> dict[str, float]:
        """By each writer, and by the local operator if it owns any."""
        definition, owners = self.cell.definition, self.cell.ownership.owners
        writers = dict.fromkeys((*range(len(definition.writers)), *owners))
        return {definition.writer_name(index): owners.count(index) for index in writers if index is not None}

    def writers_up(self) -> dict[str, float]:
        """By writer."""
        writers = self.cell.definition.writers
        return {writer.name: up for writer, up in zip(writers, self.cell.writers.alive, strict=True)}


_Value = float | Mapping[str, float]
"""A number, or numbers by the value of a further label."""


class _OfCell(NamedTuple):
    """A gauge or counter that each cell has."""

    name: str
    meaning: str
    read: Callable[[_Moment], _Value]
    label: str = ""
    """The further label, if there is one."""


_OF_CELLS = (
    _OfCell("gatewayd_cell_info", "1, with the fingerprint of the mapping",
        lambda at: {f"{at.cell.definition.fingerprint:08X}": 1}, "fingerprint"),
    _OfCell("gatewayd_uptime_seconds", "seconds since the cell was first served",
        lambda at: max(0.0, at.now - at.health.started)),
    _OfCell("gatewayd_robot_up", "1 while the robot's values are fresh and its inputs can be written",
        _Moment.is_up),
    _OfCell("gatewayd_robot_state", "1 for the state the robot is in, 0 for all others",
        lambda at: {state.name.lower(): state is at.cell.freshness.state for state in Source}, "state"),
    _OfCell("gatewayd_robot_package_rate_hertz", "packages per second, measured",
        lambda at: at.health.frequency),
    _OfCell("gatewayd_robot_age_seconds", "seconds since the robot last reported anything new; +Inf: never",
        lambda at: at.now - at.cell.freshness.last_progress),
    _OfCell("gatewayd_robot_packages_total", "packages received", lambda at: at.health.packages),
    _OfCell("gatewayd_robot_packages_skipped_total", "packages the controller left out",
        lambda at: at.health.skipped),
    _OfCell("gatewayd_robot_packages_late_total", "packages that came late", lambda at: at.health.late),
    _OfCell("gatewayd_robot_sessions_total", "sessions with the controller; the first is not a reconnect",
        lambda at: at.health.sessions),
    _OfCell("gatewayd_robot_watchdog_fed", "1 while the robot's watchdog is fed",
        lambda at: at.health.watchdog_fed),
    _OfCell("gatewayd_read_back_mismatches_total", "inputs whose read-back differed from what was written",
        lambda at: at.health.read_back_mismatches),
    _OfCell("gatewayd_lag_seconds",
        "by how much the newest package of the robot is later than the quickest ones were; part of every age",
        lambda at: at.health.lag),
    _OfCell("gatewayd_differing", "inputs for which the robot holds something else than it was given",
        lambda at: at.health.differing),
    _OfCell("gatewayd_unadopted", "inputs whose content in the robot is not known",
        lambda at: at.health.unadopted),
    _OfCell("gatewayd_adoption_seconds",
        "seconds until adopted inputs without an owner fall back; 0: none will",
        lambda at: at.health.adoption),
    _OfCell("gatewayd_gaps_total", "times the gateway stood still: stopped, suspended or starved of the CPU",
        lambda at: at.health.gaps),
    _OfCell("gatewayd_variables", "variables by quality",
        lambda at: {quality.name.lower(): at.cell.image.quality.count(quality) for quality in Quality},
        "quality"),
    _OfCell("gatewayd_input_age_seconds", "seconds since any input was last written; +Inf: never",
        _Moment.input_age),
    _OfCell("gatewayd_locks", "locks, owned or not", lambda at: len(at.cell.ownership.owners)),
    _OfCell("gatewayd_locks_owned", "locks that the writer owns; `operator` is the local operator",
        _Moment.locks_owned, "writer"),
    _OfCell("gatewayd_writer_up", "1 while the writer is connected and heard in time",
        _Moment.writers_up, "writer"),
    _OfCell("gatewayd_writes_accepted_total", "write requests applied", lambda at: at.health.writes_accepted),
    _OfCell("gatewayd_writes_refused_total", "requests refused", lambda at: at.health.writes_refused),
    _OfCell("gatewayd_refusals_total",
        "requests refused by reason; equal ones are added every 10 s, so it may lag behind the total",
        lambda at: {reason.name.lower(): at.probe.refusals[reason] for reason in Reason}, "reason"),
    _OfCell("gatewayd_unserved_total", "requests that nothing here serves, by reason",
        lambda at: {reason.name.lower(): count for reason, count in at.health.unserved.items()}, "reason"),
    _OfCell("gatewayd_events_total", "events by kind",
        lambda at: {kind.value: at.probe.events[kind] for kind in EventKind}, "kind"),
)  # fmt: skip
METRICS = (
    _info("gatewayd_info", "1, with the version of the gateway", "version"),
    _info("gatewayd_ready", "1 while every cell is served, as /readyz reports it"),
    _info("gatewayd_parts_hanging", "parts of the gateway that make no progress; /healthz names them"),
    _info(
        "gatewayd_troubles",
        "problems that belong to no single cell, such as a mapping not served or a reload refused; /readyz names them",
    ),
    _info("gatewayd_listener_refusals_total", "what the status listener refused, by reason", "reason"),
    _info("gatewayd_token_expiry_timestamp_seconds", "when the token ends, seconds since 1970", "token"),
    _info(
        "gatewayd_listener_certificate_expiry_timestamp_seconds",
        "when the certificate of the status listener ends, seconds since 1970",
    ),
    _info(
        "gatewayd_loop_lag_seconds", "by how much the event loop was late, ten times a second", kind=_TIMES
    ),
    *(_info(metric.name, metric.meaning, "cell", *filter(None, [metric.label])) for metric in _OF_CELLS),
    *(_info(metric.name, metric.meaning, *metric.labels) for kind in kinds() for metric in kind.metrics),
    _info(
        "gatewayd_package_to_image_seconds",
        "from the arrival of a robot's package to the moment when every fieldbus can be given its values",
        "cell",
        kind=_TIMES,
    ),
    _info(
        "gatewayd_write_to_package_seconds",
        "from the arrival of a write to the package with it to the robot, its wait for the control cycle included",
        "cell",
        kind=_TIMES,
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
"""What prometheus-client reports of the process itself."""

LINK_LABEL = "link"
"""Behind all others, the name of a link that is not called as its kind: a cell may have several of that."""
_Samples = dict[tuple[str, ...], float]
"""Values of labels -> value."""
_SamplesOf = defaultdict[str, _Samples]
_HistogramsOf = defaultdict[str, dict[tuple[str, ...], Histogram]]


class Exposition:
    """Makes the text that Prometheus reads."""

    def __init__(self, probes: Probes, version: str, access: AccessControl | None = None) -> None:
        self._probes = probes
        self._version = version
        self._access = access
        self._process = ProcessCollector(registry=None)

    def text(self) -> Generator[None, None, bytes]:
        """Everything at this moment, in `CONTENT_TYPE`; it pauses after each cell and each metric."""
        samples, histograms = yield from self._read(clock.now())
        found = []
        for info in METRICS:
            if info.kind is MetricKind.HISTOGRAM:
                found.append(_lines(_histogram(info, histograms[info.name])))
            elif samples[info.name]:
                found.append(_lines(_family(info, samples[info.name])))
            yield
        return b"".join((*found, *map(_lines, self._process.collect())))

    def _read(self, now: float) -> Generator[None, None, tuple[_SamplesOf, _HistogramsOf]]:
        daemon, probes = self._probes.daemon, self._probes
        troubles = probes.troubles()
        ready, _ = probes.readiness(now)
        samples: _SamplesOf = defaultdict(dict)
        samples["gatewayd_info"] = {(self._version,): 1}
        samples["gatewayd_ready"] = {(): ready}
        samples["gatewayd_parts_hanging"] = {(): len(probes.late)}
        samples["gatewayd_troubles"] = {(): len(troubles)}
        if self._access is not None:
            samples |= _of_access(self._access)
        histograms: _HistogramsOf = defaultdict(dict)
        histograms["gatewayd_loop_lag_seconds"] = {(): probes.lag}
        for runtime in daemon.runtimes:
            yield
            name, probe = runtime.cell.definition.name, probes.of(runtime.cell)
            moment = _Moment(runtime.cell, probe, now)
            for metric in _OF_CELLS:
                samples[metric.name] |= _samples(name, metric.read(moment))
            # What several cells share is reported by each of them, and counts once.
            for link_metric, found in _links(runtime):
                samples[link_metric] |= found
            histograms["gatewayd_package_to_image_seconds"][name,] = probe.package_to_image
            histograms["gatewayd_write_to_package_seconds"][name,] = probe.write_to_package
        return samples, histograms


class _Alone(CollectorRegistry):
    """A registry of one metric: the library writes what a registry has in one go."""

    def __init__(self, metric: Metric) -> None:
        super().__init__(auto_describe=False)
        self._metric = metric

    def collect(self) -> Iterator[Metric]:
        yield self._metric


def _lines(metric: Metric) -> bytes:
    return generate_latest(_Alone(metric))


def _of_access(access: AccessControl) -> _SamplesOf:
    found: _SamplesOf = defaultdict(dict)
    found["gatewayd_listener_refusals_total"] = {(reason,): count for reason, count in access.refused.items()}
    if access.credentials is not None:
        ends: _Samples = {(token.name,): token.expires for token in access.credentials.tokens.tokens}
        found["gatewayd_token_expiry_timestamp_seconds"] = ends
    if access.identity is not None and access.identity.chain:
        end = access.identity.chain[0].not_after
        found["gatewayd_listener_certificate_expiry_timestamp_seconds"] = {(): end}
    return found


def _samples(first: str, value: _Value, *last: str) -> _Samples:
    if isinstance(value, Mapping):
        return {(first, label, *last): number for label, number in value.items()}
    return {(first, *last): value}


def _links(runtime: CellRuntime) -> Iterator[tuple[str, _Samples]]:
    for name, link in runtime.links.items():
        figures, kind = link.health().figures, kind_of(runtime.plan.links[name].kind)
        for metric in kind.metrics:
            first = str(figures[metric.shared[1]]) if metric.shared else runtime.cell.definition.name
            own_name = () if metric.shared or name == kind.key else (name,)
            value = figures.get(metric.figure)
            if isinstance(value, Mapping | int | float):
                yield metric.name, _samples(first, value, *own_name)


def _family(info: MetricInfo, samples: _Samples) -> Metric:
    make = CounterMetricFamily if info.kind is MetricKind.COUNTER else GaugeMetricFamily
    # Samples that have no further value have no such label either.
    labels = (*info.labels, LINK_LABEL)
    family: CounterMetricFamily | GaugeMetricFamily = make(info.name, info.meaning, labels=labels)
    for values, value in samples.items():
        family.add_metric(list(map(printable, values)), value)
    return family


def _histogram(info: MetricInfo, found: Mapping[tuple[str, ...], Histogram]) -> Metric:
    family = HistogramMetricFamily(info.name, info.meaning, labels=info.labels)
    for labels, histogram in found.items():
        buckets = [
            ("+Inf" if bound == math.inf else f"{bound:g}", count) for bound, count in histogram.buckets()
        ]
        family.add_metric(labels, buckets, histogram.total)
    return family
