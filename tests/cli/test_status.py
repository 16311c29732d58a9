"""`gatewayd status`: a summary that a human understands, and exit codes that a script does."""

from __future__ import annotations

import json

import pytest

from gatewayd.core.cell import Change
from gatewayd.core.requester import Requester
from tests.cli.conftest import Invoke, Running
from tests.control.served import CYCLES, LIMIT, SPEED

PLC, HMI = 0, 1


def test_a_healthy_gateway(gateway: Running, invoke: Invoke) -> None:
    gateway.do(lambda cell: cell.write(Requester(PLC), [Change(SPEED, 0.5)], 1.0))
    done = invoke("status")
    assert done.exit_code == 0
    for words in (
        "is healthy", "press  press.yaml, mapping", "192.168.1.10:30004 fresh", "127.0.0.1:1502 unit 1",
        "plc there", "owns 1 of 3 locks", "hmi has not come yet", "12, all good", "motion: plc",
        "1 accepted, 0 refused", "plc took motion",
    ):  # fmt: skip
        assert words in done.output


def test_a_degraded_one_says_why(gateway: Running, invoke: Invoke) -> None:
    gateway.do(lambda cell: cell.robot_lost("gone", 1.0))
    gateway.do(lambda cell: cell.write(Requester(HMI), [Change(LIMIT, 1.0)], 1.0))
    done = invoke("status")
    assert done.exit_code == 1
    assert "is degraded" in done.output
    assert "! press: robot not connected for" in done.output
    assert "hmi wrote limit: refused, never writable by this writer" in done.output
    assert "12: 0 good, 12 stale" in done.output


def test_what_is_forced_is_degraded(gateway: Running, invoke: Invoke) -> None:
    gateway.do(lambda cell: cell.force(CYCLES, 9, 0.0, 10.0**9))
    done = invoke("status")
    assert done.exit_code == 1
    assert "forced by the local operator: cycles" in done.output
    assert "11 good, 1 forced" in done.output


@pytest.mark.usefixtures("gateway")
def test_json_is_what_the_gateway_says(invoke: Invoke) -> None:
    done = invoke("status", "--json")
    found = json.loads(done.output)
    assert found["healthy"]
    assert found["cells"][0]["name"] == "press"


@pytest.mark.usefixtures("gateway")
def test_one_cell(invoke: Invoke) -> None:
    assert invoke("status", "--cell", "press").exit_code == 0
    done = invoke("status", "--cell", "weld")
    assert (done.exit_code, done.output) == (1, "Error: there is no cell weld; there is press\n")


@pytest.mark.parametrize("name", ["status", "watch", "locks", "events", "unforce --all", "force x 1"])
def test_without_a_gateway_every_command_says_so(invoke: Invoke, name: str) -> None:
    done = invoke(*name.split())
    assert done.exit_code == 2
    assert "no gatewayd listens at" in done.output
    assert "is it running" in done.output
