"""A function for each register: run, with the registers of a controller behind them."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.links.exports import ExportError
from tests.links.robot.urscript.language import Halted, load
from tests.links.robot.urscript.scripts import MAPPINGS, Registers, plan_of, script, shipped

VARIABLES = """\
  go:     {robot: input_bit_register_40, modbus: 0.0, owner: plc}
  force:  {robot: input_double_register_2, modbus: {holding: 1, type: int16, scale: 0.1}, owner: [plc, hmi],
           limits: [0, 150], unit: N, comment: 'who "grips"?'}
  recipe: {robot: input_int_register_4..7, modbus: 10, owner: plc}
  warm:   {robot: output_double_register_0..1, modbus: 100, unit: "°C"}
  ready:  {robot: output_bit_register_3, modbus: 120.0}
"""


def test_each_reads_or_writes_its_register() -> None:
    controller = Registers()
    program = load(script(plan_of(VARIABLES)), **controller.functions())
    controller.values |= {"input_boolean_register 40": True, "input_float_register 2": 12.5}
    controller.values |= {f"input_integer_register {number}": number * 10 for number in range(24)}
    assert program.call("gw_read_go") is True
    assert program.call("gw_read_force") == 12.5
    assert [program.call("gw_read_recipe", index) for index in range(4)] == [40, 50, 60, 70]
    program.call("gw_write_ready", True)
    program.call("gw_write_warm", 1, 36.6)
    assert controller.values["output_boolean_register 3"] is True
    assert controller.values["output_float_register 1"] == 36.6


@pytest.mark.parametrize("index", [-1, 2])
def test_a_wrong_index_stops_the_program_before_anything_is_written(index: int) -> None:
    controller = Registers()
    program = load(script(plan_of(VARIABLES)), **controller.functions())
    with pytest.raises(Halted):
        program.call("gw_write_warm", index, 1.0)
    assert controller.values == {}
    assert controller.said == ["gw: a family has no such index"]


def test_comments_say_unit_limits_scale_place_and_owner() -> None:
    text = script(plan_of(VARIABLES))
    said = " ".join(line.lstrip("# ") for line in text.splitlines() if line.startswith("#"))
    assert (
        "force: N; limits 0..150; holding 1 (400002) int16 * 0.1; written by plc > hmi; lease 5 s; "
        "on_release clear; who 'grips'?"
    ) in said
    assert text.isascii()


@pytest.mark.parametrize("name", sorted(path.name for path in MAPPINGS.glob("*.yaml")))
def test_every_shipped_mapping_makes_a_well_formed_program(name: str) -> None:
    """With a reader or a writer for each register, and lines that fit."""
    plan = shipped(name)
    text = script(plan)
    program = load(text, **Registers().functions())
    named = {
        variable.name.partition("[")[0] for variable in plan.cell.variables if "_register_" in variable.field
    }
    for variable in named:
        assert {f"gw_read_{variable}", f"gw_write_{variable}"} & set(program.parameters)
    assert max(map(len, text.splitlines())) <= 120


def test_the_golden_program() -> None:
    """The same mapping gives the same bytes: a change of what users have in their robots shows here."""
    golden = Path(__file__).with_name("small-cell.script")
    text = script(shipped("small-cell.yaml"), handshake=("start:busy",), writer="plc")
    assert text == golden.read_text(encoding="ascii")


def test_an_unknown_writer_is_told_which_there_are() -> None:
    with pytest.raises(ExportError, match="there is no such writer: the mapping declares `plc`"):
        script(shipped("small-cell.yaml"), handshake=("start:busy",), writer="ghost")
