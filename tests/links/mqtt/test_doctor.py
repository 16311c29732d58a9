"""What `gatewayd doctor` finds of a broker."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from socket import EAI_NONAME, gaierror

import pytest

from gatewayd.links.examination import Outcome, RunningCell, Surroundings
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.links.registry import examination_of
from tests.e2e.processes import HOST, free_port
from tests.links.mqtt.cells import planned
from tests.peers.mosquitto import BrokerOptions, mosquitto


async def looked(port: int, around: Surroundings = Surroundings()) -> list[tuple[Outcome, str]]:  # noqa: B008 - immutable
    plan = planned()
    mqtt = replace(plan.the(MqttPlan), host=HOST, port=port)
    examination = examination_of("mqtt")
    assert examination is not None
    return [(each.outcome, each.text) async for each in examination.examine(mqtt, plan.cell, around)]


async def test_a_broker_takes_the_connection_and_sends_commands(tmp_path: Path) -> None:
    with mosquitto(tmp_path / "broker") as broker:
        assert await looked(broker.port) == [
            (Outcome.OK, f"{HOST}:{broker.port} takes the connection"),
            (Outcome.OK, f"{HOST}:{broker.port} sends plant/press/set"),
        ]


async def test_a_broker_that_refuses(tmp_path: Path) -> None:
    with mosquitto(tmp_path / "broker", BrokerOptions(users={"press": "secret"})) as broker:
        ((outcome, text),) = await looked(broker.port)
        assert outcome is Outcome.PROBLEM
        assert "the broker refuses the connection: not authorized" in text


async def test_no_broker() -> None:
    port = free_port()
    assert await looked(port) == [(Outcome.PROBLEM, f"{HOST}:{port}: Connection refused")]


async def test_a_name_that_nobody_knows(monkeypatch: pytest.MonkeyPatch) -> None:
    async def unknown(*_: object) -> None:
        raise gaierror(EAI_NONAME, "Name or service not known")

    monkeypatch.setattr("gatewayd.mqtt.client.resolve", unknown)
    plan = planned()
    examination = examination_of("mqtt")
    assert examination is not None
    mqtt = replace(plan.the(MqttPlan), host="broker.invalid")
    (seen,) = [each async for each in examination.examine(mqtt, plan.cell, Surroundings())]
    assert "name" in seen.cause
    assert "`mqtt: host: broker.invalid`" in seen.remedy


async def test_a_running_gateway_is_believed() -> None:
    port = free_port()
    link = {"broker": f"{HOST}:{port}", "client": "gatewayd-press", "state": "connected"}
    running = RunningCell(
        "sock", {"name": "press", "links": [{"name": "mqtt", "title": "MQTT"}], "mqtt": link}
    )
    assert await looked(port, Surroundings(running=(running,))) == [
        (Outcome.OK, f"{HOST}:{port}: the running gateway is connected as gatewayd-press")
    ]
