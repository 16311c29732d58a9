"""The self test: the whole of it against a PLC that does its part, and one that does not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from gatewayd.links.exports import ExportError
from gatewayd.links.robot.urscript.handshake import handshake
from gatewayd.links.robot.urscript.registers import registers
from gatewayd.links.robot.urscript.selftest import RegisterUnderTest, in_test
from gatewayd.links.robot_program import self_test_rounds
from tests.links.robot.urscript.language import load
from tests.links.robot.urscript.scripts import Registers, plan_of, script, shipped

SMALL = "small-cell.yaml"


def members() -> tuple[RegisterUnderTest, ...]:
    plan = shipped(SMALL)
    found = registers(plan.cell)
    return in_test(found, handshake("start:busy", found))


def test_no_two_variables_are_alike_in_all_rounds() -> None:
    found = members()
    count = self_test_rounds(shipped(SMALL).cell)
    codes = {tuple(member.variable.number >> step & 1 for step in range(count)) for member in found}
    assert len(codes) == len(found)
    assert all(code[-1] == 0 for code in codes), "in the last round all have their low value"


class Peer:
    """The PLC's part, in the control cycles of the program: by the names and values of the table."""

    def __init__(self, crossed: tuple[str, str] | None = None) -> None:
        self.controller = Registers()
        self.members = members()
        self.crossed = dict([crossed, crossed[::-1]]) if crossed else {}
        self.step = 0
        self.wrong: list[str] = []
        self._toggle = "input_boolean_register 0"
        self._acknowledge = "output_boolean_register 1"
        self._written = False

    def cycle(self) -> None:
        values = self.controller.values
        toggle = values.setdefault(self._toggle, False)
        if self._written:
            if values.get(self._acknowledge, False) != toggle:
                return
            self.wrong += [
                member.variable.name
                for member in self.members
                if not member.register.is_input and values.get(self._place(member)) != self._value(member)
            ]
            self.step += 1
        for member in self.members:
            if member.register.is_input:
                values[self._place(member)] = self._value(member)
        values[self._toggle] = not toggle
        self._written = True

    def _value(self, member: RegisterUnderTest) -> Any:
        return member.values.of_round(member.variable.number, self.step)

    def _place(self, member: RegisterUnderTest) -> str:
        name = self.crossed.get(member.variable.name, member.variable.name)
        placed = next(other for other in self.members if other.variable.name == name)
        return f"{placed.register.register} {placed.register.number}"

    def functions(self) -> dict[str, Callable[..., Any]]:
        return {**self.controller.functions(), "sync": self.cycle}


def run(peer: Peer) -> int:
    wrong = load(script(shipped(SMALL), handshake=["start:busy"]), **peer.functions()).call("gw_self_test")
    peer.cycle()
    assert isinstance(wrong, int)
    return wrong


def test_all_is_well_where_both_do_their_part() -> None:
    peer = Peer()
    assert run(peer) == 0
    assert peer.wrong == []
    assert peer.step == self_test_rounds(shipped(SMALL).cell)
    assert peer.controller.said == ["gw self test, wrong values: 0"]


@pytest.mark.parametrize("crossed", [("press_open", "acknowledge"), ("grip_force", "approach_speed")])
def test_crossed_inputs_are_named_by_the_robot(crossed: tuple[str, str]) -> None:
    peer = Peer(crossed)
    assert run(peer) > 0
    said = "\n".join(peer.controller.said)
    assert all(f"wrong: {name}" in said for name in crossed)


def test_crossed_outputs_are_named_by_the_plc() -> None:
    peer = Peer(("ready", "fault"))
    assert run(peer) == 0
    assert set(peer.wrong) == {"ready", "fault"}


def test_the_last_round_leaves_every_output_low() -> None:
    peer = Peer()
    run(peer)
    left = {name: value for name, value in peer.controller.values.items() if name.startswith("output")}
    assert {value for name, value in left.items() if name != "output_boolean_register 1"} == {False}


OWNED = """\
  order: {robot: input_bit_register_0, modbus: 0.0, owner: plc}
  seen:  {robot: output_bit_register_0, modbus: 100.0}
  mine:  {robot: input_int_register_0, modbus: 1, owner: plc}
  other: {robot: input_int_register_1, modbus: 3, owner: hmi}
"""


def test_one_writer_tests_its_own_inputs() -> None:
    text = script(plan_of(OWNED), handshake=["order:seen"], writer="plc")
    assert '"mine"' in text
    assert '"other"' not in text
    assert "# Inputs are those of plc." in text


@pytest.mark.parametrize(
    "options, message",
    [
        ({"writer": "plc"}, "needs a --handshake towards the robot"),
        ({"writer": "plo", "handshake": ["order:seen"]}, "did you mean `plc`?"),
    ],
)
def test_a_writer_that_cannot_be_tested_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ExportError) as refused:
        script(plan_of(OWNED), **options)
    assert message in str(refused.value)
