"""Which place a variable has in the PLC, and of which type its value is."""

from __future__ import annotations

import pytest

from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.plc.tags import PlcWishes
from tests.links.modbus_server.plc.cells import model, plan_of


@pytest.mark.parametrize(
    "place, kind, arithmetic",
    [
        ("100.0", "BOOL", ""),
        ("{holding: 100, type: int16}", "INT", ""),
        ("{holding: 100, type: uint64}", "ULINT", ""),
        ("{holding: 100.low, type: int8}", "SINT", ""),
        ("{holding: 100, type: bool}", "BOOL", ""),
        ("{holding: 100, type: float32}", "REAL", ""),
        ("{holding: 100, type: int16, scale: 0.1}", "REAL", "REAL"),
        ("{holding: 100, type: float64, scale: 2}", "LREAL", "LREAL"),
        ("{holding: 100, type: int32, scale: 0.1}", "LREAL", "LREAL"),
        ("{holding: 100, type: int16, scale: 0.001, offset: 100000}", "LREAL", "LREAL"),
    ],
)
def test_type_of_a_value(place: str, kind: str, arithmetic: str) -> None:
    """A scaled value is a REAL only where that tells all of them apart."""
    robot = "output_bit_register_0" if place == "100.0" else "output_double_register_0"
    ((member,),) = (model(f"a: {{robot: {robot}, modbus: {place}}}").outputs,)
    (tag,) = member.tags
    assert (tag.type, tag.arithmetic) == (kind, arithmetic)


def test_registers_are_preferred() -> None:
    (member,) = model("a: {robot: output_bit_register_0, modbus: [{discrete: 3}, 100.5]}").outputs
    assert member.tags[0].notation == "400101.5 (100.5)"


def test_a_truth_is_not_scaled() -> None:
    plan = plan_of("a: {robot: output_double_register_0, modbus: {holding: 1, type: bool, scale: 2}}")
    with pytest.raises(ExportError, match="strike `scale` and `offset`"):
        model_of(plan, PlcWishes(writer="plc"))


def test_a_family_is_an_array() -> None:
    (member,) = model("q: {robot: actual_q, modbus: {holding: 10, type: float32}}").outputs
    assert (member.is_array, [tag.path for tag in member.tags][:2]) == (True, ["q[0]", "q[1]"])
