"""A device on a serial port: a pair of pseudo terminals, and a device that is a few bytes."""

from __future__ import annotations

import asyncio
import os
import tty
from contextlib import suppress

import pytest

from gatewayd.links.devices.modbus.lines import ModbusLines
from gatewayd.links.devices.modbus.link import ModbusDeviceLink
from gatewayd.modbus.client.pdus import crc
from tests.links.devices.cells import FakeRobot, device, planned

pytest.importorskip("serial")

HEAD = """\
gatewayd: 1
cell: press
robot: {{host: 127.0.0.1}}
devices:
  gripper: {{serial: {path}, baudrate: 115200, unit: 9, poll: 10ms, watchdog: none}}
writers:
  gripper: {{device: gripper}}
variables:
  position: {{robot: input_int_register_0, device: {{holding: 0, type: uint16}}, owner: gripper}}
"""
READ = bytes.fromhex("090300000001")


def test_a_gripper_on_a_serial_port() -> None:
    async def scenario() -> None:
        master, slave = os.openpty()
        tty.setraw(master)
        robot = FakeRobot(planned("", HEAD.format(path=os.ttyname(slave))))
        robot.fresh()
        asked: list[bytes] = []

        def answer() -> None:
            asked.append(os.read(master, 256))
            said = bytes.fromhex("0903021234")
            os.write(master, said + crc(said))

        loop, lines = asyncio.get_running_loop(), ModbusLines()
        loop.add_reader(master, answer)
        plan = planned("", HEAD.format(path=os.ttyname(slave)))
        lines.serve([ModbusDeviceLink(device(plan, "gripper"), robot.cell)], {})
        running = asyncio.create_task(lines.run())
        try:
            async with asyncio.timeout(5):
                while robot.value("position") != 0x1234:  # noqa: ASYNC110
                    await asyncio.sleep(0.002)
            assert asked[0] == READ + crc(READ)
        finally:
            await lines.close()
            running.cancel()
            with suppress(asyncio.CancelledError):
                await running
            loop.remove_reader(master)
            os.close(master)
            os.close(slave)

    asyncio.run(scenario())
