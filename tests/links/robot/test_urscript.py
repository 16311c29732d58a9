"""Lines for the robot program."""

from __future__ import annotations

from pathlib import Path

from gatewayd.links.robot.urscript import watchdog_script
from gatewayd.mapping.loader import load

MAPPINGS = Path(__file__).parents[3] / "mappings"


def script(name: str) -> str:
    plan = load((MAPPINGS / name).read_bytes(), name).plan
    assert plan is not None
    return watchdog_script(plan)


def test_the_program_stops_after_two_missing_feeds() -> None:
    """As the mapping file itself says in a comment."""
    call = 'rtde_set_watchdog("input_int_register_23", 5, "stop")'
    assert script("small-cell.yaml").splitlines()[-1] == call
    assert call in (MAPPINGS / "small-cell.yaml").read_text()
    assert "when the gateway or plc is gone" in script("small-cell.yaml")


def test_without_a_watchdog_there_is_nothing_to_write() -> None:
    assert script("full-image.yaml") == ""
