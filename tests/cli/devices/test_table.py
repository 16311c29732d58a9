"""Devices in lines for a terminal."""

from __future__ import annotations

from typing import Any

import click

from gatewayd.cli.devices.table import devices_of, lines

MODBUS: dict[str, Any] = {
    "cell": "press", "name": "island", "family": "modbus", "address": "127.0.0.1:502", "unit": 1, "state": "partial",
    "reason": "`level` cannot be read: exception 02", "round_trip": 0.0123, "answers": 1200, "timeouts": 2, "errors": 0,
    "exceptions": {"02": 7}, "age": 0.02, "losses": 1, "since": 65.0,
}  # fmt: skip
CANOPEN: dict[str, Any] = MODBUS | {
    "name": "encoder", "family": "canopen", "address": "socketcan:can1", "unit": 5, "state": "lost", "letter": "D",
    "reason": "D another vendor", "nmt_state": "pre-operational", "identity": "type 00020196h", "round_trip": None,
    "exceptions": {"06020000": 1}, "losses": None, "heartbeat_misses": 3, "emergencies": 1, "emergency": "4210h hot",
    "pdos_received": 5, "pdos_sent": 0,
}  # fmt: skip


def plain(*devices: dict[str, Any]) -> list[str]:
    return [click.unstyle(line) for line in lines(devices)]


def test_modbus_device() -> None:
    assert plain(MODBUS) == [
        "island  partial for 1 min 5 s  127.0.0.1:502 unit 1",
        "    `level` cannot be read: exception 02",
        "    1200 answers, the last 20 ms ago, in 12.3 ms",
        "    2 time-outs; exceptions by code: 02: 7; lost 1 time",
    ]


def test_canopen_device() -> None:
    found = plain(CANOPEN)
    assert found[0] == "encoder  lost (D) for 1 min 5 s  socketcan:can1 node 5, pre-operational"
    assert found[2] == "    type 00020196h"
    assert found[3].endswith("PDOs: 5 received, 0 sent")
    assert found[4] == (
        "    2 time-outs; SDO aborts by code: 06020000: 1; 3 heartbeats missed; 1 EMCY message, the last: 4210h hot"
    )


def test_device_of_which_nothing_is_known_yet() -> None:
    new = MODBUS | {
        "state": "starting",
        "reason": "",
        "age": None,
        "round_trip": None,
        "answers": 0,
        "since": None,
    }
    assert plain(new | {"timeouts": 0, "exceptions": {}, "losses": 0}) == [
        "island  starting  127.0.0.1:502 unit 1",
        "    no answers",
    ]


def test_cells_are_named_where_there_are_several() -> None:
    assert plain(MODBUS, MODBUS | {"cell": "lathe"})[4].startswith("lathe:island ")


def test_devices_of_a_status() -> None:
    links = [{"name": "robot", "title": "Universal Robots controller"}, {"name": "island", "title": "device"}]
    status = {"cells": [{"name": "press", "links": links, "robot": {}, "island": {"state": "good"}}]}
    assert devices_of(status, None) == [{"cell": "press", "name": "island", "state": "good"}]
    assert devices_of(status, "lathe") == []
