"""What /healthz and /readyz say, and why."""

from __future__ import annotations

from gatewayd.core.cell import Cell
from gatewayd.links.contract import LinkHealth
from gatewayd.report.verdict import CellVerdict, judge
from gatewayd.web.health import health, readiness


def verdicts(cell: Cell) -> dict[str, CellVerdict]:
    return {cell.definition.name: judge(cell, LinkHealth(), {}, 1.0)}


def test_healthy_while_everything_turns() -> None:
    assert health(()) == (True, {"healthy": True, "reasons": []})
    assert health(("core of press",)) == (False, {"healthy": False, "reasons": ["hangs: core of press"]})


def test_ready_with_a_fresh_and_writable_robot(cell: Cell) -> None:
    ready, answer = readiness(verdicts(cell), (), ())
    assert ready
    assert answer == {"ready": True, "reasons": [], "cells": {"press": {"ready": True, "reasons": []}}}


def test_not_ready_without_the_robot_and_why(cell: Cell) -> None:
    cell.robot_lost("cable", 1.0)
    ready, answer = readiness(verdicts(cell), (), ())
    assert not ready
    assert answer["cells"] == {"press": {"ready": False, "reasons": ["robot not connected for 0 s"]}}


def test_not_ready_before_the_inputs_are_adopted(cell: Cell) -> None:
    cell.robot_connected(1.0)
    cell.package_arrived(5.0, 1.0)
    assert readiness(verdicts(cell), (), ())[1]["cells"] == {
        "press": {
            "ready": False,
            "reasons": ["the robot's inputs are not adopted yet, nothing can be written"],
        }
    }


def test_not_ready_with_a_part_that_hangs_or_a_listener_that_is_away(cell: Cell) -> None:
    ready, answer = readiness(verdicts(cell), ("core of press",), ["not listening on :502", ""])
    assert not ready
    assert answer["reasons"] == ["hangs: core of press", "not listening on :502"]


def test_trouble_with_audit_or_log_is_told_and_the_cells_are_served(cell: Cell) -> None:
    ready, answer = readiness(
        verdicts(cell), (), (), ["the audit file cannot be written: No space left on device"]
    )
    assert ready
    assert answer["reasons"] == ["the audit file cannot be written: No space left on device"]
