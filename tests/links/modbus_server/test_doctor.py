"""Looks at real ports of this machine."""

from __future__ import annotations

import os
import socket

import pytest

from gatewayd.links.examination import Observation, Outcome, RunningCell, Surroundings
from gatewayd.links.modbus_server import doctor
from gatewayd.links.modbus_server.declaration import KIND
from gatewayd.links.modbus_server.doctor import EXAMINATION
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan
from tests.e2e.processes import HOST, free_port
from tests.links.modbus_server.secured import Certificates

MAPPING = """\
gatewayd: 1
cell: press
robot: {{host: 127.0.0.1}}
modbus: {{listen: '{host}:{port}'}}
writers: {{plc: {{modbus: 192.0.2.20}}, hmi: {{modbus: 127.0.0.1}}, line: {{modbus: 192.0.2.0/24}}}}
variables: {{start: {{robot: input_bit_register_0, modbus: 0.0, owner: [plc, hmi, line]}}}}
"""


def plan_at(host: str, port: int) -> Plan:
    loaded = load(MAPPING.format(host=host, port=port).encode(), "a.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


async def look(plan: Plan, *running: RunningCell) -> list[Observation]:
    around = Surroundings(running)
    return [seen async for seen in EXAMINATION.examine(plan.the(ModbusPlan), plan.cell, around)]


@pytest.fixture(autouse=True)
def _way(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine whose route to the PLC is known."""
    monkeypatch.setattr(
        doctor, "look_up_route", lambda address, whom: [Observation.well("route", f"{whom} {address}")]
    )


async def test_a_free_port_and_the_way_to_each_client_that_is_one_other_machine() -> None:
    port = free_port()
    found = await look(plan_at(HOST, port))
    assert [seen.check for seen in found] == ["address", "port", "way to plc"]
    assert {seen.outcome for seen in found} == {Outcome.OK}
    assert found[-1].text == "192.0.2.20: plc 192.0.2.20"


async def test_a_foreign_server_has_the_port() -> None:
    with socket.create_server((HOST, free_port())) as foreign:
        found = await look(plan_at(HOST, foreign.getsockname()[1]))
    (problem,) = (seen for seen in found if seen.outcome.is_finding)
    assert problem.check == "port"
    assert f"(pid {os.getpid()})" in problem.text


async def test_the_gateway_on_this_machine_has_the_port() -> None:
    with socket.create_server((HOST, free_port())) as own:
        port = own.getsockname()[1]
        unit = {"listen": f"{HOST}:{port}", "connections": 1}
        status = {"name": "other", "links": [{"name": "modbus", "title": KIND.title}], "modbus": unit}
        found = await look(plan_at(HOST, port), RunningCell("/run/s", status))
    assert [seen.check for seen in found] == ["port", "way to plc"]
    assert found[0].text == f"{HOST}:{port} is served by the running gateway, 1 connection"


async def test_an_address_of_another_machine() -> None:
    found = await look(plan_at("198.51.100.9", free_port()))
    assert (found[0].check, found[0].outcome) == ("address", Outcome.PROBLEM)


async def test_files_of_a_listener_with_tls(certificates: Certificates) -> None:
    tls = MAPPING.replace("modbus: {{listen: '{host}:{port}'}}", "modbus: {{tls: {tls}}}")
    good = certificates.files(revoked=False)
    for key, outcome in ((good.key, Outcome.OK), (str(certificates.viewer.key), Outcome.PROBLEM)):
        files = f"certificate: {good.certificate}, key: {key}, clients: {good.clients}"
        section = f"{{listen: '{HOST}:{free_port()}', {files}}}"
        loaded = load(tls.format(tls=section).encode(), "a.yaml")
        assert loaded.plan is not None, loaded.diagnostics
        seen = [each for each in await look(loaded.plan) if each.check == "certificates"]
        assert [each.outcome for each in seen] == [outcome]
