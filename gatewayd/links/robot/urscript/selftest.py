"""The robot's half of the self test for commissioning; values and rounds are those of `links.robot_program`.

The PLC leads by a handshake towards the robot: it writes its values, then changes the toggle; the robot compares,
writes its own values, and acknowledges; the PLC compares.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gatewayd.core.definition import Value, ValueKind, Variable
from gatewayd.links.robot.urscript.accessors import argument, reader, writer
from gatewayd.links.robot.urscript.handshake import Handshake
from gatewayd.links.robot.urscript.registers import ScriptRegister
from gatewayd.links.robot_program import SelfTestValues, values_of


@dataclass(frozen=True, slots=True)
class RegisterUnderTest:
    """One variable of the self test."""

    register: ScriptRegister
    variable: Variable
    values: SelfTestValues


def in_test(registers: Sequence[ScriptRegister], pair: Handshake) -> tuple[RegisterUnderTest, ...]:
    """The variables that take part: all but the bits of the handshake."""
    bits = {pair.toggle_bit.number, pair.acknowledge_bit.number}
    return tuple(
        RegisterUnderTest(register, variable, values_of(variable))
        for register in registers
        for variable in register.variables
        if variable.number not in bits
    )


def _literal(value: Value) -> str:
    """A number as a script has it: a float keeps its point."""
    return repr(value)


def functions(
    members: Sequence[RegisterUnderTest], count: int, pair: Handshake, prefix: str, writers: Sequence[str]
) -> Iterator[str]:
    """The self test in so many rounds, with the table that its counterpart in the PLC needs."""
    yield from _table(members, count, pair, prefix, writers)
    yield from _helpers(prefix)
    yield from _compared([member for member in members if member.register.is_input], prefix)
    yield from _written([member for member in members if not member.register.is_input], prefix)
    yield from _loop(count, pair, prefix)


def _table(
    members: Sequence[RegisterUnderTest], count: int, pair: Handshake, prefix: str, writers: Sequence[str]
) -> Iterator[str]:
    toggle, acknowledge = pair.toggle_bit.name, pair.acknowledge_bit.name
    yield from (
        "",
        f"# Self test, for commissioning. The PLC leads, in rounds 0 to {count - 1}:",
        "#   1. it writes all values of the round that go to the robot",
        f"#   2. it changes {toggle}, and waits until {acknowledge} is equal to it",
        "#   3. it compares all values of the round that come from the robot",
        "# In round r a variable has its high value where bit r of its number is set, else its low one.",
        f"# Call {prefix}_self_test() in a program that does nothing else: it writes every output register, which",
        "# has its low value in the end; and nothing may act on the inputs meanwhile.",
        *([f"# Inputs are those of {', '.join(writers)}."] if writers else ()),
        "#",
        "#   number  low        high         variable",
    )
    for member in members:
        variable, values = member.variable, member.values
        way = "to the robot" if member.register.is_input else "from the robot"
        low, high = _literal(values.low), _literal(values.high)
        yield f"#   {variable.number:<6}  {low:<9}  {high:<11}  {variable.name}, {way}"


def _helpers(prefix: str) -> Iterator[str]:
    yield from (
        "",
        f"def {prefix}_test_bit(number, step):",
        "  local rest = number",
        "  local left = step",
        "  while left > 0:",
        "    rest = floor(rest / 2)",
        "    left = left - 1",
        "  end",
        "  return rest - 2 * floor(rest / 2) > 0",
        "end",
        "",
        f"def {prefix}_test_value(number, step, low, high):",
        f"  if {prefix}_test_bit(number, step):",
        "    return high",
        "  end",
        "  return low",
        "end",
        "",
        "# 1 and a line in the log for a bit that is wrong, else 0",
        f"def {prefix}_test_flag(name, found, number, step):",
        f"  if found == {prefix}_test_bit(number, step):",
        "    return 0",
        "  end",
        f'  textmsg("{prefix} self test, wrong: ", name)',
        "  return 1",
        "end",
        "",
        f"def {prefix}_test_number(name, found, number, step, low, high, tolerance):",
        f"  local expected = {prefix}_test_value(number, step, low, high)",
        "  if found >= expected - tolerance and found <= expected + tolerance:",
        "    return 0",
        "  end",
        f'  textmsg("{prefix} self test, wrong: ", name)',
        '  textmsg("  found ", found)',
        '  textmsg("  expected ", expected)',
        "  return 1",
        "end",
    )


def _compared(members: Sequence[RegisterUnderTest], prefix: str) -> Iterator[str]:
    yield from ("", f"def {prefix}_test_inputs(step):", "  local wrong = 0")
    for member in members:
        variable = member.variable
        found = f"{reader(member.register, prefix)}({argument(member.register, variable)})"
        call = f'"{variable.name}", {found}, {variable.number}, step'
        if variable.kind is ValueKind.BOOL:
            yield f"  wrong = wrong + {prefix}_test_flag({call})"
        else:
            low, high = _literal(member.values.low), _literal(member.values.high)
            tolerance = 0 if variable.kind is ValueKind.INT else member.values.tolerance
            yield f"  wrong = wrong + {prefix}_test_number({call}, {low}, {high}, {tolerance!r})"
    yield from ("  return wrong", "end")


def _written(members: Sequence[RegisterUnderTest], prefix: str) -> Iterator[str]:
    yield from ("", f"def {prefix}_test_outputs(step):")
    for member in members:
        variable = member.variable
        if variable.kind is ValueKind.BOOL:
            value = f"{prefix}_test_bit({variable.number}, step)"
        else:
            low, high = _literal(member.values.low), _literal(member.values.high)
            value = f"{prefix}_test_value({variable.number}, step, {low}, {high})"
        index = argument(member.register, variable)
        yield f"  {writer(member.register, prefix)}({f'{index}, ' if index else ''}{value})"
    yield from ("  return True", "end")


def _loop(count: int, pair: Handshake, prefix: str) -> Iterator[str]:
    name = pair.name
    yield from (
        "",
        "# the number of inputs that were wrong, in all rounds together; the log has their names",
        f"def {prefix}_self_test():",
        "  local wrong = 0",
        "  local step = 0",
        f"  while step < {count}:",
        f"    {prefix}_wait_{name}()",
        f"    wrong = wrong + {prefix}_test_inputs(step)",
        f"    {prefix}_test_outputs(step)",
        "    sync()",
        f"    {prefix}_acknowledge_{name}()",
        "    step = step + 1",
        "  end",
        f'  textmsg("{prefix} self test, wrong values: ", wrong)',
        "  return wrong",
        "end",
    )
