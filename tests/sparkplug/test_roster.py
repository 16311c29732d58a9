"""Devices and metrics over reloads: aliases, values, presence."""

from __future__ import annotations

import pytest

from gatewayd.sparkplug.datatypes import MetricType
from gatewayd.sparkplug.declarations import DeviceDeclaration, MetricDeclaration, MetricValue, QualityCode
from gatewayd.sparkplug.roster import Roster


def device(name: str, *metrics: str, kind: MetricType = MetricType.INT32) -> DeviceDeclaration:
    return DeviceDeclaration(name, tuple(MetricDeclaration(metric, kind) for metric in metrics))


def test_aliases_are_unique_and_belong_to_their_metrics_for_ever() -> None:
    first = Roster([MetricDeclaration("x", MetricType.INT8)], [device("d", "a", "b"), device("e", "a")])
    assert first.node.aliases == {"x": 1}
    assert first.devices["d"].aliases == {"a": 2, "b": 3}
    assert first.devices["e"].aliases == {"a": 4}
    second = Roster([], [device("e", "b", "a")], first)
    assert second.devices["e"].aliases == {"b": 5, "a": 4}
    third = Roster([], [device("d", "b"), device("e", "b", "a")], second)
    assert third.devices["d"].aliases == {"b": 3}


def test_what_is_the_same_is_the_same_object_and_what_is_not_keeps_its_values() -> None:
    first = Roster([], [device("d", "a", "b"), device("e", "a")])
    for one in first.devices.values():
        one.is_born, one.latest["a"] = True, MetricValue(1, 0.0)
    second = Roster([], [device("d", "a", "c"), device("e", "a")], first)
    assert second.node is first.node
    assert second.devices["e"] is first.devices["e"]
    changed = second.devices["d"]
    assert (changed.is_born, changed.latest) == (False, {"a": MetricValue(1, 0.0)})
    other_type = Roster([], [device("d", "a", kind=MetricType.DOUBLE)], second).devices["d"]
    assert other_type.value("a", 7.0) == MetricValue(None, 7.0, QualityCode.STALE)


def test_a_death_that_waits_survives_a_reload() -> None:
    first = Roster([], [device("d", "a")])
    first.devices["d"].is_born, first.devices["d"].is_present = True, False
    changed = Roster([], [device("d", "b")], first).devices["d"]
    assert (changed.is_born, changed.is_present) == (True, False)


def test_metrics_are_found_by_name_or_alias() -> None:
    one = Roster([], [device("d", "a", "b")]).devices["d"]
    assert one.find("b", None) == one.find(None, 2) == one.metrics["b"]
    assert one.find("b", 1) == one.metrics["b"]
    assert one.find("c", 1) is None
    assert one.find(None, None) is None
    assert one.find(None, 9) is None


@pytest.mark.parametrize(
    "metrics, devices, words",
    [
        ([], [device("a/b", "x")], "has a /"),
        ([], [device("d", "x", "x")], "two metrics of one name"),
        ([], [device("d", "")], "cannot have"),
        ([], [device("d", "x"), device("d", "y")], "two devices"),
        ([], [device("", "x")], "two devices"),
        ([MetricDeclaration("bdSeq", MetricType.INT64)], [], "cannot have"),
        ([MetricDeclaration("Node Control/Rebirth", MetricType.BOOLEAN)], [], "cannot have"),
    ],
)
def test_what_cannot_be_declared(
    metrics: list[MetricDeclaration], devices: list[DeviceDeclaration], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        Roster(metrics, devices)
