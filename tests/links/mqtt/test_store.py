"""What is kept without a broker is bounded, and what is lost is counted."""

from __future__ import annotations

from gatewayd.core.image import Quality
from gatewayd.links.mqtt.publisher import ValueSample
from gatewayd.links.mqtt.store import ChangeStore


def sample(value: int) -> ValueSample:
    return ValueSample("count", 0, value, Quality.GOOD, float(value))


def values(store: ChangeStore) -> list[object]:
    found: list[object] = []
    while (first := store.first()) is not None:
        found.append(first.value)
        store.sent()
    return found


def test_the_oldest_go_first_by_number_and_by_time() -> None:
    store = ChangeStore(keep=10.0, size=3)
    for moment in range(5):
        store.add(sample(moment), float(moment))
    assert (len(store), store.dropped) == (3, 2)
    store.expire(13.5)
    assert (values(store), store.dropped) == ([4], 4)


def test_nothing_is_kept_where_nothing_is_to_be() -> None:
    store = ChangeStore(keep=None, size=3)
    store.add(sample(1), 0.0)
    assert (len(store), store.dropped) == (0, 1)


def test_a_successor_keeps_what_it_has_room_for() -> None:
    former, store = ChangeStore(10.0, 5), ChangeStore(10.0, 2)
    for moment in range(4):
        former.add(sample(moment), float(moment))
    store.succeed(former)
    assert (values(store), store.dropped) == ([2, 3], 2)
