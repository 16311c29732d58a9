"""What the links of several cells use together is had for all of them, or not at all."""

from __future__ import annotations

import asyncio
import socket
from dataclasses import replace
from pathlib import Path

import pytest

from gatewayd.links.contract import PrepareError
from gatewayd.links.modbus_server.listeners import Listeners
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan
from gatewayd.service.daemon import Daemon
from gatewayd.service.shared_parts import SharedParts
from tests.e2e.processes import HOST, free_port


def plan_for(port: int) -> Plan:
    plan = load(
        b"gatewayd: 1\ncell: press\nrobot: {host: robot}\nmodbus: {}\n"
        b"variables: {ready: {robot: output_bit_register_0, modbus: 0.0}}\n",
        "cell.yaml",
    ).plan
    assert plan is not None
    return plan.with_links(modbus=replace(plan.the(ModbusPlan), host=HOST, port=port))


def test_a_kind_has_one_part_or_none() -> None:
    shared = SharedParts()
    assert shared.of("robot") is None
    assert isinstance(shared.of("modbus"), Listeners)
    assert shared.of("modbus") is shared.of("modbus")
    assert list(shared) == [shared.of("modbus")]


async def test_what_was_opened_is_closed_again_when_something_cannot_be_had() -> None:
    free, taken = free_port(), free_port()
    with socket.socket() as holder:
        holder.bind((HOST, taken))
        holder.listen()
        with pytest.raises(PrepareError, match="in use"):
            await SharedParts().prepare([plan_for(free), plan_for(taken)])
    with socket.socket() as other:
        other.bind((HOST, free))


async def test_what_is_prepared_serves_nobody_until_it_is_committed_and_can_be_given_back() -> None:
    port = free_port()
    shared = SharedParts()
    prepared = await shared.prepare([plan_for(port)])
    assert shared.progress() == {}
    await prepared.abort()
    again = await shared.prepare([plan_for(port)])
    again.commit()
    assert list(shared.progress()) == [f"listener {HOST}:{port}"]
    assert shared.troubles() == []
    await shared.close()


async def test_all_links_of_a_kind_share_one_part_whatever_their_names(tmp_path: Path) -> None:
    port = free_port()
    plan = plan_for(port)
    second = replace(plan.the(ModbusPlan), unit=2)
    daemon, stop = Daemon([plan.with_links(spare=second)], tmp_path), asyncio.Event()
    running = asyncio.create_task(daemon.run(stop))
    (runtime,) = daemon.runtimes
    assert list(runtime.links) == ["robot", "modbus", "spare"]
    assert runtime.of_kind("modbus") == [runtime.links["modbus"], runtime.links["spare"]]
    await asyncio.sleep(0.1)
    assert [name for name in daemon.progress() if name.startswith("listener")] == [f"listener {HOST}:{port}"]
    for unit in (1, 2):
        assert await asyncio.to_thread(read_register, port, unit) == b"\x03\x02\x00\x00"
    stop.set()
    await running


def read_register(port: int, unit: int) -> bytes:
    """What a unit answers when its holding register 0 is read; an exception would have another function code."""
    with socket.create_connection((HOST, port), 5) as connection:
        connection.sendall(bytes((0, 1, 0, 0, 0, 6, unit, 3, 0, 0, 0, 1)))
        answer = connection.recv(260)
    return answer[7:]
