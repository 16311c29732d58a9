"""A device in words, and when a running link goes on with another plan."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from gatewayd.links.devices.declaration import KIND
from gatewayd.links.devices.doctor import EXAMINATION
from gatewayd.links.devices.tables import TABLES
from gatewayd.links.examination import Observation, Outcome, RunningCell, Surroundings
from gatewayd.report.table import as_csv, as_json, as_markdown, rows
from tests.links.devices.cells import HEAD, VARIABLES, device, loaded, planned

NEW = "  new: {robot: input_int_register_9, modbus: 9, owner: plc}\n"


def fits(variables: str = VARIABLES, head: str = HEAD, name: str = "island") -> bool:
    old, new = planned(), planned(variables, head)
    return KIND.fits(device(old, name), device(new, name), old.cell, new.cell)


def test_words() -> None:
    plan = planned()
    found = KIND.describe(device(plan, "gripper"), plan.cell)
    assert found.address == "/dev/ttyUSB0 115200 8N1 unit 9"
    assert (found.settings["watchdog"], found.settings["lost_after"]) == ("1 s", "1.8 s")
    ((place,),) = found.places.values()
    assert place.text == (
        "holding 1002.0..7 (401003.0..7) uint16, rest kept, written on connect, again every 1 s"
    )
    assert (place.area, place.address, place.type) == ("holding", "1002.0..7", "uint16")
    assert KIND.describe(device(plan, "island"), plan.cell).writers == {0: "device island"}


def test_other_variables_do_not_disturb_a_device() -> None:
    assert fits(NEW + VARIABLES)
    assert fits(VARIABLES + "  done: {robot: output_bit_register_0, modbus: 3.1}\n")


@pytest.mark.parametrize(
    "old, new",
    [
        ("discrete: 3", "discrete: 4"),
        ("scale: 0.1", "scale: 0.2"),
        ("type: uint16", "type: int16"),
        ("coil: 0", "coil: 0, on_connect: write"),
        ("  present:", "  there:"),
    ],
)
def test_another_place_is_another_device(old: str, new: str) -> None:
    assert old in VARIABLES
    assert not fits(VARIABLES.replace(old, new))


@pytest.mark.parametrize(
    "old, new", [("1503", "1504"), ("poll: 20ms", "poll: 30ms"), ("poll: 20ms", "poll: 20ms, unit: 2")]
)
def test_another_address_is_another_device_and_the_rest_stays(old: str, new: str) -> None:
    head = HEAD.replace(old, new)
    assert not fits(head=head)
    assert fits(head=head, name="gripper")


def test_tables() -> None:
    found = loaded()
    plan = planned()
    table = rows(found.cell)
    assert "island,discrete 3,bit" in as_csv(table)
    assert '"device": "gripper"' in as_json(plan, found.cell, table)
    page = as_markdown(plan, found.cell, table)
    assert "## Devices" in page
    assert "| gripper | holding 1002.0..7 | uint16 | force <- |" in page
    assert TABLES.headline(plan) == "devices island, gripper"


def looked(name: str, around: Surroundings, head: str = HEAD) -> list[Observation]:
    plan = planned(head=head)

    async def look() -> list[Observation]:
        return [found async for found in EXAMINATION.examine(device(plan, name), plan.cell, around)]

    return asyncio.run(look())


def test_doctor_asks_the_gateway_that_serves_it() -> None:
    status = {
        "name": "press",
        "island": {"address": "127.0.0.1:1503", "state": "lost", "reason": "no answer"},
    }
    (found,) = looked("island", Surroundings((RunningCell("socket", status),)))
    assert (found.outcome, found.cause) == (Outcome.PROBLEM, "no answer")


def test_doctor_tries_the_connection(unused_tcp_port: int) -> None:
    found = looked("island", Surroundings(), HEAD.replace("1503", str(unused_tcp_port)))
    assert [(each.check, each.outcome) for each in found] == [
        ("route", Outcome.OK),
        ("connection", Outcome.PROBLEM),
    ]


@pytest.mark.parametrize(
    "path, outcome",
    [("/dev/null", Outcome.OK), ("/dev/none", Outcome.PROBLEM), ("/etc/hostname", Outcome.PROBLEM)],
)
def test_doctor_looks_for_the_serial_port(path: str, outcome: Outcome) -> None:
    assert Path("/dev/null").exists()
    (found,) = looked("gripper", Surroundings(), HEAD.replace("/dev/ttyUSB0", path))
    assert found.outcome is outcome
