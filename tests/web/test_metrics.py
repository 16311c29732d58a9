"""The Prometheus text: complete, parsable by prometheus-client's own parser, and right."""

from __future__ import annotations

import dataclasses
import math
import time
from pathlib import Path

import pytest
from prometheus_client.parser import text_string_to_metric_families

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Link, LinkHealth
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import LinkPlan
from gatewayd.service.cell_runtime import CellRuntime
from gatewayd.service.daemon import Daemon
from gatewayd.web.access_control import AccessControl
from gatewayd.web.metrics import METRICS, PROCESS_METRICS, Exposition, MetricKind
from gatewayd.web.probes import Probes
from gatewayd.web.settings import settings
from tests.machine.authority import OPENSSL, Authority
from tests.web.press import MAPPING
from tests.works import finished

Samples = dict[str, dict[tuple[tuple[str, str], ...], float]]

ONLY_WITH_CAN = {"gatewayd_can_bus_state", "gatewayd_can_total"}
ONLY_WITH_DEVICES = {
    info.name for info in METRICS if info.name.startswith(("gatewayd_device_", "gatewayd_dashboard_"))
}

ONLY_WITH_TLS = {"gatewayd_listener_certificate_expiry_timestamp_seconds"}
ONLY_WITH_LINKS = {
    info.name for info in METRICS if info.name.startswith(("gatewayd_mqtt_", "gatewayd_modbus_tls_"))
}
ONLY_WITH_STANDBY = {info.name for info in METRICS if info.name.startswith("gatewayd_standby_")}


def read(probes: Probes, access: AccessControl | None = None) -> Samples:
    found: Samples = {}
    text = finished(Exposition(probes, "1.2.3", access).text()).decode()
    for family in text_string_to_metric_families(text):
        for sample in family.samples:
            found.setdefault(sample.name, {})[tuple(sorted(sample.labels.items()))] = sample.value
    return found


def one(samples: Samples, name: str, **labels: str) -> float:
    return samples[name][tuple(sorted(labels.items()))]


def test_everything_that_is_listed_is_told_and_nothing_else(probes: Probes, access: AccessControl) -> None:
    names = set()
    for info in METRICS:
        names |= (
            {f"{info.name}{suffix}" for suffix in ("_bucket", "_sum", "_count")}
            if info.kind is MetricKind.HISTOGRAM
            else {info.name}
        )
    always = names - ONLY_WITH_CAN - ONLY_WITH_DEVICES - ONLY_WITH_TLS - ONLY_WITH_STANDBY - ONLY_WITH_LINKS
    assert set(read(probes, access)) == always | set(PROCESS_METRICS)


@pytest.mark.skipif(OPENSSL is None, reason="openssl is not installed")
def test_when_tokens_and_certificate_end(probes: Probes, token_file: Path, tmp_path: Path) -> None:
    certificate, key = Authority(tmp_path).issue("gateway", days=90)
    access = AccessControl(settings("127.0.0.1:0", token_file, certificate, key))
    access.refresh()
    access.refused["wrong_token"] += 3
    samples = read(probes, access)
    assert one(samples, "gatewayd_listener_refusals_total", reason="wrong_token") == 3
    assert one(samples, "gatewayd_listener_refusals_total", reason="host") == 0
    end = one(samples, "gatewayd_token_expiry_timestamp_seconds", token="anna")  # noqa: S106 - its name
    assert 3500 < end - time.time() <= 3600
    (name,) = ONLY_WITH_TLS
    assert 89 < (one(samples, name) - time.time()) / 86400 <= 90


def test_labels_are_those_that_are_listed(probes: Probes, access: AccessControl) -> None:
    samples = read(probes, access)
    for info in METRICS:
        name = f"{info.name}_count" if info.kind is MetricKind.HISTOGRAM else info.name
        for labels in samples.get(name, {}):
            assert {label for label, _ in labels} == set(info.labels), info.name


@pytest.mark.parametrize("info", METRICS, ids=lambda info: info.name)
def test_names_follow_the_conventions_of_prometheus(info: object) -> None:
    assert dataclasses.is_dataclass(info)
    name, kind = getattr(info, "name", ""), getattr(info, "kind", None)
    assert name.startswith("gatewayd_")
    assert name.endswith("_total") == (kind is MetricKind.COUNTER)
    assert (kind is MetricKind.HISTOGRAM) <= name.endswith("_seconds")


def test_values_are_those_of_the_cell(probes: Probes, cell: Cell) -> None:
    probes.of(cell).package_to_image.observe(0.000_2)
    samples = read(probes)
    assert one(samples, "gatewayd_robot_up", cell="press") == 1
    assert one(samples, "gatewayd_robot_state", cell="press", state="fresh") == 1
    assert one(samples, "gatewayd_robot_state", cell="press", state="lost") == 0
    assert one(samples, "gatewayd_locks_owned", cell="press", writer="plc") == 2
    assert one(samples, "gatewayd_locks", cell="press") == 3
    assert one(samples, "gatewayd_writer_up", cell="press", writer="line") == 0
    assert one(samples, "gatewayd_refusals_total", cell="press", reason="not_writable") == 1
    assert one(samples, "gatewayd_events_total", cell="press", kind="lock acquired") == 2
    assert one(samples, "gatewayd_variables", cell="press", quality="unavailable") == 1
    assert one(samples, "gatewayd_modbus_up", listener="127.0.0.1:15020") == 0
    assert one(samples, "gatewayd_package_to_image_seconds_bucket", cell="press", le="0.0002") == 1
    assert one(samples, "gatewayd_package_to_image_seconds_bucket", cell="press", le="+Inf") == 1
    assert one(samples, "gatewayd_info", version="1.2.3") == 1
    assert one(samples, "process_resident_memory_bytes") > 1e6


def test_a_lost_robot_ages(probes: Probes, cell: Cell) -> None:
    cell.robot_lost("cable", time.monotonic())
    samples = read(probes)
    assert one(samples, "gatewayd_robot_up", cell="press") == 0
    assert 0 < one(samples, "gatewayd_robot_age_seconds", cell="press") < 60
    assert one(samples, "gatewayd_ready") == 0


def test_what_never_came_is_infinitely_old(probes: Probes, runtime: CellRuntime) -> None:
    runtime.cell = Cell(runtime.cell.definition)
    probes.look(time.monotonic())
    assert one(read(probes), "gatewayd_robot_age_seconds", cell="press") == math.inf


def test_the_local_operator_owns_under_a_name(probes: Probes, cell: Cell) -> None:
    cell.operator.take_lock(2, time.monotonic())
    assert one(read(probes), "gatewayd_locks_owned", cell="press", writer="operator") == 1


def test_counters_of_a_can_node_are_told_by_name(probes: Probes, runtime: CellRuntime) -> None:
    class NodePlan(LinkPlan):
        kind = "canopen"

    class Node(Link):
        def health(self) -> LinkHealth:
            return LinkHealth(figures={"bus_state": 6, "counters": {"received": 5, "overruns": 1}})

    runtime.plan = runtime.plan.with_links(canopen=NodePlan())
    runtime.links["canopen"] = Node()
    samples = read(probes)
    assert one(samples, "gatewayd_can_total", cell="press", counter="received") == 5
    assert one(samples, "gatewayd_can_bus_state", cell="press") == 6


def test_a_listener_that_cells_share_is_told_once(tmp_path: Path) -> None:
    files = (MAPPING, MAPPING.replace("cell: press", "cell: welder").replace("unit: 1", "unit: 2"))
    plans = [load(text.encode(), "a.yaml").plan for text in files]
    daemon = Daemon([plan for plan in plans if plan is not None], tmp_path)
    assert len(daemon.runtimes) == 2
    text = finished(Exposition(Probes(daemon), "1").text()).decode()
    assert text.count("gatewayd_modbus_up{") == 1


def test_troubles_are_counted(daemon: Daemon) -> None:
    """The listener of a daemon that does not run does not listen."""
    assert one(read(Probes(daemon)), "gatewayd_troubles") == 1
    assert one(read(Probes(daemon, lambda: ["1 mapping file not served"])), "gatewayd_troubles") == 2


def test_what_the_robot_holds_how_late_it_is_and_gaps(probes: Probes, cell: Cell) -> None:
    health = cell.health
    health.lag, health.differing, health.unadopted, health.adoption, health.gaps = 0.25, 1, 2, 8.0, 3
    text = finished(Exposition(probes, "1").text()).decode()
    for line in (
        'gatewayd_lag_seconds{cell="press"} 0.25',
        'gatewayd_differing{cell="press"} 1.0',
        'gatewayd_unadopted{cell="press"} 2.0',
        'gatewayd_adoption_seconds{cell="press"} 8.0',
        'gatewayd_gaps_total{cell="press"} 3.0',
        'gatewayd_robot_state{cell="press",state="late"} 0.0',
        'gatewayd_variables{cell="press",quality="not_running"} 0.0',
    ):
        assert line in text.splitlines()
