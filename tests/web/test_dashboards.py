"""docs/grafana.json, grafana-fleet.json and alerts.yaml ask only for what /metrics tells, by labels that it has."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.refusal import Reason
from gatewayd.web.access_control import REFUSALS
from gatewayd.web.metrics import LINK_LABEL, METRICS, PROCESS_METRICS, MetricKind

DOCS = Path(__file__).parents[2] / "docs"
MAPPINGS = (DOCS.parent / "systemd/examples/gatewayd-mappings").read_text()
"""The script that leaves metrics for node_exporter."""
OF_PROMETHEUS = {"instance", "job", "le"}
"""Labels that Prometheus adds, or that a histogram has."""


def _known() -> dict[str, set[str]]:
    found = {"up": set[str](), **{name: set[str]() for name in PROCESS_METRICS}}
    for info in METRICS:
        suffixes = ("_bucket", "_sum", "_count") if info.kind is MetricKind.HISTOGRAM else ("",)
        found |= {info.name + suffix: set(info.labels) for suffix in suffixes}
    for name in re.findall(r"# TYPE (\w+) gauge", MAPPINGS):
        labels = re.search(name + r"\{(.*?)\} ", MAPPINGS)
        found[name] = set(re.findall(r"(\w+)=", labels[1])) if labels else set()
    return found


KNOWN = _known()
ASKED = re.compile(r"\b(gatewayd_\w+|process_\w+|up)\b(?:\{([^}]*)\})?")
VALUES: dict[str, set[str]] = {
    "quality": {one.name.lower() for one in Quality},
    "state": {one.name.lower() for one in Source},
    "reason": {one.name.lower() for one in Reason} | set(REFUSALS),
}


def _texts(value: Any, key: str) -> Iterator[str]:
    if isinstance(value, dict):
        for name, inner in value.items():
            if name == key and isinstance(inner, str):
                yield inner
            yield from _texts(inner, key)
    elif isinstance(value, list):
        for inner in value:
            yield from _texts(inner, key)


DASHBOARDS = {name: json.loads((DOCS / f"{name}.json").read_text()) for name in ("grafana", "grafana-fleet")}
ALERTS = YAML(typ="safe", pure=True).load((DOCS / "alerts.yaml").read_text())
RULES = [rule for group in ALERTS["groups"] for rule in group["rules"]]
EXPRESSIONS = sorted({*_texts(DASHBOARDS, "expr"), *(rule["expr"] for rule in RULES)})


@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_an_expression_asks_for_what_there_is(expression: str) -> None:
    asked = list(ASKED.finditer(expression))
    assert asked
    labels: set[str] = set(OF_PROMETHEUS)
    for found in asked:
        assert found[1] in KNOWN, f"{found[1]} is no metric"
        labels |= KNOWN[found[1]]
        for name, value in re.findall(r'(\w+)(?:=~|!~|!=|=)"([^"]*)"', found[2] or ""):
            assert name in KNOWN[found[1]] | OF_PROMETHEUS, f"{found[1]} has no label {name}"
            assert value.startswith("$") or name not in VALUES or value in VALUES[name]
    for names in re.findall(r"\b(?:by|on) \(([^)]*)\)", expression):
        assert {name.strip() for name in names.split(",")} <= labels
    assert expression.count("(") == expression.count(")")


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule["alert"])
def test_an_alert_says_where_it_is_and_how_bad(rule: dict[str, Any]) -> None:
    assert rule["labels"]["severity"] in {"page", "ticket"}
    asked = {found[1] for found in ASKED.finditer(rule["expr"])}
    there = OF_PROMETHEUS.union(*(KNOWN[name] for name in asked))
    if any(name.startswith("gatewayd_device_") for name in asked):
        there |= {LINK_LABEL}  # a device is a link that is not named as its kind
    shown = set(re.findall(r"\$labels\.(\w+)", rule["annotations"]["summary"]))
    assert shown <= there
    assert shown or "$value" in rule["annotations"]["summary"]


def test_legends_use_labels_that_exist() -> None:
    labels = OF_PROMETHEUS.union(*KNOWN.values(), {LINK_LABEL})  # of devices
    for legend in _texts(DASHBOARDS, "legendFormat"):
        assert set(re.findall(r"\{\{(\w+)\}\}", legend)) <= labels


@pytest.mark.parametrize("name", DASHBOARDS)
def test_panels_lie_side_by_side(name: str) -> None:
    places: set[tuple[int, int]] = set()
    assert len({panel["id"] for panel in DASHBOARDS[name]["panels"]}) == len(DASHBOARDS[name]["panels"])
    for panel in DASHBOARDS[name]["panels"]:
        at = panel["gridPos"]
        cells = {(x, y) for x in range(at["x"], at["x"] + at["w"]) for y in range(at["y"], at["y"] + at["h"])}
        assert at["x"] + at["w"] <= 24
        assert not cells & places, panel["title"]
        places |= cells


def test_every_metric_of_the_cells_is_looked_at_or_named_here() -> None:
    """A metric that neither dashboard nor alerts use has a reason."""
    used = {found[1] for text in EXPRESSIONS for found in ASKED.finditer(text)}
    looked_at = {
        info.name for info in METRICS if used & {info.name, f"{info.name}_bucket", f"{info.name}_count"}
    }
    assert {info.name for info in METRICS} - looked_at == {
        "gatewayd_uptime_seconds",
        "gatewayd_robot_state",  # robot_up and the status page say it in words
        "gatewayd_robot_packages_total",  # package_rate says it
        "gatewayd_robot_watchdog_fed",  # only with a watchdog in the mapping
        "gatewayd_modbus_refused_connections_total",  # the log names the peers
        "gatewayd_modbus_ignored_total",  # only with `write_gaps: ignore`, and constant in kind
        "gatewayd_dashboard_up",  # the state `connected` and the page say it
        "gatewayd_dashboard_connections_total",
        "gatewayd_dashboard_commands_total",
        "gatewayd_dashboard_refused_total",  # the event says which, and why
        "gatewayd_device_answers_total",
        "gatewayd_device_losses_total",  # device_up says when it matters
        "gatewayd_input_age_seconds",
        "gatewayd_adoption_seconds",  # for seconds after a start; the status page says it
        "gatewayd_locks",
        "gatewayd_writes_refused_total",  # refusals_total has the reasons
    }
