"""The robot's half of a handshake, run."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.links.exports import ExportError
from tests.links.robot.urscript.language import load
from tests.links.robot.urscript.scripts import Registers, plan_of, script

VARIABLES = """\
  order:      {robot: input_bit_register_0, modbus: 0.0, owner: plc}
  order_seen: {robot: output_bit_register_5, modbus: 100.0}
  done:       {robot: output_bit_register_6, modbus: 100.1}
  done_seen:  {robot: input_bit_register_1, modbus: 0.1, owner: plc}
  lamps:      {robot: output_bit_register_8..9, modbus: 101.0}
  number:     {robot: input_int_register_0, modbus: 1, owner: plc}
  joints:     {robot: actual_q, modbus: 200}
"""
TOGGLE, SEEN = "input_boolean_register 0", "output_boolean_register 5"
DONE, DONE_SEEN = "output_boolean_register 6", "input_boolean_register 1"


def test_data_are_pending_until_they_are_acknowledged() -> None:
    """Each change of the toggle is one message, whichever way it changes."""
    controller = Registers()
    script_program = load(
        script(plan_of(VARIABLES), handshake=("order:order_seen",)), **controller.functions()
    )
    for toggle in (True, False, True):
        assert not script_program.call("gw_pending_order")
        controller.values[TOGGLE] = toggle
        assert script_program.call("gw_pending_order")
        script_program.call("gw_wait_order")
        script_program.call("gw_acknowledge_order")
        assert controller.values[SEEN] is toggle


def test_waiting_ends_with_the_toggle() -> None:
    controller = Registers()
    turns = []

    def sync() -> None:
        turns.append(1)
        controller.values[TOGGLE] = len(turns) == 3

    given = {**controller.functions(), "sync": sync}
    load(script(plan_of(VARIABLES), handshake=("order:order_seen",)), **given).call("gw_wait_order")
    assert len(turns) == 3


def test_what_the_robot_sends_waits_for_the_receiver() -> None:
    controller = Registers()
    sending = load(script(plan_of(VARIABLES), handshake=("done:done_seen",)), **controller.functions())
    assert sending.call("gw_send_done") is True
    assert controller.values[DONE] is True
    assert sending.call("gw_send_done") is False, "the receiver has not taken the first"
    controller.values[DONE_SEEN] = True
    assert sending.call("gw_taken_done")
    assert sending.call("gw_send_done") is True
    assert controller.values[DONE] is False


def test_data_leave_a_cycle_before_their_toggle() -> None:
    """`sync()` ends the cycle in which the program wrote the data."""
    order: list[str] = []
    given: dict[str, Any] = {
        **Registers().functions(),
        "sync": lambda: order.append("sync"),
        "write_output_boolean_register": lambda *_: order.append("toggle"),
    }
    load(script(plan_of(VARIABLES), handshake=("done:done_seen",)), **given).call("gw_send_done")
    assert order == ["sync", "toggle"]


def test_an_element_of_a_family_can_be_a_bit_of_it() -> None:
    controller = Registers()
    sending = load(script(plan_of(VARIABLES), handshake=("lamps[1]:done_seen",)), **controller.functions())
    sending.call("gw_send_lamps_1")
    assert controller.values == {"output_boolean_register 9": True}


@pytest.mark.parametrize(
    "handshakes, message",
    [
        (["order"], "name two bits, TOGGLE:ACKNOWLEDGE"),
        (["order:sent"], "there is no `sent` for a robot program"),
        (["order:ordr_seen"], "did you mean `order_seen`?"),
        (["order:joints[0]"], "there is no `joints[0]` for a robot program"),
        (["number:order_seen"], "`number` is no bit"),
        (["order:done_seen"], "both bits go to the robot"),
        (["done:order_seen"], "both bits go from the robot"),
        (["order:order_seen", "order:done"], "`order` is in --handshake order:order_seen already"),
    ],
)
def test_what_is_no_handshake_is_refused(handshakes: list[str], message: str) -> None:
    with pytest.raises(ExportError) as refused:
        script(plan_of(VARIABLES), handshake=handshakes)
    assert message in str(refused.value)
