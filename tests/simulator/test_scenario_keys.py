"""The keys of a scenario file belong to something."""

from __future__ import annotations

from dataclasses import fields

from gatewayd.simulator.faults import Faults
from gatewayd.simulator.scenario_keys import FAULT_ATTRIBUTES, FAULT_KEYS, ROBOT_KEYS
from tests.sources import ROOT


def test_every_fault_has_a_key_and_every_key_a_fault() -> None:
    """`hold` alone stands beside the robot's other keys: it is no fault of the connection."""
    attributes = {FAULT_ATTRIBUTES.get(key, key) for key in FAULT_KEYS}
    assert attributes == {field.name for field in fields(Faults)} - {"hold"}


def test_every_key_is_documented() -> None:
    page = (ROOT / "docs/reference/simulator.md").read_text()
    assert [key for key in (*ROBOT_KEYS, *FAULT_KEYS) if f"`{key}`" not in page] == []
