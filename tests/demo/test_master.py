"""The CANopen master: what it wants, what it notices, and that it knows the node as the mapping makes it."""

from __future__ import annotations

from importlib.resources import files

from gatewayd.core.definition import Direction
from gatewayd.demo import master
from gatewayd.demo.master import FEEDS, Feeder
from gatewayd.demo.scene import MAPPING
from gatewayd.links.canopen_node.plan import CanopenPlan, canopen_of
from gatewayd.mapping.loader import load

HELD = 0xFF01


def test_feed_that_came_back_stays_for_a_while_and_then_changes() -> None:
    feeder = Feeder()
    assert feeder.ask(0.0) == FEEDS[0]
    feeder.measured(FEEDS[0])
    feeder.measured(FEEDS[0])
    assert feeder.verified == 1
    assert feeder.ask(3.9) == FEEDS[0]
    assert feeder.ask(4.0) == FEEDS[1]
    feeder.measured(FEEDS[0])
    assert feeder.verified == 1


def test_feeds_go_round() -> None:
    feeder = Feeder()
    seen = []
    for number in range(len(FEEDS) + 1):
        seen.append(feeder.ask(10.0 * number))
        feeder.measured(feeder.wanted)
    assert tuple(seen) == (*FEEDS, FEEDS[0])


def test_feed_that_never_comes_back_is_told() -> None:
    feeder = Feeder()
    for number in range(15):
        feeder.ask(0.2 * number)
        feeder.measured(20.0)
    assert feeder.wrong == []
    feeder.ask(3.0)
    assert feeder.wrong == ["the feed never became 60 %"]


def test_refused_feed_is_no_wrong_one_and_counts_anew_afterwards() -> None:
    feeder = Feeder()
    feeder.ask(0.0)
    feeder.measured(FEEDS[0])
    feeder.emergency(HELD, 1.0)
    feeder.measured(FEEDS[0])
    assert (feeder.held, feeder.refusals, feeder.verified) == (True, 1, 1)
    for number in range(30):
        feeder.ask(60.0 + number)
    feeder.emergency(0, 90.0)
    feeder.ask(91.0)
    assert feeder.wrong == []
    feeder.measured(FEEDS[0])
    assert (feeder.held, feeder.verified) == (False, 2)


def test_other_emergencies_are_not_about_the_feed() -> None:
    feeder = Feeder()
    feeder.emergency(0x8130, 0.0)
    feeder.emergency(0, 1.0)
    assert (feeder.held, feeder.refusals) == (False, 0)


def test_parts_are_counted_one_by_one() -> None:
    feeder = Feeder()
    for cycles in (7, 7, 8, 9, 11):
        feeder.counted(cycles)
    assert feeder.verified == 2
    assert feeder.wrong == ["cycles went from 9 to 11"]


def test_what_was_before_a_boot_does_not_count() -> None:
    feeder = Feeder()
    feeder.counted(7)
    feeder.emergency(HELD, 0.0)
    feeder.restart()
    feeder.counted(0)
    assert (feeder.wrong, feeder.held) == ([], False)


def test_master_knows_the_node_as_the_mapping_makes_it() -> None:
    plan = load(files("gatewayd.demo").joinpath(MAPPING).read_bytes(), MAPPING).plan
    assert plan is not None
    assert canopen_of(plan) is not None
    names = [one.name for one in plan.cell.variables]
    carried = {
        pdo.cob_id: (
            pdo.direction,
            [names[entry.variable] for entry in pdo.entries if entry.variable is not None],
        )
        for pdo in plan.the(CanopenPlan).pdos
    }
    assert plan.the(CanopenPlan).node == master.NODE
    assert carried == {
        master.SET_FEED: (Direction.INPUT, ["feed"]),
        master.MEASURED: (Direction.OUTPUT, ["force", "feed_now"]),
        master.SIGNALS: (Direction.OUTPUT, ["busy", "done"]),
        master.INTEGERS: (Direction.OUTPUT, ["part_done", "cycles"]),
    }
