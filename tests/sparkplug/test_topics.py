"""Topics of Sparkplug B, and names that cannot be in one."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.sparkplug.topics import MessageType, SparkplugTopic, name_fault, parse_topic

NAMES = st.text(min_size=1).filter(lambda text: not name_fault(text))


@pytest.mark.parametrize("kind", [one for one in MessageType if one is not MessageType.STATE])
def test_topic_of_every_type(kind: MessageType) -> None:
    topic = SparkplugTopic(kind, "plant", "cell 3", "robot" if kind.is_of_device else "")
    assert str(topic) == f"spBv1.0/plant/{kind.value}/cell 3" + ("/robot" if kind.is_of_device else "")
    assert parse_topic(str(topic)) == topic


def test_topic_of_a_host() -> None:
    assert parse_topic("spBv1.0/STATE/scada") == SparkplugTopic(MessageType.STATE, host="scada")
    assert str(SparkplugTopic(MessageType.STATE, host="scada")) == "spBv1.0/STATE/scada"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "/",
        "spAv1.0/g/NBIRTH/n",
        "spBv1.0",
        "spBv1.0/g",
        "spBv1.0/g/NBIRTH",
        "spBv1.0/g/NBIRTH/n/d",
        "spBv1.0/g/DBIRTH/n",
        "spBv1.0/g/DBIRTH/n/d/e",
        "spBv1.0/g/DBIRTH/n/",
        "spBv1.0//NBIRTH/n",
        "spBv1.0/g/nbirth/n",
        "spBv1.0/g/STATE/n",
        "spBv1.0/g/STATE/n/d",
        "spBv1.0/STATE",
        "spBv1.0/STATE/",
        "STATE/scada",
    ],
)
def test_other_topics_are_none_of_sparkplug(text: str) -> None:
    assert parse_topic(text) is None


@pytest.mark.parametrize(
    "name, words",
    [
        ("", "is empty"),
        ("a+b", "has a \\+"),
        ("a/b", "has a /"),
        ("a#", "has a #"),
        ("a\0b", "control character U\\+0000"),
        ("a\x85", "control character U\\+0085"),
        ("a\ud800", "no character"),
        ("a\uffff", "no character"),
        ("a\U0001fffe", "no character"),
    ],
)
def test_names_that_no_topic_can_have(name: str, words: str) -> None:
    assert re.search(words, name_fault(name))


@given(NAMES, NAMES, NAMES)
def test_valid_names_come_back(group: str, node: str, device: str) -> None:
    topic = SparkplugTopic(MessageType.DCMD, group, node, device)
    assert parse_topic(str(topic)) == topic
    str(topic).encode()


@given(st.text())
def test_any_text_is_a_topic_or_none(text: str) -> None:
    topic = parse_topic(text)
    assert topic is None or str(topic) == text
