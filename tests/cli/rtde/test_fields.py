"""`gatewayd rtde fields` against the simulator as a process."""

from __future__ import annotations

import csv
import io
import json

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli import command
from gatewayd.rtde.fields import INPUTS, OUTPUTS
from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, Simulator, free_port


def fields(*arguments: str) -> Result:
    return CliRunner().invoke(command, ("rtde", "fields", *arguments), prog_name="gatewayd")


def place(simulator: Simulator) -> str:
    return f"{HOST}:{simulator.port}"


def test_the_catalogue_needs_no_controller() -> None:
    result = fields("--version", "5.8", "--format", "csv")
    assert result.exit_code == 0
    rows = list(csv.DictReader(io.StringIO(result.output)))
    assert {row["direction"] for row in rows} == {"input", "output"}
    assert "ft_raw_wrench" not in {row["name"] for row in rows}


def test_the_table_folds_registers() -> None:
    result = fields("--series", "e")
    assert result.exit_code == 0
    assert "output_double_register_24..47" in result.output
    assert result.output.splitlines()[0].split() == [
        "name", "direction", "type", "unit", "since", "comment",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("--series", "x", "--version", "5.12"), "is no software of series x"),
        (("--version", "4.1"), "versions begin with 3 (cb3), 5 (e), 10 (x)"),
        (("--version", "new"), "is not a software version"),
        (("--ask", "dexterity"), "name its HOST"),
        (("--probe-claims",), "name its HOST"),
        (("127.0.0.1", "--series", "e"), "leave --series and --version out"),
        (("127.0.0.1:1", "--ask", "a" * 3000), "is too long for a name of a field"),
        (("127.0.0.1:1", "--ask", "a,b"), "cannot be a name of a field"),
    ],
)
def test_wrong_usage_says_what_to_do(arguments: tuple[str, ...], words: str) -> None:
    result = fields(*arguments)
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())


def test_a_controller_is_asked_for_outputs_and_left_in_peace(plant: Plant) -> None:
    simulator = plant.simulator("--version", "5.8.0", "--field", "dexterity:DOUBLE", "--control", "stdin")
    result = fields(place(simulator), "--json")
    assert result.exit_code == 0
    document = json.loads(result.output)
    assert document["controller"].startswith("5.8.0")
    assert (document["series"], document["protocol"], document["complete"]) == ("e", 2, True)
    words = {row["name"]: row["type"] for row in document["fields"]}
    assert {row["direction"] for row in document["fields"]} == {"output"}
    assert words.keys() >= OUTPUTS.keys()
    assert (words["dexterity"], words["ft_raw_wrench"]) == ("DOUBLE", "NOT_FOUND")
    assert "claimed" not in simulator.text()


def test_claims_are_probed_where_that_is_wanted(plant: Plant) -> None:
    simulator = plant.simulator("--hold", "input_int_register_3")
    result = fields(place(simulator), "--probe-claims", "--json")
    inputs = {
        row["name"]: row["type"] for row in json.loads(result.output)["fields"] if row["direction"] == "input"
    }
    assert inputs.keys() == INPUTS.keys()
    assert [name for name, word in inputs.items() if word == "IN_USE"] == ["input_int_register_3"]


def test_the_table_says_who_answered_and_what_was_not_asked(plant: Plant) -> None:
    simulator = plant.simulator("--protocol-v1", "--series", "cb3")
    result = fields(place(simulator))
    lines = result.output.splitlines()
    assert lines[0].startswith("controller 3.")
    names = [line.split()[0] for line in lines[2:-2]]
    assert "input_bit_register_64..127" in names, (
        "families are together, in whatever lists they were asked for"
    )
    assert names.index("input_double_register_24..47") + 1 == names.index("output_bit_registers0_to_31")
    assert lines[0].endswith("series cb3, protocol 1")
    assert lines[-1] == "inputs were not asked for: only claiming shows them, which --probe-claims does"
    assert "not there" in lines[-2]


def test_who_cannot_be_reached_is_one_clear_line() -> None:
    result = fields(f"{HOST}:{free_port()}")
    assert result.exit_code == 1
    assert result.output.startswith("gatewayd: ")
    assert "its RTDE service is off" in result.output
    assert len(result.output.splitlines()) == 1
