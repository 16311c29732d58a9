"""From a mapping to what the program of its node's master needs: places, writers, what is left out and refused."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gatewayd.core.definition import Writer
from gatewayd.links.canopen_node.plc.build import model_of
from gatewayd.links.canopen_node.plc.registry import REFUSED, files_for
from gatewayd.links.exports import ExportError
from gatewayd.plc.export import TARGETS
from gatewayd.plc.tags import PlcWishes
from tests.links.canopen_node.plc.cells import model, plan_of
from tests.plc_golden import canopen_model

START = "start: {robot: input_bit_register_0, canopen: auto, owner: plc}"
TEMPERATURE = "t: {robot: output_double_register_0, canopen: {type: INTEGER16, scale: 0.1}, unit: K}"


def test_places_are_those_of_the_pdos() -> None:
    found = canopen_model()
    places = {tag.name: tag.notation for family in (*found.inputs, *found.outputs) for tag in family.tags}
    assert places["toggle"] == "RPDO 1 byte 0 bit 1 (2000h:02)"
    assert places["width"] == "TPDO 4 byte 4 (2470h:01)"
    assert places["pose[3]"] == "TPDO 9 byte 4 (2430h:04)"
    words = {word.object_name: (word.pdo, word.byte) for pdo in found.from_node for word in pdo.words}
    assert words["status_fingerprint"] == ("tpdo1", 4)
    assert words["quality_11"] == ("tpdo4", 0)


def test_what_is_in_no_pdo_is_named() -> None:
    assert canopen_model().left_out == ("`hidden`: in no TPDO",)


def test_families_are_arrays_whatever_pdos_they_are_in() -> None:
    pose = next(family for family in canopen_model().outputs if family.name == "pose")
    assert (pose.type, len(pose.tags), {tag.notation[:7] for tag in pose.tags}) == (
        "REAL",
        6,
        {"TPDO 8 ", "TPDO 9 ", "TPDO 10"},
    )


def test_a_program_that_only_reads_gets_no_rpdo() -> None:
    found = model(START, TEMPERATURE, wishes=PlcWishes(writer="none"))
    assert (found.inputs, found.to_node) == ((), ())
    assert found.left_out == ("`start`: in no RPDO of this PLC",)


def test_a_scaled_number_is_a_real() -> None:
    (family,) = model(TEMPERATURE).outputs
    assert (family.type, family.tags[0].arithmetic) == ("REAL", "REAL")


@pytest.mark.parametrize(
    "wishes, message",
    [
        (
            PlcWishes(writer="hmi"),
            "`hmi` is no writer on CANopen, by RPDO: --writer is one of `plc` or `none`",
        ),
        (PlcWishes(host="192.0.2.1"), "--host is for Modbus"),
        (PlcWishes(handshake="start:seen"), "--handshake is for Modbus"),
        (PlcWishes(names={"stop": "halt"}), "--name stop=halt: there is no `stop`"),
    ],
)
def test_wishes_that_cannot_be_met(wishes: PlcWishes, message: str) -> None:
    with pytest.raises(ExportError, match=message.replace("(", r"\(")):
        model_of(plan_of(START, TEMPERATURE), wishes)


def test_members_that_would_be_the_same_are_refused() -> None:
    """An element of an array has a member of its own in the structure of its PDO."""
    lines = (
        "a: {robot: 'output_int_register_0..1', canopen: {type: INTEGER16}}",
        "a_1: {robot: output_int_register_2, canopen: {type: INTEGER16}}",
    )
    with pytest.raises(ExportError, match=r"would be the same member `a_1`.*--name a_1=NAME"):
        model(*lines)


def test_a_variable_called_like_a_word_of_the_status_beside_it_is_refused() -> None:
    """In the structure of the PDO each has a member."""
    lines = (
        "quality_2: {robot: output_int_register_0, canopen: {type: INTEGER16}}",
        "status_flags: {robot: output_int_register_1, canopen: {type: INTEGER16}}",
    )
    state = "state: {status: [flags, quality of status_flags], variables: [quality_2, status_flags]}"
    with pytest.raises(ExportError) as caught:
        model(*lines, settings=f", pdos: {{{state}}}")
    assert str(caught.value).splitlines() == [
        f"tpdo1: `{name}` and {word} would be the same member `{name}`: "
        f"call one of them otherwise here: --name {name}=NAME"
        for name, word in (
            ("quality_2", "the quality of status_flags"),
            ("status_flags", "the flags of the status"),
        )
    ]


def test_names_that_differ_in_capitals_only_are_refused_with_all_else() -> None:
    found = model(
        "Ready: {robot: output_bit_register_0, canopen: auto}",
        "ready: {robot: output_bit_register_1, canopen: auto}",
        "step: {robot: output_bit_register_2, canopen: auto}",
    )
    with pytest.raises(
        ExportError, match=r"(?s)`ready` differs from `Ready` in capitals only.*`step` is a word"
    ):
        files_for("iec-st", found)


def test_a_writer_on_another_link_is_said_to_be_one() -> None:
    plan = plan_of(START, TEMPERATURE, settings="")
    cell = replace(plan.cell, writers=(*plan.cell.writers, Writer("hmi")))
    with pytest.raises(ExportError, match=r"`hmi` is no writer on CANopen.* on another link"):
        model_of(replace(plan, cell=cell), PlcWishes(writer="hmi"))


@pytest.mark.parametrize("target", sorted(REFUSED))
def test_what_is_no_master_is_refused_with_a_remedy(target: str) -> None:
    assert target in TARGETS
    with pytest.raises(ExportError, match=r"no CANopen master: .*Modbus TCP"):
        files_for(target, canopen_model())


def test_small_controllers_are_told_what_canopen_calls_it() -> None:
    with pytest.raises(ExportError, match=r"`energy` is LREAL.*`type: REAL32`"):
        files_for("codesys", canopen_model(), small=True)
