from __future__ import annotations

import json
from dataclasses import replace

import pytest

from gatewayd.cli.rtde.info_text import ControllerFacts, as_json, lines, property_text
from gatewayd.rtde.messages import TextMessage

FACTS = ControllerFacts(
    "robot:30004",
    "5.27.0.1",
    "e",
    2,
    ("192.0.2.7", 40000),
    500.0,
    250.0,
    249.96,
    1,
    3700.0,
    {"robot_mode": 7, "runtime_state": 99},
    [TextMessage("hello", "URControl", 2), TextMessage("\x1b[2J", "", 9)],
    answers_properties=True,
    properties={"v1.software.version": 5 << 48 | 27 << 32 | 3 << 16 | 9, "v2.new": (1, 2)},
    missing={"v1.control_box.type": "NOT_SET"},
)


def test_everything_is_told_to_people() -> None:
    assert list(lines(FACTS)) == [
        "controller     robot:30004",
        "software       5.27.0.1, series e",
        "protocol       version 2",
        "connected      from 192.0.2.7:40000",
        "rate           250.0 Hz measured, 1 package left out; 250 Hz agreed, 500 Hz at most",
        "running for    1 h 1 min",
        "robot_mode     7 running",
        "runtime_state  99",
        "says           warning: hello (URControl)",
        "says           level 9: \\x1b[2J",
        "property       v1.software.version = 5.27.3",
        "property       v2.new = (1, 2)",
        "property       v1.control_box.type: NOT_SET",
    ]


def test_silence_has_its_reasons() -> None:
    silent = replace(FACTS, measured=None, answers_properties=False, properties={}, missing={}, series=None)
    text = "\n".join(lines(silent))
    assert "series unknown" in text
    assert "no data came; 250 Hz agreed" in text
    assert "no answer, as of every controller before 5.26 and 10.15" in text


@pytest.mark.parametrize(
    "name, value, text",
    [
        ("v1.control_box.type", 5 << 24 | 1 << 16 | 7, "type 5, subtype 1"),
        ("v1.robot_arm.tool_flange.type", 1 << 24 | 2 << 16, "type 1, revision 2"),
        ("v9.unknown", 17, "17"),
        ("v9.unknown", 0.5, "0.5"),
        ("v1.software.version", (1, 2), "(1, 2)"),
    ],
)
def test_properties_are_said_as_their_layout_is_known(name: str, value: int, text: str) -> None:
    assert property_text(name, value) == text


def test_programs_get_the_same_with_all_digits() -> None:
    document = json.loads(as_json(FACTS))
    assert document["frequency"] == {"maximum": 500.0, "applied": 250.0, "measured": 249.96}
    assert document["states"]["robot_mode"] == {"value": 7, "meaning": "running"}
    assert document["states"]["runtime_state"]["meaning"] is None
    assert document["texts"][1] == {"level": "level 9", "source": "", "text": "\x1b[2J"}
    assert document["properties"]["missing"] == {"v1.control_box.type": "NOT_SET"}
    assert "\x1b" not in as_json(FACTS)
