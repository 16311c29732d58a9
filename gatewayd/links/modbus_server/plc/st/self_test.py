"""The PLC's half of the self test: writes the values of each round, lets the robot answer, and compares what it shows.

The robot's half is `gw_self_test()` of `gatewayd export urscript`, made from the same values. What goes to the robot is
judged there, what comes from it here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from gatewayd.links.modbus_server.plc.model import PlcModel, SelfTestPlan, TestedTag
from gatewayd.plc.numbers import REALS
from gatewayd.plc.st.dialect import Dialect, elementary, literal, own, real, word
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, VariableSection, indented

_WARNING: Final = (
    "ATTENTION: it moves the values of ALL registers, and whatever acts on them moves too. Nobody in the cell, and a "
    "robot program that does nothing but the self test"
)
_ROUNDS: Final = 3
"""Rounds of requests after which everything has gone over the wire once: the first of them may have begun before."""
_INPUTS: Final = (
    PlcVariable("run", elementary("BOOL"), f"rises: begin; FALSE: stop, nothing is written. {_WARNING}"),
    PlcVariable("written", elementary("UDINT"), "of the sequence: rounds of writes that were confirmed"),
    PlcVariable("time_out", elementary("TIME"), "for one round of the test", "T#10s"),
    PlcVariable("settle", elementary("TIME"), "what is wrong for so long is wrong", "T#1s"),
)
_OUTPUTS: Final = (
    PlcVariable("busy", elementary("BOOL"), "under way: inputs are written"),
    PlcVariable("done", elementary("BOOL"), "over, right or wrong; until the next begins"),
    PlcVariable("passed", elementary("BOOL"), "over, and all that came from the robot was right"),
    PlcVariable("error", elementary("BOOL"), "over, and not passed: the reason says why"),
    PlcVariable(
        "reason",
        elementary("INT"),
        "0 none, 1 gateway or robot not to be trusted, 2 writes not confirmed, 3 robot has not acknowledged, "
        "4 values were wrong",
    ),
    PlcVariable("test_round", elementary("INT"), "which round, from 0 on"),
    PlcVariable("wrong", elementary("UDINT"), "values that were wrong, in all rounds together"),
    PlcVariable(
        "first_wrong", elementary("INT"), "number of the first variable that was wrong or refused; 0: none"
    ),
    PlcVariable("first_name", elementary("STRING"), "its name in the mapping"),
)
_STATE: Final = (
    PlcVariable("expiry", elementary("TON")),
    PlcVariable("settling", elementary("TON")),
    PlcVariable(
        "state", elementary("INT"), "0 idle, 1 data on their way, 2 waiting for the robot, 3 comparing"
    ),
    PlcVariable("ran", elementary("BOOL")),
    PlcVariable("fresh", elementary("BOOL"), "a round begins: the time-out begins anew"),
    PlcVariable("toggle", elementary("BOOL")),
    PlcVariable("mask", elementary("WORD"), "bit of the round"),
    PlcVariable("high", elementary("BOOL"), "the variable has its high value in this round"),
    PlcVariable("correct", elementary("BOOL")),
    PlcVariable("found", elementary("UDINT"), "values that are wrong in this round"),
    PlcVariable("candidate", elementary("INT"), "number of the first of them"),
    PlcVariable("since", elementary("UDINT")),
    PlcVariable("refusals", elementary("UDINT")),
)


def self_test(model: PlcModel, plan: SelfTestPlan, dialect: Dialect) -> ProgramUnit:
    """The block. It is called after the program has written its inputs, and before they are packed."""
    data = tuple(
        PlcVariable(name.lower(), own(f"{model.prefix}_{name}")) for name in ("Status", "Inputs", "Outputs")
    )
    demanded = [poll.name for poll in model.polls if poll.shared]
    more = f". Set {', '.join(f'demand_{name}' for name in demanded)} meanwhile" if demanded else ""
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{model.prefix}_SelfTest",
        (
            VariableSection("VAR_INPUT", _INPUTS),
            VariableSection("VAR_OUTPUT", _OUTPUTS),
            VariableSection("VAR_IN_OUT", data),
            VariableSection("VAR", _STATE),
        ),
        tuple(_body(model, plan, dialect)),
        comment=f"self test with the robot program's, for commissioning. {_WARNING}{more}",
    )


def _body(model: PlcModel, plan: SelfTestPlan, dialect: Dialect) -> Iterator[str]:
    acknowledge = f"outputs.{plan.acknowledge.path}"
    yield "expiry(IN := (state > 0) AND NOT fresh, PT := time_out);"
    yield f"settling(IN := (state = 3) AND (written - since >= {_ROUNDS}), PT := settle);"
    yield "fresh := FALSE;"
    yield "IF NOT run THEN"
    yield "  state := 0;"
    yield "ELSIF NOT ran THEN"
    yield from indented(list(_begin(acknowledge)))
    yield "ELSIF (state > 0) AND expiry.Q THEN"
    yield from indented(list(_expired(model)))
    yield f"ELSIF (state = 1) AND (written - since >= {_ROUNDS}) THEN"
    yield "  toggle := NOT toggle;"
    yield "  state := 2;"
    yield f"ELSIF (state = 2) AND ({acknowledge} = toggle) THEN"
    yield "  since := written;"
    yield "  state := 3;"
    yield f"ELSIF (state = 3) AND (written - since >= {_ROUNDS}) THEN"
    yield from indented(list(_compare(plan.outputs)))
    yield "  IF (found = 0) OR settling.Q THEN"
    yield from indented(list(_next_round(plan.rounds, dialect)), 2)
    yield "  END_IF;"
    yield "END_IF;"
    yield "IF (state > 0) AND NOT (status.trusted AND status.values_fresh AND status.robot_writable) THEN"
    yield "  reason := 1;"
    yield "END_IF;"
    yield "IF (state > 0) AND (reason > 0) THEN"
    yield "  error := TRUE;"
    yield "  done := TRUE;"
    yield "  state := 0;"
    yield "END_IF;"
    yield "ran := run;"
    yield "busy := state > 0;"
    yield "IF busy THEN"
    yield f"  inputs.{plan.toggle.path} := toggle;"
    yield from indented(list(_values(plan.inputs)))
    yield "END_IF;"
    yield from _name((*plan.inputs, *plan.outputs))


def _begin(acknowledge: str) -> Iterator[str]:
    yield "done := FALSE;"
    yield "passed := FALSE;"
    yield "error := FALSE;"
    yield "reason := 0;"
    yield "test_round := 0;"
    yield "wrong := 0;"
    yield "first_wrong := 0;"
    yield f"mask := {word(1)};"
    yield "refusals := status.refusals;"
    yield "since := written;"
    yield f"toggle := {acknowledge};"
    yield "fresh := TRUE;"
    yield "state := 1;"


def _expired(model: PlcModel) -> Iterator[str]:
    """The gateway names what it refused, if it was a write of this PLC."""
    yield "reason := 2;"
    yield "IF state = 2 THEN"
    yield "  reason := 3;"
    yield "ELSIF (first_wrong = 0) AND (status.refusals <> refusals)"
    yield f"  AND (status.refusal_writer = {model.writer_number}) THEN"
    yield "  first_wrong := UINT_TO_INT(status.refusal_variable);"
    yield "END_IF;"


def _compare(outputs: Iterable[TestedTag]) -> Iterator[str]:
    yield "found := 0;"
    yield "candidate := 0;"
    for tested in outputs:
        tag = tested.tag
        place = f"outputs.{tag.path}"
        yield _high(tag.number)
        if tag.type == "BOOL":
            yield f"correct := {place} = high;"
        else:
            low, high = _is_near(tested, is_high=False), _is_near(tested, is_high=True)
            yield from _either(f"correct := {low};", f"correct := {high};")
        yield "IF NOT correct THEN"
        yield "  found := found + 1;"
        yield f"  IF candidate = 0 THEN candidate := {tag.number}; END_IF;"
        yield "END_IF;"


def _is_near(tested: TestedTag, *, is_high: bool) -> str:
    tag, values = tested.tag, tested.values
    value = literal(float(values.high if is_high else values.low), tag.type)
    place = f"outputs.{tag.path}"
    if tag.type not in REALS:
        return f"{place} = {value}"
    return f"ABS({place} - {value}) <= {real(values.tolerance, tag.type)}"


def _next_round(rounds: int, dialect: Dialect) -> Iterator[str]:
    yield "wrong := wrong + found;"
    yield "IF first_wrong = 0 THEN first_wrong := candidate; END_IF;"
    yield f"mask := {dialect.shift('SHL', 'mask', '1')};"
    yield "since := written;"
    yield "fresh := TRUE;"
    yield "state := 1;"
    yield f"IF test_round < {rounds - 1} THEN"
    yield "  test_round := test_round + 1;"
    yield "ELSIF wrong > 0 THEN"
    yield "  reason := 4;"
    yield "ELSE"
    yield "  passed := TRUE;"
    yield "  done := TRUE;"
    yield "  state := 0;"
    yield "END_IF;"


def _values(inputs: Iterable[TestedTag]) -> Iterator[str]:
    """The values of the round, anew in every cycle: nobody else's stay between them."""
    for tested in inputs:
        tag, values = tested.tag, tested.values
        place = f"inputs.{tag.path}"
        yield _high(tag.number)
        if tag.type == "BOOL":
            yield f"{place} := high;"
        else:
            low, high = (literal(float(value), tag.type) for value in (values.low, values.high))
            yield from _either(f"{place} := {low};", f"{place} := {high};")


def _high(number: int) -> str:
    return f"high := (mask AND {word(number)}) <> {word(0)};"


def _either(low: str, high: str) -> Iterator[str]:
    yield "IF high THEN"
    yield f"  {high}"
    yield "ELSE"
    yield f"  {low}"
    yield "END_IF;"


def _name(members: Iterable[TestedTag]) -> Iterator[str]:
    yield "CASE first_wrong OF"
    for number, name in sorted((tested.tag.number, tested.tag.name) for tested in members):
        yield f"  {number}: first_name := '{name}';"
    yield "ELSE"
    yield "  first_name := '';"
    yield "END_CASE;"
