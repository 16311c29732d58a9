"""From a compiled mapping to the model of one PLC."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.links.modbus_server.plc.model import Poll
from gatewayd.mapping.plan import Plan
from gatewayd.plc.tags import PlcWishes
from tests.links.modbus_server.plc.cells import model, plan_of

START = "start: {robot: input_bit_register_0, modbus: 0.0, owner: plc}"
JOG = "jog: {robot: input_bit_register_1, modbus: 1.0, owner: hmi}"
READY = "ready: {robot: output_bit_register_0, modbus: 100.0}"
TCP = "tcp: {robot: actual_TCP_pose, modbus: {holding: 110, type: float32}, unit: m}"


def refused(*lines: str, wishes: PlcWishes) -> str:
    with pytest.raises(ExportError) as caught:
        model_of(plan_of(*lines), wishes)
    return str(caught.value)


def test_a_writer_gets_what_it_may_write_and_everything_to_read() -> None:
    found = model(START, JOG, READY)
    assert [member.name for member in found.inputs] == ["start"]
    assert [member.name for member in found.outputs] == ["ready"]
    assert (found.writer, found.writer_number, found.timeout) == ("plc", 1, 1.0)
    assert found.left_out == ("`jog`: not written by this PLC",)
    assert (found.source, found.variables) == ("press-3.yaml", ("start", "jog", "ready"))


def test_a_program_may_only_read() -> None:
    found = model(START, READY, wishes=PlcWishes(writer="none"))
    assert (found.inputs, found.writer, found.writes) == ((), "", ())


@pytest.mark.parametrize("host", ["", "192.0.2.1';x:=1", "a b", "a\nb", "ä.example", "$N", "x" * 254])
def test_an_address_that_could_end_a_text_of_the_program_is_refused(host: str) -> None:
    assert "--host takes an IP address" in refused(READY, wishes=PlcWishes(writer="none", host=host))
    assert (
        model(READY, wishes=PlcWishes(writer="none", host="gw-3.plant.example")).host == "gw-3.plant.example"
    )
    assert model(READY, wishes=PlcWishes(writer="none", host="fe80::1%eth0")).host == "fe80::1%eth0"


def test_no_address_is_made_up_where_the_gateway_listens_at_all() -> None:
    plan = plan_of(READY)
    everywhere = Plan(
        plan.source,
        plan.cell,
        {name: replace(link, host="0.0.0.0") for name, link in plan.of(ModbusPlan).items()},
    )
    with pytest.raises(ExportError, match="say with --host"):
        model_of(everywhere, PlcWishes(writer="none"))
    assert model_of(everywhere, PlcWishes(writer="none", host="192.0.2.7")).host == "192.0.2.7"


def test_who_the_plc_is_has_to_be_said() -> None:
    assert "--writer: `plc`, `hmi` or `none`" in refused(START, wishes=PlcWishes())
    assert "`plx` is no writer on Modbus" in refused(START, wishes=PlcWishes(writer="plx"))


def test_a_cell_without_modbus_is_refused() -> None:
    plan = plan_of(START)
    with pytest.raises(ExportError, match="no Modbus server: add `modbus"):
        model_of(Plan(plan.source, plan.cell), PlcWishes())


def test_a_variable_may_have_another_name_in_the_plc() -> None:
    wishes = PlcWishes(writer="plc", names={"tcp": "pose"})
    (pose,) = model(TCP, wishes=wishes).outputs
    assert (pose.name, pose.tags[5].path, pose.tags[5].name) == ("pose", "pose[5]", "tcp[5]")
    assert "did you mean `tcp`?" in refused(TCP, wishes=PlcWishes(writer="plc", names={"tpc": "pose"}))


def test_the_address_of_the_gateway() -> None:
    assert model(START).host == "127.0.0.1"
    assert model(START, wishes=PlcWishes(writer="plc", host="192.0.2.7")).host == "192.0.2.7"


def test_every_word_of_the_status_block_has_its_place() -> None:
    found = model(START, READY)
    assert found.array_of(2) == ("status1", 2)
    assert found.array_of(3264) == ("status2", 0)
    with pytest.raises(KeyError):
        found.array_of(70)
    polls: tuple[Poll, ...] = found.status
    assert [(poll.address, poll.count) for poll in polls] == [(60000, 65), (63264, 2), (60192, 2)]
