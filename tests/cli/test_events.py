"""`gatewayd events`: the last, the audit, and a pipe that sees what happens at once."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from datetime import UTC, datetime

import pytest

from gatewayd.cli.events import EventFilter, PointInTime
from gatewayd.core.admission import Change
from gatewayd.core.requester import Requester
from tests.cli.conftest import Invoke, Running
from tests.control.served import LIMIT

PLC, HMI = 0, 1


def test_the_last_ones_in_words(gateway: Running, invoke: Invoke) -> None:
    gateway.do(lambda cell: cell.write(Requester(PLC), [Change(LIMIT, 1.0)], 1.0))
    gateway.do(lambda cell: cell.write(Requester(PLC), [Change(LIMIT, 999.0)], 1.1))
    lines = invoke("events", "--limit", "2").output.splitlines()
    assert [line.split("press  ")[1] for line in lines] == [
        "plc took limit",
        "plc wrote limit = 999 N: refused, value out of limits, 0..150",
    ]


def test_the_audit(gateway: Running, invoke: Invoke) -> None:
    gateway.do(lambda cell: cell.write(Requester(PLC), [Change(LIMIT, 1.5)], 1.0))
    assert "plc wrote limit: 0 -> 1.5 N\n" in invoke("events", "--audit").output
    assert invoke("events", "--audit", "--follow").exit_code == 2


@pytest.mark.usefixtures("gateway")
def test_json_is_one_object_per_line(invoke: Invoke) -> None:
    lines = invoke("events", "--json").output.splitlines()
    assert [json.loads(line)["event"] for line in lines] == [
        "robot connected",
        "inputs adopted",
        "robot values fresh",
    ]


@pytest.mark.usefixtures("gateway")
def test_each_has_the_time_that_the_log_has(invoke: Invoke) -> None:
    """Date, milliseconds and zone, as `gatewayd.logs.records` writes them."""
    (line,) = invoke("events", "-n", "1").output.splitlines()
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z press  robot values fresh.*", line)
    assert re.search(r"^  \d{4}-\d\d-\d\dT\S+Z robot values fresh", invoke("status").output, re.MULTILINE)


def test_only_what_is_asked_for(gateway: Running, invoke: Invoke) -> None:
    gateway.do(lambda cell: cell.write(Requester(PLC), [Change(LIMIT, 1.0)], 1.0))
    gateway.do(lambda cell: cell.write(Requester(PLC), [Change(LIMIT, 999.0)], 1.1))

    def texts(*options: str) -> list[str]:
        return [line.split("press  ")[1] for line in invoke("events", *options).output.splitlines()]

    refused = "plc wrote limit = 999 N: refused, value out of limits, 0..150"
    assert texts("--kind", "refused") == [refused]
    assert texts("--kind", "Refused", "--kind", "acquired") == ["plc took limit", refused]
    assert texts("--variable", "lim*") == texts("--variable", "limit") == [refused]
    assert texts("--variable", "lim") == []
    assert texts("--kind", "acquired", "--variable", "limit") == []
    assert texts("-n", "1", "--kind", "robot") == ["robot values fresh"]
    assert texts("-n", "0", "--kind", "robot") == []
    assert texts("--audit", "--kind", "accepted", "--variable", "limit") == ["plc wrote limit: 0 -> 1 N"]
    assert texts("--audit", "--variable", "start") == []


@pytest.mark.usefixtures("gateway")
def test_only_what_happened_since_then(invoke: Invoke) -> None:
    every = invoke("events").output
    assert invoke("events", "--since", "2001-01-01").output == every
    assert invoke("events", "--since", "2101-01-01T00:00+02:00").output == ""
    stamp = every.splitlines()[-1].split()[0]
    assert stamp in invoke("events", "--since", stamp).output


@pytest.mark.usefixtures("gateway")
@pytest.mark.parametrize("options", [("--since", "yesterday"), ("--since", "0s"), ("--kind", "nonsense")])
def test_what_cannot_be_asked_for(invoke: Invoke, options: tuple[str, ...]) -> None:
    done = invoke("events", *options)
    assert done.exit_code == 2
    assert ("10min" if "--since" in options else "robot lost") in done.stderr


def test_elements_of_ranges_are_names() -> None:
    event = {"time": "2027-01-15T08:00:05.120Z", "event": "write refused", "variable": "recipe[1]"}
    assert event in EventFilter(variables=("recipe[1]",))
    assert event in EventFilter(variables=("recipe[*]",))
    assert event not in EventFilter(variables=("recipe1",))


def test_how_long_ago() -> None:
    moment = PointInTime().convert("10min", None, None)
    assert abs((datetime.now(UTC) - moment).total_seconds() - 600) < 60


def test_following_what_is_asked_for(gateway: Running) -> None:
    command = [sys.executable, "-m", "gatewayd", "events", "--follow", "--json", "-n", "1", "--kind", "robot"]
    environ = {**os.environ, "GATEWAYD_CONTROL": str(gateway.path)}
    gateway.do(lambda cell: cell.write(Requester(PLC), [Change(LIMIT, 1.0)], 1.0))
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environ) as following:
        assert following.stdout is not None
        assert json.loads(following.stdout.readline())["event"] == "robot values fresh"
        gateway.do(lambda cell: cell.write(Requester(PLC), [Change(LIMIT, 999.0)], 1.0))
        gateway.do(lambda cell: cell.robot_lost("gone", 1.0))
        assert json.loads(following.stdout.readline())["event"] == "robot lost"
        following.terminate()


def test_following_through_a_pipe(gateway: Running) -> None:
    command = [sys.executable, "-m", "gatewayd", "events", "--follow", "--json", "-n", "1"]
    environ = {**os.environ, "GATEWAYD_CONTROL": str(gateway.path)}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environ
    ) as following:
        assert following.stdout is not None
        assert json.loads(following.stdout.readline())["event"] == "robot values fresh"
        gateway.do(lambda cell: cell.robot_lost("gone", 1.0))
        assert json.loads(following.stdout.readline())["event"] == "robot lost"
        following.terminate()
