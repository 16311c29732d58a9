"""`gatewayd events`: the last, the audit, and a pipe that sees what happens at once."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

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
