"""A function for each register that a robot program reads or writes, by the name that the mapping gives it.

What the functions return and take is the robot's own value: scale and offset of a mapping lie between the gateway and
the fieldbus. The comment above each says what the fieldbus sees.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from gatewayd.core.definition import Variable
from gatewayd.links.robot.urscript.registers import ScriptRegister
from gatewayd.mapping.plan import Plan
from gatewayd.report.facts import variables as facts_of
from gatewayd.report.printable import printable

_LONGEST: Final = 110
_FIRST: Final = ("unit", "limits")
"""What a comment says of a variable before everything else."""
_OMITTED: Final = frozenset({"direction", "robot", "type"})
_PREFIXES: Final = {"limits": "limits ", "owner": "written by ", "group": "group ", "on_release": "on_release ",
                "on_stale": "on_stale ", "lease": "lease ", "valid": "good while the program is "}  # fmt: skip


def accessors(registers: tuple[ScriptRegister, ...], plan: Plan, prefix: str) -> Iterator[str]:
    """The functions, each with its comment and an empty line before it."""
    facts = facts_of(plan)
    for register in registers:
        yield ""
        yield from _comment(register, facts)
        yield from _function(register, prefix)


def reader(register: ScriptRegister, prefix: str) -> str:
    """The name of the function that reads it."""
    return f"{prefix}_read_{register.name}"


def writer(register: ScriptRegister, prefix: str) -> str:
    """The name of the function that writes it."""
    return f"{prefix}_write_{register.name}"


def argument(register: ScriptRegister, variable: Variable) -> str:
    """What a call gives to name one variable of a family: `3`; empty for a variable alone."""
    return str(register.variables.index(variable)) if register.indexed else ""


def script_text(text: str) -> str:
    """A text as a comment or a string of a script can have it: one line, ASCII, without quotation marks."""
    return printable(text).replace('"', "'").encode("ascii", "backslashreplace").decode("ascii")


def _function(register: ScriptRegister, prefix: str) -> Iterator[str]:
    number = f"{register.number} + index" if register.number and register.indexed else str(register.number)
    number = "index" if register.indexed and not register.number else number
    if register.is_input:
        name, taken = reader(register, prefix), ["index"] if register.indexed else []
        call = f"return read_{register.register}({number})"
    else:
        name, taken = writer(register, prefix), ["index", "value"] if register.indexed else ["value"]
        call = f"write_{register.register}({number}, value)"
    yield f"def {name}({', '.join(taken)}):"
    if register.indexed:
        yield f"  {prefix}_check_index(index, {len(register.variables)})"
    yield f"  {call}"
    yield "end"


def index_check(prefix: str) -> tuple[str, ...]:
    """The function that stops a program which names an element that a family does not have."""
    return (
        "",
        "# stops the program: a wrong index would be another variable",
        f"def {prefix}_check_index(index, count):",
        "  if index < 0 or index >= count:",
        f'    popup("{prefix}: a family has no such index", error = True, blocking = True)',
        "    halt",
        "  end",
        "end",
    )


def _comment(register: ScriptRegister, facts: Mapping[str, Mapping[str, str]]) -> Iterator[str]:
    known = facts[register.first.name]
    order = [*_FIRST, *(fact for fact in known if fact not in _FIRST and fact not in _OMITTED)]
    texts = [f"{_PREFIXES.get(fact, '')}{known[fact]}" for fact in order if fact in known]
    many = f"[0..{len(register.variables) - 1}]" if register.indexed else ""
    yield from wrapped(f"{register.name}{many}: {'; '.join(texts)}{' (of the first)' if many else ''}")


def wrapped(text: str) -> Iterator[str]:
    """A text as comment lines of a script."""
    line = "#"
    for word in script_text(text).split():
        if len(line) + len(word) >= _LONGEST:
            yield line
            line = "#  "
        line = f"{line} {word}"
    yield line
