from __future__ import annotations

from gatewayd.core.events import CAPACITY, Event, EventKind, EventRing


def test_a_robot_that_was_lost_is_still_there_an_hour_later_whatever_else_happened() -> None:
    ring = EventRing()
    lost = Event(0.0, EventKind.ROBOT_LOST, detail="closed by the robot")
    ring.append(lost)
    for second in range(45 * 60):
        for kind in (EventKind.ACQUIRED, EventKind.RELEASED, EventKind.FALLBACK, EventKind.REFUSED):
            ring.append(Event(float(second), kind, lock=0, writer=0))
    assert next(iter(ring)) is lost
    assert ring.latest[EventKind.ROBOT_LOST] is lost
    assert len(ring.since(ring.count - CAPACITY)) == CAPACITY
    assert len(ring) < 2 * CAPACITY
    assert ring.count == 1 + 4 * 45 * 60


def test_listeners_hear_every_event_once_in_order() -> None:
    ring, heard = EventRing(capacity=1), list[float]()
    ring.listeners.append(lambda event: heard.append(event.time))
    for number in range(3):
        ring.append(Event(float(number), EventKind.FRESH))
    assert heard == [0.0, 1.0, 2.0]


def test_every_kind_has_a_text_of_its_own() -> None:
    assert len({kind.value for kind in EventKind}) == len(EventKind)
