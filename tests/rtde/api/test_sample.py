"""Samples against plain unpacking, for any recipe."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.api.sample import Sample, SampleLayout
from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe

LAYOUT = SampleLayout(
    Recipe(
        ("timestamp", "actual_q", "robot_mode"),
        [OUTPUTS[n].type for n in ("timestamp", "actual_q", "robot_mode")],
    ),
    ("robot_mode", "actual_q"),
)
SAMPLE = Sample(LAYOUT, (12.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7), 99.0)


@pytest.mark.parametrize("made", [Sample, LAYOUT.sample], ids=["by name", "by property"])
def test_a_field_is_an_attribute_and_an_item(made: type[Sample]) -> None:
    sample = made(LAYOUT, SAMPLE._flat, 99.0)
    assert isinstance(sample, Sample)
    assert sample.actual_q[3] == sample["actual_q"][3] == 4.0  # type: ignore[index]
    assert (sample.robot_mode, sample.timestamp, sample.received) == (7, 12.5, 99.0)
    assert sample.as_dict() == {"robot_mode": 7, "actual_q": (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)}
    assert sample.values == (7, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert {"actual_q", "timestamp", "values"} <= set(dir(sample))
    assert "timestamp" in sample
    assert "actual_qd" not in sample
    assert repr(sample).startswith("<Sample robot_mode=7, actual_q=(1.0,")


def test_a_field_that_is_not_there_is_named_with_what_may_be_meant() -> None:
    sample: Any = LAYOUT.sample(LAYOUT, SAMPLE._flat, 99.0)
    with pytest.raises(AttributeError, match="actual_p is no field of this sample; did you mean actual_q"):
        _ = sample.actual_p
    with pytest.raises(AttributeError):
        sample.actual_q = 1
    with pytest.raises(AttributeError, match="actual_p is no field of this sample; did you mean actual_q"):
        _ = SAMPLE.actual_p
    with pytest.raises(KeyError, match="no field of this sample"):
        _ = SAMPLE["nothing"]


@given(st.data())
def test_wanted_fields_come_in_the_wanted_order(data: st.DataObject) -> None:
    names = data.draw(st.lists(st.sampled_from(sorted(OUTPUTS)), min_size=1, max_size=12, unique=True))
    wanted = tuple(data.draw(st.permutations(names)))[: data.draw(st.integers(0, len(names)))]
    recipe = Recipe(names, [OUTPUTS[name].type for name in names])
    flat = tuple(range(recipe.count))
    layout = SampleLayout(recipe, wanted)
    sample = layout.sample(layout, flat, 0.0)
    assert sample.values == tuple(place for name in wanted for place in flat[recipe.slots[name]])
    for name in names:
        found = getattr(sample, name)
        assert (found if isinstance(found, tuple) else (found,)) == flat[recipe.slots[name]]


def test_a_field_does_not_hide_what_a_sample_has() -> None:
    layout = SampleLayout(
        Recipe(("values", "robot_mode"), [OUTPUTS["robot_mode"].type] * 2), ("values", "robot_mode")
    )
    sample = layout.sample(layout, (1, 2), 0.0)
    assert sample.values == (1, 2)
    assert sample["values"] == 1
