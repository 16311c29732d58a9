"""What may stand in a topic."""

from __future__ import annotations

import pytest

from gatewayd.mqtt.names import MAX_TOPIC, fault_of


@pytest.mark.parametrize("topic", ["a", "plant/hall-2/press-3", "tcp[0]", "ä/ö", "a b"])
def test_topics(topic: str) -> None:
    assert not fault_of(topic)


@pytest.mark.parametrize(
    "topic, why",
    [
        ("", "0 characters"),
        ("a" * (MAX_TOPIC + 1), "201 characters"),
        ("plant/#", "`#` is a wildcard"),
        ("a/+/b", "`+` is a wildcard"),
        ("$SYS/x", "belong to the broker"),
        ("/a", "empty level"),
        ("a/", "empty level"),
        ("a//b", "empty level"),
        ("a\0b", "cannot be seen"),
        ("a\nb", "cannot be seen"),
    ],
)
def test_faults(topic: str, why: str) -> None:
    assert why in fault_of(topic)
