"""What a master asks a node for in vain, in words: as on Modbus."""

from __future__ import annotations

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.events import EventKind
from gatewayd.core.unserved import Unserved
from gatewayd.report.event_text import EventRecord
from tests.links.canopen_node.test_node import NODE, Plant

SDO = 0x600 + NODE


def texts(cell: Cell) -> list[str]:
    return [
        EventRecord.of(event, cell.definition).text()
        for event in cell.events
        if event.kind is EventKind.UNSERVED
    ]


@pytest.mark.parametrize(
    "can_id, data, reason, text",
    [
        (
            SDO,
            "40 ff 20 00 00 00 00 00",
            Unserved.NO_SUCH_ADDRESS,
            "tool read 20FFh:00 by SDO: 06020000h no such object; nearest: Input REAL32 2002h",
        ),
        (
            SDO,
            "40 01 20 05 00 00 00 00",
            Unserved.NO_SUCH_ADDRESS,
            "tool read 2001h:05 by SDO: 06090011h no such sub-index; 2001h ends with 01",
        ),
        (
            SDO,
            "23 01 24 01 01 00 00 00",
            Unserved.NOT_ALLOWED,
            "tool wrote 2401h:01 by SDO: 06010002h read only",
        ),
        (
            SDO,
            "2f 17 10 00 01 00 00 00",
            Unserved.MALFORMED,
            "tool wrote 1017h:00 by SDO: 06070013h too short",
        ),
        (
            SDO,
            "60 00 00 00 00 00 00 00",
            Unserved.NO_SUCH_FUNCTION,
            "tool sent an SDO frame that fits no transfer: 05040001h unknown command",
        ),
        (SDO, "40 01 20", Unserved.MALFORMED, "tool sent an SDO frame of 3 bytes instead of 8"),
        (
            0,
            "07 00",
            Unserved.NO_SUCH_FUNCTION,
            "undeclared peer NMT master sent NMT command 7, which is not known",
        ),
        (0, "01", Unserved.MALFORMED, "undeclared peer NMT master sent an NMT frame of 1 byte instead of 2"),
        (0x205, "01 02", Unserved.MALFORMED, "line sent RPDO 1 with 2 bytes instead of 4: dropped"),
        (
            0x205,
            "01 00 00 00 05",
            Unserved.MALFORMED,
            "line sent RPDO 1 with 5 bytes instead of 4: the rest is ignored",
        ),
    ],
)
def test_what_a_node_does_not_serve_is_counted_and_said(
    can_id: int, data: str, reason: Unserved, text: str
) -> None:
    plant = Plant().operational()
    plant.hear(can_id, bytes.fromhex(data))
    assert texts(plant.cell) == [text]
    assert plant.cell.health.unserved[reason] == sum(plant.cell.health.unserved.values()) == 1


def test_a_hundred_short_rpdos_are_counted_one_by_one_and_reported_together() -> None:
    plant = Plant().operational()
    for _ in range(100):
        plant.hear(0x205, b"\1")
    assert len(texts(plant.cell)) == 1
    assert plant.cell.health.unserved[Unserved.MALFORMED] == 100


def test_what_the_cell_refused_is_not_counted_twice() -> None:
    plant = Plant().operational()
    plant.cell.robot_lost("unplugged", plant.now)
    plant.hear(SDO, bytes.fromhex("23 01 20 01 01 00 00 00"))
    assert plant.cell.health.writes_refused == 1
    assert sum(plant.cell.health.unserved.values()) == 0


def test_commands_to_other_nodes_are_none_of_ours() -> None:
    plant = Plant().operational()
    plant.hear(0, bytes((7, NODE + 1)))
    assert texts(plant.cell) == []
