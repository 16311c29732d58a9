"""Which values are due."""

from __future__ import annotations

import math

from gatewayd.core.definition import Direction, Fallback, FallbackKind, Value, ValueKind, Variable
from gatewayd.core.image import ProcessImage, Quality
from gatewayd.links.mqtt.plan import Publication
from gatewayd.links.mqtt.publisher import Publisher


def variable(number: int, kind: ValueKind, on_stale: Fallback = Fallback()) -> Variable:  # noqa: B008 - immutable
    return Variable(number, f"v{number}", Direction.OUTPUT, kind, f"field{number}", on_stale=on_stale)


class Looked:
    """An image of a real, an integer and one that nobody may see stale, and who publishes it."""

    def __init__(self, every: float | None = None) -> None:
        kinds = (ValueKind.FLOAT, ValueKind.INT)
        exception = Fallback(FallbackKind.EXCEPTION)
        variables = [
            *(variable(i + 1, kind) for i, kind in enumerate(kinds)),
            variable(3, ValueKind.INT, exception),
        ]
        self.image = ProcessImage(variables)
        publications = [
            Publication(0, "real", 0.1, 1.0),
            Publication(1, "count", 0.0, 0.5),
            Publication(2, "shy"),
        ]
        self.publisher = Publisher(publications, self.image, every)

    def due(self, now: float, *values: Value, repeat: bool = True) -> list[str]:
        for index, value in enumerate(values):
            self.image.values[index] = value
        if values:
            self.image.outputs_stored(now)
        found = list(self.publisher.due(now, repeat=repeat))
        for sample in found:
            self.publisher.said(sample, now)
        return [sample.name for sample in found]


def test_first_all_then_changes() -> None:
    looked = Looked()
    assert looked.due(0.0, 0.2, 1, 5) == ["real", "count", "shy"]
    assert looked.due(2.0, 0.25, 1, 5) == []
    assert looked.due(2.0, 0.3, 2, 5) == ["real", "count"], "0.3 - 0.2 has reached 0.1"
    assert looked.due(2.4, 0.9, 3, 5) == [], "their intervals have not passed"
    assert looked.due(2.5) == ["count"]
    assert looked.due(3.0) == ["real"]


def test_nan_is_what_it_is() -> None:
    looked = Looked()
    looked.due(0.0, math.nan, 0, 0)
    assert looked.due(2.0, math.nan, 0, 0) == []
    assert looked.due(4.0, 1.0, 0, 0) == ["real"]
    assert looked.due(6.0, math.inf, 0, 0) == ["real"]
    assert looked.due(8.0, math.inf, 0, 0) == []


def test_what_nobody_may_see_has_no_value() -> None:
    looked = Looked()
    looked.due(0.0, 1.0, 1, 7)
    looked.image.outputs_lost()
    samples = {sample.name: sample for sample in looked.publisher.due(5.0, repeat=False)}
    assert (samples["shy"].value, samples["shy"].quality) == (None, Quality.STALE)
    assert (samples["count"].value, samples["count"].quality) == (0, Quality.STALE)
    assert samples["count"].time == 0.0


def test_repeats_only_where_they_are_wanted() -> None:
    looked = Looked(every=10.0)
    looked.due(0.0, 1.0, 1, 1)
    assert looked.due(11.0, repeat=False) == []
    assert looked.due(11.0) == ["real", "count", "shy"]


def test_forgetting_makes_everything_due_at_once() -> None:
    looked = Looked()
    looked.due(0.0, 1.0, 1, 1)
    looked.publisher.forget()
    assert looked.due(0.01) == ["real", "count", "shy"]
