"""The examples of "Test your own RTDE software" run as they stand; scenarios of all pages can be played."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from gatewayd.simulator.double import RobotFaults, SimulatedRobot
from gatewayd.simulator.fleet import RobotHost, scenario_robots
from gatewayd.simulator.scenario import parse_scenario
from tests.sources import ROOT

GUIDE = ROOT / "docs/howto/test-your-rtde-software.md"
PAGES = [GUIDE, ROOT / "docs/howto/simulate-faults.md", ROOT / "docs/reference/simulator.md"]


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)


@pytest.mark.slow
def test_the_examples_run(tmp_path: Path) -> None:
    conftest, *tests = blocks(GUIDE, "python")
    (scenario,) = blocks(GUIDE, "toml")
    (tmp_path / "conftest.py").write_text(conftest)
    (tmp_path / "cell.toml").write_text(scenario)
    for number, text in enumerate(tests):
        (tmp_path / f"test_{number}.py").write_text(text)
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "no:asyncio", str(tmp_path)]
    ended = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=100, check=False
    )
    assert "3 passed" in ended.stdout, ended.stdout + ended.stderr


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_scenarios_of_the_pages_can_be_played(page: Path) -> None:
    for text in blocks(page, "toml"):
        assert scenario_robots(parse_scenario(text.encode(), page.name), RobotHost(ports=(0,)))


def test_methods_of_the_table_exist() -> None:
    table = GUIDE.read_text().split("## What the robot can be asked")[1].split("\n## ")[0]
    first = "\n".join(line.split(" | ")[0] for line in table.splitlines() if line.startswith("| "))
    named = set(re.findall(r"`(?:await )?(\w+)", first)) - {"faults"}
    faults = set(re.findall(r"`(?:faults)?\.(\w+)", first))
    attributes = {"host", "port", "robots"}
    assert [name for name in named - attributes if not hasattr(SimulatedRobot, name)] == []
    assert [name for name in faults if not hasattr(RobotFaults, name)] == []
