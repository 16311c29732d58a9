"""What `systemctl status` shows."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Lock, ValueKind, Variable, Writer
from gatewayd.core.image import Quality
from gatewayd.core.requester import Requester
from gatewayd.links.contract import LinkHealth
from gatewayd.report.summary import summary
from gatewayd.report.verdict import judge


def sentence(cells: Sequence[Cell], troubles: Sequence[str] = (), now: float = 2.0) -> str:
    return summary([(cell, judge(cell, LinkHealth(), {}, now)) for cell in cells], troubles)


def cell(name: str = "press-3", *, writers: int = 2) -> Cell:
    i, o, n = Direction.INPUT, Direction.OUTPUT, ValueKind.INT
    return Cell(
        CellDefinition(
            name=name,
            variables=(
                Variable(1, "part", i, n, "input_int_register_0", lock=0),
                Variable(2, "cycles", o, n, "output_int_register_0"),
            ),
            locks=(Lock("part", (0,), (0,)),),
            writers=tuple(Writer(f"w{number}", None) for number in range(writers)),
            stale_after=0.1,
            fingerprint=0,
        )
    )


def fresh(one: Cell) -> Cell:
    one.robot_connected(1.0)
    one.package_arrived(1.0, 1.0)
    one.outputs_written(1.0)
    one.adopt({0: 3}, 1.0)
    one.health.frequency = 499.7
    return one


def all_well(name: str = "press-3") -> Cell:
    made = fresh(cell(name))
    for writer in range(2):
        made.writer_connected(Requester(writer), 1.0)
    return made


def test_a_good_cell() -> None:
    one = all_well()
    one.request(Requester(0), 0, 1.0)
    assert sentence([one]) == "press-3: robot fresh at 500 Hz, 2 of 2 writers connected, 1 lock held"


@pytest.mark.parametrize(
    "condition, words",
    [
        ("lost", "robot not connected"),
        ("waiting", "robot connected, but it sends no data yet"),
        ("silent", "robot silent for 1 s"),
        ("frozen", "robot frozen, its clock stands still for 1 s"),
        ("not adopted", "robot fresh, the robot's inputs are not adopted yet, nothing can be written"),
        ("unavailable", "robot fresh at 500 Hz, 1 of 2 variables unavailable: cycles"),
    ],
)
def test_what_is_wrong_with_a_robot(condition: str, words: str) -> None:
    one = cell(writers=0)
    if condition in ("waiting", "not adopted"):
        one.robot_connected(1.0)
    if condition == "not adopted":
        one.package_arrived(1.0, 1.0)
    if condition in ("silent", "frozen", "unavailable"):
        fresh(one)
    if condition == "frozen":
        one.package_arrived(1.0, 1.95)
    if condition in ("silent", "frozen"):
        one.tick(2.0)
    if condition == "unavailable":
        one.set_availability([1], False, "no such field", 1.0)
    assert sentence([one]) == f"press-3: {words}, no locks held"


def test_missing_writers_are_counted() -> None:
    one = fresh(cell())
    one.writer_connected(Requester(1), 1.0)
    assert "1 of 2 writers connected" in sentence([one])


def test_trouble_comes_first() -> None:
    told = sentence([all_well("a"), cell("b")], ["hangs: core of a", "", "not listening on 127.0.0.1:502"])
    parts = told.split("; ")
    assert parts[:2] == ["hangs: core of a", "not listening on 127.0.0.1:502"]
    assert parts[2].startswith("b: robot not connected")
    assert parts[3].startswith("a: robot fresh")


def test_many_cells_are_counted() -> None:
    well = [all_well(f"w{number}") for number in range(10)]
    assert sentence(well) == "all 10 cells well"
    assert sentence([*well, cell("ill")]).startswith("ill: robot not connected")
    assert sentence([*well, cell("ill")]).endswith("; the other 10 cells well")
    many = sentence([*well, *(cell(f"i{number}") for number in range(30))])
    assert "26 more cells with trouble" in many
    assert len(many) < 500


def test_no_cell() -> None:
    assert sentence([]) == "no cell to serve"


def test_what_the_robot_holds_is_told() -> None:
    one = all_well()
    one.image.quality[0] = Quality.DIFFERS
    one.delivery.unread.add(0)
    assert sentence([one, all_well("weld")]).startswith(
        "press-3: robot fresh at 500 Hz, what the robot holds is not known for 1 input: part, "
        "1 of 2 variables different in the robot: part, 2 of 2 writers"
    )
    many = [one, *(all_well(f"cell-{number}") for number in range(5))]
    assert "the other 5 cells well" in sentence(many), "it is no good cell"


def test_a_writer_that_has_not_come_is_no_trouble_and_one_that_is_lost_is() -> None:
    one = fresh(cell())
    assert sentence([all_well("a"), one]).startswith("a: robot fresh"), "in the order of the cells"
    one.writer_connected(Requester(0), 1.0)
    one.writer_disconnected(Requester(0), 1.0, "closed")
    assert sentence([all_well("a"), one]).startswith(
        "press-3: robot fresh at 500 Hz, writer w0 lost for 1 s, 0 of 2"
    )
