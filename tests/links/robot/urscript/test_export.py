"""The file for the robot program as a whole."""

from __future__ import annotations

import re

import pytest

from gatewayd.links.exports import ExportError
from tests.links.robot.urscript.language import load
from tests.links.robot.urscript.scripts import MAPPINGS, Registers, plan_of, script, shipped

READY = "  ready: {robot: output_bit_register_0, modbus: 0.0}\n"


def test_the_program_stops_after_two_missing_feeds() -> None:
    """As the mapping file itself says in a comment."""
    call = 'rtde_set_watchdog("input_int_register_23", 5, "stop")'
    text = script(shipped("small-cell.yaml"))
    assert call in (MAPPINGS / "small-cell.yaml").read_text()
    assert "when the gateway or plc is gone" in text
    calls: list[tuple[object, ...]] = []
    given = {**Registers().functions(), "rtde_set_watchdog": lambda *values: calls.append(values)}
    load(text, **given).call("gw_watch")
    assert calls == [("input_int_register_23", 5, "stop")]


def test_without_a_watchdog_the_file_says_so() -> None:
    assert "declares no watchdog" in script(plan_of(READY))
    assert "gw_watch" not in script(plan_of(READY))


def test_the_head_names_cell_file_and_fingerprint() -> None:
    plan = plan_of(READY)
    head = re.sub(r"\n#\s+", " ", script(plan))
    assert (
        f"Cell press, made by `gatewayd export urscript` from press.yaml, fingerprint {plan.cell.fingerprint:08X}"
        in head
    )


def test_loading_the_file_calls_nothing() -> None:
    """It only defines: whoever includes it decides what is done, and when."""
    controller = Registers()
    load(script(shipped("small-cell.yaml"), handshake=["start:busy"]), **controller.functions())
    assert (controller.values, controller.said) == ({}, [])


def test_another_prefix() -> None:
    program = load(script(plan_of(READY), prefix="press3"), **Registers().functions())
    assert set(program.parameters) == {"press3_write_ready"}


@pytest.mark.parametrize("prefix", ["", "3", "a b", "a-b", "x" * 33, 'a"', "é"])
def test_a_prefix_that_is_no_name_is_refused(prefix: str) -> None:
    with pytest.raises(ExportError, match="a name of URScript"):
        script(plan_of(READY), prefix=prefix)


def test_one_name_for_two_functions_is_refused() -> None:
    variables = """\
  lamp:   {robot: output_bit_register_0..1, modbus: 0.0}
  lamp_1: {robot: output_bit_register_4, modbus: 0.4}
  seen:   {robot: input_bit_register_0, modbus: 1.0, owner: plc}
  seen_1: {robot: input_bit_register_1, modbus: 1.1, owner: plc}
"""
    with pytest.raises(ExportError, match="two functions would be called `gw_taken_lamp_1`"):
        script(plan_of(variables), handshake=["lamp[1]:seen", "lamp_1:seen_1"])


def test_nothing_for_a_robot_program() -> None:
    with pytest.raises(ExportError, match="nothing for a robot program"):
        script(plan_of("  joints: {robot: actual_q, modbus: 0}\n"))
