"""What a target cannot hold is refused with a remedy, all of it at once."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace

import pytest

from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.registry import files_for
from gatewayd.links.modbus_server.plc.targets.iec_st import HOLDS
from gatewayd.plc import keywords
from gatewayd.plc.names import refuse_unfit
from gatewayd.plc.tags import PlcWishes
from tests.links.modbus_server.plc.cells import model


def variable(name: str, number: int = 0) -> str:
    return f"{name}: {{robot: output_bit_register_{number}, modbus: 100.{number}}}"


def problem(found: PlcModel, *, small: bool = False) -> str:
    with pytest.raises(ExportError) as caught:
        refuse_unfit(found, HOLDS, small=small)
    return str(caught.value)


@pytest.mark.parametrize(
    "name, text",
    [
        (
            "a" * 33,
            "has 33 characters, edition 2 takes 32: rename it in the mapping, or call it otherwise here",
        ),
        ("Step", "is a word of edition 2's language"),
        ("double__line", "no double `_`"),
        ("last_", "none at the end"),
    ],
)
def test_names_that_the_tool_does_not_take(name: str, text: str) -> None:
    assert text in problem(model(variable(name)))


def test_the_longest_name_that_it_takes() -> None:
    refuse_unfit(model(variable("a" * 32)), HOLDS, small=False)


def test_a_program_with_nothing_to_read_or_to_write() -> None:
    """Its data types would have no members."""
    start = "start: {robot: input_bit_register_0, modbus: 0.0, owner: plc}"
    text = problem(model(start, wishes=PlcWishes(writer="none")))
    assert text.startswith("there is nothing for this PLC to read or to write: `start`: ")


def test_names_that_differ_in_capitals_only() -> None:
    assert "`ready` differs from `Ready` in capitals only" in problem(
        model(variable("Ready"), variable("ready", 1))
    )


COMPILER = shutil.which("cc")


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
def test_no_variable_is_called_like_a_macro_that_the_header_brings_along() -> None:
    """A member `NAN` or `linux` would be a number to the compiler."""
    (header,) = files_for("c", model(variable("ready")))
    command = [COMPILER or "", "-std=gnu17", "-dM", "-E", "-x", "c", "-"]
    done = subprocess.run(command, input=header.content(), capture_output=True, check=True)
    names = [line.split()[1] for line in done.stdout.decode().splitlines()]
    plain = {name.lower() for name in names if name[0].isalpha() and "(" not in name}
    assert {name for name in plain if not name.startswith("gw_")} <= keywords.C


@pytest.mark.parametrize(
    "names", [{"ready": "other"}, {"ready": "both", "other": "both"}, {"other": "ready"}], ids=str
)
def test_two_variables_that_would_be_called_alike(names: dict[str, str]) -> None:
    """They would be one member, and one of them would be lost."""
    with pytest.raises(
        ExportError, match=r"`ready` and `other` would both be called `\w+`: .* --name \w+=NAME"
    ):
        model(variable("ready"), variable("other", 1), wishes=PlcWishes(writer="plc", names=names))


def test_variables_may_change_their_names_for_one_another() -> None:
    names = {"ready": "other", "other": "ready"}
    (first, second) = model(
        variable("ready"), variable("other", 1), wishes=PlcWishes(writer="plc", names=names)
    ).outputs
    assert (first.name, first.tags[0].name, second.name) == ("other", "ready", "ready")


def test_everything_is_said_at_once_and_bounded() -> None:
    text = problem(model(*(variable(f"a{number}_", number) for number in range(14))))
    assert len(text.splitlines()) == 11
    assert text.endswith("and 4 more")


def test_small_controllers_have_no_numbers_of_64_bits() -> None:
    found = model(
        "a: {robot: output_double_register_0, modbus: {holding: 10, type: int64}}",
        "b: {robot: output_double_register_1, modbus: {holding: 20, type: float64}}",
        "c: {robot: output_double_register_2, modbus: {holding: 30, type: int32, scale: 0.1}}",
    )
    refuse_unfit(found, HOLDS, small=False)
    lines = problem(found, small=True).splitlines()
    assert lines[0] == (
        "`a` is LINT, which controllers without 64-bit numbers do not have: give its place `type: int32`"
    )
    assert lines[1].endswith("give its place `type: float32`")
    assert lines[2].endswith("`type: float32` without a scale, or `type: int16` with one")


@pytest.mark.parametrize("prefix", ["", "1A", "SEVENTH", "A_", "Ä"])
def test_prefix(prefix: str) -> None:
    found = replace(model(variable("ready"), wishes=PlcWishes(writer="plc")), prefix=prefix)
    assert "is no prefix" in problem(found)


def test_a_name_given_here_is_refused_by_what_the_mapping_calls_it() -> None:
    """`--name step=NAME` would be refused again: the mapping has no `step`."""
    found = model(variable("start"), wishes=PlcWishes(writer="plc", names={"start": "step"}))
    assert problem(found).endswith("`start` of the mapping needs another name here: --name start=NAME")
