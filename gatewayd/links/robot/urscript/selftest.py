"""A self test for commissioning: robot program and PLC go through rounds in which every register has a known value.

Each variable has two values, a low and a high one, that its limits and its places allow. In round r a variable has its
high value where bit r of its number (as `gatewayd show` counts) is set. So no two variables are alike in all rounds: an
address, a bit or a word order that is wrong is seen, with its name. The PLC leads by a handshake towards the robot: it
writes its values, then changes the toggle; the robot compares, writes its own values, and acknowledges; the PLC
compares.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from gatewayd.core.definition import Value, ValueKind, Variable
from gatewayd.links.robot.urscript.accessors import argument, reader, writer
from gatewayd.links.robot.urscript.handshake import Handshake
from gatewayd.links.robot.urscript.registers import ScriptRegister

_HIGH: Final = (16909060, 258, 3, 1)
"""Values whose bytes differ (01 02 03 04h, 01 02h) show a wrong order; smaller ones are for narrow limits."""
_APART: Final = 4
"""A real is right within this part of the distance between its values: registers may round it."""


@dataclass(frozen=True, slots=True)
class SelfTestValues:
    """What a variable has in a round, by one bit of its number."""

    low: Value
    high: Value

    def of_round(self, number: int, test_round: int) -> Value:
        """The value in a round of the variable with this number."""
        return self.high if number >> test_round & 1 else self.low

    @property
    def tolerance(self) -> float:
        """How far a value may be off."""
        return abs(float(self.high) - float(self.low)) / _APART


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


def rounds(members: Sequence[RegisterUnderTest]) -> int:
    """How many rounds tell all of them apart; in the last one all have their low value."""
    return max((member.variable.number for member in members), default=0).bit_length() + 1


def values_of(variable: Variable) -> SelfTestValues:
    """The values of a variable: within its limits, its type, and what all its places can show."""
    if variable.kind is ValueKind.BOOL:
        return SelfTestValues(low=False, high=True)
    least, greatest = _range(variable)
    low: float = 0 if least <= 0 <= greatest else _whole(least, greatest)
    fitting = (value for value in _HIGH if least <= value <= greatest and value != low)
    high = next(fitting, _other_end(low, least, greatest))
    if variable.kind is ValueKind.FLOAT:
        return SelfTestValues(float(low), float(high))
    return SelfTestValues(round(low), round(high))


def _range(variable: Variable) -> tuple[float, float]:
    ends = [(variable.low, variable.high), variable.shown or (None, None)]
    if variable.limits is not None:
        ends.append((variable.limits.low, variable.limits.high))
    least = max((low for low, _ in ends if low is not None), default=-math.inf)
    greatest = min((high for _, high in ends if high is not None), default=math.inf)
    return least, greatest


def _whole(least: float, greatest: float) -> float:
    """A whole number near the end that is nearer to 0; the end itself where there is none."""
    near = math.ceil(least) if least > 0 else math.floor(greatest)
    return near if least <= near <= greatest else (least if least > 0 else greatest)


def _other_end(low: float, least: float, greatest: float) -> float:
    return greatest if low != greatest and math.isfinite(greatest) else least


def _literal(value: Value) -> str:
    """A number as a script has it: a float keeps its point."""
    return repr(value)


def functions(
    members: Sequence[RegisterUnderTest], pair: Handshake, prefix: str, writers: Sequence[str]
) -> Iterator[str]:
    """The self test, with the table that its counterpart in the PLC needs."""
    yield from _table(members, pair, prefix, writers)
    yield from _helpers(prefix)
    yield from _compared([member for member in members if member.register.is_input], prefix)
    yield from _written([member for member in members if not member.register.is_input], prefix)
    yield from _loop(rounds(members), pair, prefix)


def _table(
    members: Sequence[RegisterUnderTest], pair: Handshake, prefix: str, writers: Sequence[str]
) -> Iterator[str]:
    toggle, acknowledge = pair.toggle_bit.name, pair.acknowledge_bit.name
    yield from (
        "",
        f"# Self test, for commissioning. The PLC leads, in rounds 0 to {rounds(members) - 1}:",
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
