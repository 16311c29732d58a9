"""What the screen says about values, owners and events."""

from __future__ import annotations

import time

from pymodbus.client import AsyncModbusTcpClient

from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal import Reason
from gatewayd.demo import snapshot as snapshot_module
from gatewayd.demo.scene import HOST, Scene
from gatewayd.demo.snapshot import describe, snapshot
from gatewayd.links.canopen_node.pdo.receive import Fault
from gatewayd.links.modbus_server.functions import EXCEPTION_OF

FEED = 3
"""Index of the variable for which both buses contend."""


async def test_everything_shown_is_what_the_gateway_knows(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    await until(lambda: scene.plc.program.order.start and scene.cell.image.values[0])
    client = AsyncModbusTcpClient(HOST, port=scene.port)
    assert await client.connect()
    await client.write_register(1, 7)
    shot = snapshot(scene, time.monotonic())
    client.close()
    lines = {line.row.name: line for line in shot.lines}
    assert shot.plc.connected
    assert lines["start"].owner == "plc"
    assert (lines["start"].address, lines["start"].row["notation"]) == ("0.0", "400001.0")
    assert lines["part_number"].lease.endswith(" s")
    assert lines["part_number"].refused == "you refused: 06"
    assert lines["busy"].owner == "robot"
    assert (lines["busy"].row["object"], lines["busy"].row["cob_id"]) == ("2400h:01", "0x290")
    assert (lines["start"].row["object"], lines["start"].row["cob_id"]) == ("", "")
    assert "wrote part_number = 7: refused with exception 06, held by plc" in shot.events[-1].text
    assert shot.events[-1].bad


async def test_every_kind_of_event_has_words(scene: Scene) -> None:
    for kind in EventKind:
        event = Event(0.0, kind, variable=1, lock=1, writer=0, other=1, reason=Reason.HELD, old=1, new=2)
        assert describe(event, scene.cell).strip()
    for reason in Reason:
        event = Event(0.0, EventKind.REFUSED, reason=reason)
        assert "an undeclared peer wrote an address: refused with exception 0" in describe(event, scene.cell)


async def test_contention_of_the_buses_is_told_on_both(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    """The PLC takes the feed over for its third part; the master is told by EMCY, and gets it back by itself."""
    await until(lambda: scene.master.feeder.held)
    shot = snapshot(scene, time.monotonic())
    line = shot.lines[FEED]
    assert (line.row.name, line.value) == ("feed", "20 %")
    assert line.owner == "plc"
    assert "line: FF01h" in line.refused
    texts = [one.text for one in shot.events]
    assert "plc took feed over from line" in texts
    refused = "line wrote feed = 60 %: refused with EMCY FF01h, held by plc"
    assert any(text.startswith(refused) for text in texts)
    await until(lambda: not scene.master.feeder.held)
    assert scene.cell.image.values[FEED] == 60.0
    assert scene.plc.refused == 0


async def test_state_of_the_node_is_told_as_the_master_hears_it(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    await until(lambda: scene.master.operational(time.monotonic()))
    shot = snapshot(scene, time.monotonic())
    assert (shot.node, shot.operational) == ("operational", True)
    later = snapshot(scene, time.monotonic() + 60)
    assert (later.node, later.operational) == ("lost", False)


def test_codes_of_refusals_are_those_that_the_links_answer_with() -> None:
    """The demonstration may not know the kinds of links, so it has its own table."""
    assert {reason: f"{code:02X}" for reason, code in EXCEPTION_OF.items()} == snapshot_module._EXCEPTIONS
    refusals = [fault for fault in Fault if fault.is_refusal]
    assert {Reason[each.name]: f"{each.value:04X}h" for each in refusals} == snapshot_module._EMERGENCIES
