"""The self test, both halves: the generated block stepped through, with the generated robot program behind it."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.links.modbus_server.plc.registry import files_for
from gatewayd.links.modbus_server.plc.st.main import blocks
from gatewayd.links.modbus_server.plc.targets.iec_st import DIALECT
from gatewayd.links.robot.urscript.registers import registers
from gatewayd.links.robot_program import self_test_rounds
from gatewayd.plc.model import Tag
from gatewayd.plc.tags import PlcWishes
from tests.links.modbus_server.plc.cells import model
from tests.links.modbus_server.plc.simulation import assign, instance, structure, value_in
from tests.links.robot.urscript.language import load
from tests.links.robot.urscript.scripts import Registers, script
from tests.plc_golden import MAPPING, golden_model, plan_from

PLAN = plan_from(MAPPING)
MODEL = golden_model("toggle:ack")
GOOD = {"trusted": True, "values_fresh": True, "robot_writable": True}
LEAD = "lead: {robot: input_bit_register_0, modbus: 0.0, owner: plc}"
SEEN = "seen: {robot: output_bit_register_0, modbus: 100.0}"


def tags(members: Any) -> list[Tag]:
    return [tag for member in members for tag in member.tags]


class Bench:
    """A PLC whose registers are those of the controller, from control cycle to control cycle of the program."""

    def __init__(self, crossed: tuple[str, str] | None = None) -> None:
        (unit,) = (unit for unit in blocks(MODEL, DIALECT) if unit.name == "GW_SelfTest")
        self.status = SimpleNamespace(**GOOD, refusals=0, refusal_writer=0, refusal_variable=0)
        self.inputs, self.outputs = structure(MODEL.inputs), structure(MODEL.outputs)
        self.block, self._call = instance(
            unit, status=self.status, inputs=self.inputs, outputs=self.outputs, time_out=2000, settle=100
        )
        self.controller = Registers()
        self.crossed = dict([crossed, crossed[::-1]]) if crossed else {}
        self._places = {
            variable.name: f"{each.register} {each.number + index}"
            for each in registers(PLAN.cell)
            for index, variable in enumerate(each.variables)
        }

    def cycle(self) -> None:
        """What the robot shows, the block, and what goes to the robot."""
        for tag in tags(MODEL.outputs):
            place = self._place(tag)
            if place is not None:
                assign(self.outputs, tag, self.controller.values.get(place, 0))
        self.block.written += 1
        self._call()
        for tag in tags(MODEL.inputs):
            place = self._place(tag)
            if place is not None:
                value = value_in(self.inputs, tag)
                self.controller.values[place] = bool(value) if "boolean" in place else value

    def robot(self) -> int:
        """The robot's half; its control cycles are those of the PLC."""
        functions: dict[str, Callable[..., Any]] = {**self.controller.functions(), "sync": self.cycle}
        wrong = load(script(PLAN, handshake=["toggle:ack"], writer="plc"), **functions).call("gw_self_test")
        assert isinstance(wrong, int)
        return wrong

    def finish(self) -> None:
        """Cycles until the block is done."""
        for _ in range(1000):
            self.cycle()
            if self.block.done:
                return
        raise AssertionError("the block is never done")

    def _place(self, tag: Tag) -> str | None:
        return self._places.get(self.crossed.get(tag.name, tag.name))


def result(bench: Bench) -> tuple[bool, bool, int, int, str]:
    block = bench.block
    return block.passed, block.error, block.reason, block.first_wrong, block.first_name


def test_both_halves_agree() -> None:
    bench = Bench()
    bench.block.run = True
    assert bench.robot() == 0
    bench.finish()
    assert result(bench) == (True, False, 0, 0, "")
    assert bench.block.test_round == self_test_rounds(PLAN.cell) - 1
    assert bench.controller.said == ["gw self test, wrong values: 0"]
    assert vars(bench.inputs)["part"] == 0, "in the last round all have their low value"


def test_outputs_that_are_exchanged_are_found_by_the_plc() -> None:
    bench = Bench(("cycles", "tool"))
    bench.block.run = True
    assert bench.robot() == 0
    bench.finish()
    assert result(bench) == (False, True, 4, 16, "tool")
    assert bench.block.wrong > 1


def test_inputs_that_are_exchanged_are_found_by_the_robot() -> None:
    bench = Bench(("part", "batch"))
    bench.block.run = True
    assert bench.robot() > 0
    assert {line for line in bench.controller.said if "wrong: " in line} == {
        "gw self test, wrong: part",
        "gw self test, wrong: batch",
    }


def test_without_a_robot_program_the_first_round_fails_in_time() -> None:
    bench = Bench()
    bench.block.run = True
    bench.finish()
    assert result(bench) == (False, True, 3, 0, "")
    assert bench.block.test_round == 0


def test_a_refused_write_is_named() -> None:
    bench = Bench()
    bench.block.run = True
    bench.cycle()
    bench.status.refusals, bench.status.refusal_writer, bench.status.refusal_variable = 1, 1, 5
    for _ in range(300):
        bench.block.written -= 1
        bench.cycle()
    assert result(bench) == (False, True, 2, 5, "force")


def test_nothing_is_written_unless_it_runs() -> None:
    bench = Bench()
    bench.inputs.part = 77
    for _ in range(20):
        bench.cycle()
    assert (bench.inputs.part, bench.block.busy) == (77, False)
    bench.block.run = True
    bench.cycle()
    assert (bench.inputs.part, bench.block.busy) == (258, True)
    bench.block.run = False
    bench.inputs.part = 78
    bench.cycle()
    assert (bench.inputs.part, bench.block.busy) == (78, False)


@pytest.mark.parametrize("lost", sorted(GOOD))
def test_nothing_is_written_while_the_robot_is_not_to_be_trusted(lost: str) -> None:
    bench = Bench()
    setattr(bench.status, lost, False)
    bench.inputs.part = 77
    bench.block.run = True
    bench.cycle()
    assert result(bench)[:3] == (False, True, 1)
    assert bench.inputs.part == 77


@pytest.mark.parametrize(
    "handshake, message",
    [
        ("lead", "name two bits, TOGGLE:ACKNOWLEDGE"),
        ("seen:lead", "the toggle is a bit that this PLC writes"),
        ("laed:seen", "did you mean `lead`?"),
        ("lead:part", "the acknowledgement is a bit of the robot"),
        ("lead:seen", "no other registers"),
    ],
)
def test_what_cannot_lead_is_refused(handshake: str, message: str) -> None:
    with pytest.raises(ExportError) as refused:
        model(LEAD, SEEN, wishes=PlcWishes(writer="plc", handshake=handshake))
    assert message in str(refused.value)


@pytest.mark.parametrize("target", ["c", "studio5000"])
def test_targets_without_structured_text_have_none(target: str) -> None:
    with pytest.raises(ExportError, match="structured text only"):
        files_for(target, MODEL)


def test_what_is_no_register_of_a_program_is_left_alone() -> None:
    """Nobody's speed slider and no digital output moves."""
    found = model_of(PLAN, PlcWishes(writer="plc", handshake="toggle:ack")).self_test
    assert found is not None
    names = {tested.tag.name for tested in (*found.inputs, *found.outputs)}
    assert not names & {"toggle", "ack", "door", "jog", "pose[0]"}
