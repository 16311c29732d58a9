"""What the screen says about values, owners and events."""

from __future__ import annotations

import time

from pymodbus.client import AsyncModbusTcpClient

from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal import Reason
from gatewayd.demo.scene import HOST, Scene
from gatewayd.demo.snapshot import describe, number, snapshot


async def test_everything_shown_is_what_the_gateway_knows(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    await until(lambda: scene.plc.program.order.start and scene.cell.image.values[0])
    client = AsyncModbusTcpClient(HOST, port=scene.port)
    assert await client.connect()
    await client.write_register(1, 7)
    shot = snapshot(scene, time.monotonic())
    client.close()
    lines = {line.row.name: line for line in shot.lines}
    assert shot.plc_connected
    assert lines["start"].owner == "plc"
    assert (lines["start"].address, lines["start"].row.notation) == ("0.0", "400001.0")
    assert lines["part_number"].lease.endswith(" s")
    assert lines["part_number"].refused == "you refused: 06"
    assert lines["busy"].owner == "robot"
    assert "wrote part_number = 7: refused with exception 06, held by plc" in shot.happenings[-1].text
    assert shot.happenings[-1].bad


async def test_every_kind_of_event_has_words(scene: Scene) -> None:
    for kind in EventKind:
        event = Event(0.0, kind, variable=1, lock=1, writer=0, other=1, reason=Reason.HELD, old=1, new=2)
        assert describe(event, scene.cell).strip()
    for reason in Reason:
        event = Event(0.0, EventKind.REFUSED, reason=reason)
        assert "a stranger wrote an address refused with exception 0" in describe(event, scene.cell)


def test_numbers_are_short() -> None:
    assert [number(value) for value in (True, False, 7, 2.0, 0.12345)] == ["1", "0", "7", "2", "0.123"]
    assert number(47.5, "N") == "47.5 N"
