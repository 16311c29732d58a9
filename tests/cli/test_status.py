"""`gatewayd status`: a summary that a human understands, and exit codes that a script does."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.image import Quality
from gatewayd.core.requester import Requester
from gatewayd.core.unserved import Unserved
from tests.cli.conftest import Invoke, Running
from tests.control.served import CYCLES, LIMIT, SPEED

PLC, HMI = 0, 1


def test_a_healthy_gateway(gateway: Running, invoke: Invoke) -> None:
    gateway.do(lambda cell: cell.write(Requester(PLC), [Change(SPEED, 0.5)], 1.0))
    done = invoke("status")
    assert done.exit_code == 0
    for words in (
        "is healthy", "press  press.yaml, mapping", "192.0.2.10:30004 fresh",
        "127.0.0.1:1502 unit 1 listening, no connections",
        "plc connected", "owns 1 of 3 locks", "hmi has not connected yet", "12, all good", "motion: plc",
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


def test_what_nobody_serves_is_said_and_no_fault_of_the_cell(gateway: Running, invoke: Invoke) -> None:
    gateway.do(
        lambda cell: cell.unserved(Requester(PLC), Unserved.NO_SUCH_UNIT, "asked unit 7; units here: 1", 1.0)
    )
    done = invoke("status")
    assert done.exit_code == 0
    assert "1 request not served, " in done.output
    assert "ago: plc asked unit 7; units here: 1" in done.output


def test_what_is_forced_is_degraded(gateway: Running, invoke: Invoke) -> None:
    gateway.do(lambda cell: cell.operator.force(CYCLES, 9, 0.0, 10.0**9))
    done = invoke("status")
    assert done.exit_code == 1
    assert "forced by the local operator: cycles" in done.output
    assert "11 good, 1 forced" in done.output


def test_what_the_robot_holds_and_how_late_it_is(gateway: Running, invoke: Invoke) -> None:
    def trouble(cell: Cell) -> None:
        cell.image.quality[LIMIT] = Quality.DIFFERS
        cell.image.quality[CYCLES] = Quality.OUT_OF_RANGE
        cell.image.quality[SPEED] = Quality.NOT_RUNNING
        health = cell.health
        cell.delivery.unread |= {LIMIT, SPEED}
        health.differing, health.unadopted, health.lag, health.adoption, health.gaps = 1, 2, 0.25, 8.0, 3

    gateway.do(trouble)
    done = invoke("status")
    assert done.exit_code == 1
    for words in (
        "! press: what the robot holds is not known for 2 inputs: limit, speed",
        "! press: 1 of 12 variables different in the robot: limit",
        "! press: 1 of 12 variables with a value that a register or object cannot show: cycles",
        "2 inputs not known, 1 input different in the robot, 250 ms behind",
        "adopted values without an owner fall back in 8.0 s",
        "12: 9 good, 1 differs, 1 out of range, 1 not running",
        "the gateway stood still 3 times",
    ):
        assert words in done.output
    assert "out of range" in invoke("watch", "--once").output


def test_what_is_known_of_the_controller(gateway: Running, invoke: Invoke) -> None:
    source = gateway.served.source
    figures = {
        **source.state.figures,
        "controller": "5.12.0.1101",
        "series": "e",
        "protocol": 2,
        "pauses": 2,
        "overtaken": 3,
        "strange": {"unknown type": 3, "layout": 0},
        "contradiction": "the mapping says software 5.9.0, the controller runs 5.12.0, which is newer",
        "last_text": {"text": "Protective stop", "source": "URControl", "level": "warning", "age": 3.0},
    }
    source.state = replace(source.state, figures=figures)
    done = invoke("status")
    assert done.exit_code == 0
    for words in (
        "software 5.12.0.1101 (series e), RTDE protocol 2",
        "2 pauses",
        "3 overtaken",
        "3 strange packages (unknown type)",
        "the controller runs 5.12.0, which is newer",
        "last text 3.0 s ago, warning: Protective stop",
    ):
        assert words in done.output


def test_a_stopped_program_alone_is_no_trouble(gateway: Running, invoke: Invoke) -> None:
    gateway.do(lambda cell: cell.image.quality.__setitem__(CYCLES, Quality.NOT_RUNNING))
    done = invoke("status")
    assert done.exit_code == 0
    assert "11 good, 1 not running" in done.output


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
    assert (done.exit_code, done.output) == (1, "Error: there is no cell weld, only press\n")


@pytest.mark.parametrize("name", ["status", "watch", "locks", "events", "unforce --all", "force x 1"])
def test_without_a_gateway_every_command_says_so(invoke: Invoke, name: str) -> None:
    done = invoke(*name.split())
    assert done.exit_code == 2
    assert "no gatewayd listens at" in done.output
    assert "is it running" in done.output
