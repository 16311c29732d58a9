"""Prometheus' own tool judges the alert rules, when they fire, the guide's configuration and what a gateway serves."""

from __future__ import annotations

import re
import shutil
import subprocess
import urllib.request
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from gatewayd.web.metrics import METRICS
from tests.e2e.plant import Plant
from tests.e2e.plc import PLC
from tests.e2e.processes import HOST, free_port, wait_for
from tests.e2e.test_devices import Island

PROMTOOL = shutil.which("promtool")
DOCS = Path(__file__).parents[2] / "docs"
ALERTS = DOCS / "alerts.yaml"
UNIT_TESTS = (Path(__file__).parent / "alerts_test.yaml", DOCS.parent / "tests/fleet/alerts_test.yaml")
MAPPING = """\
canopen: {interface: virtual, channel: promtool, bitrate: 500000, node: 16}
mqtt: {host: BROKER_HOST, port: BROKER_PORT, topic: press}
devices:
  island: {modbus: "ISLAND", watchdog: none, poll: 20ms, identify: true}
writers:
  plc: {modbus: 127.0.0.2}
  island: {device: island}
variables:
  made:   {robot: input_int_register_0, device: {holding: 0, type: int32}, owner: island}
  play:   {dashboard: play, modbus: {coil: 40}, owner: plc}
  start:  {robot: input_bit_register_0, modbus: 0.0, canopen: object, owner: plc}
  cycles: {robot: output_int_register_0, modbus: 110, canopen: auto}
"""

with_promtool = pytest.mark.skipif(
    PROMTOOL is None, reason="promtool is not installed (Debian package prometheus)"
)


def promtool(*arguments: str | Path, text: str = "") -> str:
    """What it says; it has to be content."""
    assert PROMTOOL is not None
    done = subprocess.run(
        [PROMTOOL, *arguments], input=text, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@with_promtool
def test_the_rules_are_valid() -> None:
    assert "SUCCESS" in promtool("check", "rules", ALERTS)


@with_promtool
def test_each_rule_fires_when_it_should_and_only_then() -> None:
    assert "SUCCESS" in promtool("test", "rules", *UNIT_TESTS)


def test_the_unit_tests_have_each_rule_firing_and_silent() -> None:
    yaml = YAML(typ="safe", pure=True)
    rules = [rule for group in yaml.load(ALERTS.read_text())["groups"] for rule in group["rules"]]
    firing, silent = set[str](), set[str]()
    for test in (test for path in UNIT_TESTS for test in yaml.load(path.read_text())["tests"]):
        for case in test["alert_rule_test"]:
            (firing if case["exp_alerts"] else silent).add(case["alertname"])
    assert firing == silent == {rule["alert"] for rule in rules}


@with_promtool
@pytest.mark.parametrize("page", ["status-page", "beyond-loopback"])
def test_the_configuration_of_the_guide_loads_the_rules(tmp_path: Path, page: str) -> None:
    guide = (DOCS / "howto" / f"{page}.md").read_text()
    found = re.search(r"^```yaml\n(scrape_configs:.*?)^```", guide, re.MULTILINE | re.DOTALL)
    assert found
    shutil.copy(ALERTS, tmp_path)
    for name in ("gatewayd-token", "plant-authority.pem"):
        (tmp_path / name).write_text("")
    (tmp_path / "prometheus.yml").write_text(found[1].replace("/etc/prometheus", str(tmp_path)))
    assert "1 rule files found" in promtool("check", "config", tmp_path / "prometheus.yml")


@with_promtool
def test_what_a_gateway_serves_follows_the_conventions(plant: Plant) -> None:
    """With both buses, a device, a broker and the dashboard server every metric is there; the linter says nothing."""
    port, island, dashboard = free_port(), free_port(), free_port()
    simulator = plant.simulator("--dashboard", str(dashboard))
    plant.add(Island(plant.directory / "island.log", island))
    text = MAPPING.replace("ISLAND", f"{HOST}:{island}")
    # A broker that is not there has metrics, too.
    text = text.replace("BROKER_HOST", HOST).replace("BROKER_PORT", str(free_port()))
    mapping = plant.mapping(
        text, simulator.port, robot_options=f", series: e, dashboard: {{port: {dashboard}}}"
    )
    daemon = plant.daemon(mapping, "--status", f"{HOST}:{port}")
    daemon.wait_for_line("status page")

    wait_for(lambda: not plant.plc(PLC).write_coils(40, [True]), "a command to be taken, which does not act")

    def missing() -> list[str]:
        with urllib.request.urlopen(f"http://{HOST}:{port}/metrics", timeout=10) as response:
            served = response.read().decode()
        assert promtool("check", "metrics", text=served) == ""
        # tests/web/test_metrics.py has those of tokens and certificates; the others need a listener with TLS, a pair of
        # gateways, and a broker that somebody commands by.
        elsewhere = re.compile(
            r".*_expiry_timestamp_seconds|gatewayd_(modbus_tls|standby)_.*|gatewayd_mqtt_refused_total"
        )
        shown = [info for info in METRICS if not elsewhere.fullmatch(info.name)]
        return [info.name for info in shown if f"\n# TYPE {info.name} " not in f"\n{served}"]

    wait_for(lambda: missing() == [], "every metric")
