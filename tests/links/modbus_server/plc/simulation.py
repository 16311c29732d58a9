"""Function blocks put into Python statement by statement, with a clock of their own, to be stepped through."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from types import SimpleNamespace
from typing import Any

from gatewayd.plc.model import Tag, TagFamily
from gatewayd.plc.st.program import ProgramUnit

CYCLE = 10
"""Milliseconds from call to call."""
WORDS = (
    (r" / ", " // "),
    (r"\bMOD\b", "%"),
    (r"\b(?:WORD|DWORD)#16#([0-9A-F]+)", r"0x\1"),
    (r"\b(?:UDINT|L?REAL)#", ""),
    (r"\bAND (?=0x)", "& "),
    ("<>", "!="),
    (r"(?<![<>!:=])=(?!=)", "=="),
    (r"\bAND\b", "and"),
    (r"\bOR\b", "or"),
    (r"\bNOT\b", "not"),
    (r"\bTRUE\b", "True"),
    (r"\bFALSE\b", "False"),
)


FUNCTIONS: Mapping[str, object] = {
    "ABS": abs,
    "SHL": lambda word, by: word << by & 0xFFFF,
    "UINT_TO_INT": int,
}
"""Of the standard, as the blocks use them."""


class Timer:
    """TON."""

    def __init__(self) -> None:
        self.Q, self.elapsed = False, 0

    def tick(self, running: bool, limit: int) -> None:
        self.elapsed = self.elapsed + CYCLE if running else 0
        self.Q = self.elapsed > limit


def instance(
    unit: ProgramUnit, known: Mapping[str, object] | None = None, /, **values: object
) -> tuple[Any, Callable[[], None]]:
    """The variables of a block, and its call; `known`: names that it uses, and what they are."""
    fields = [field for section in unit.sections for field in section.fields]
    starts = {"TON": Timer, "BOOL": bool, "STRING": str}
    present = SimpleNamespace(**{field.name: starts.get(field.type.name, int)() for field in fields})
    vars(present).update(values)
    names = re.compile(rf"(?<![\w.])({'|'.join(field.name for field in fields)})\b")
    code = compile("\n".join(_lines(unit, names)), unit.name, "exec")

    def call() -> None:
        exec(code, {**FUNCTIONS, **(known or {}), "own": present})  # noqa: S102 - generated here

    return present, call


def structure(families: Iterable[TagFamily]) -> SimpleNamespace:
    """A variable of the data type with these members, all 0."""
    return SimpleNamespace(
        **{family.name: [0] * len(family.tags) if family.is_array else 0 for family in families}
    )


def assign(values: SimpleNamespace, tag: Tag, value: object) -> None:
    """`values.tag := value`."""
    if tag.element is None:
        setattr(values, tag.member, value)
    else:
        getattr(values, tag.member)[tag.element] = value


def value_in(values: SimpleNamespace, tag: Tag) -> Any:
    """`values.tag`."""
    member = getattr(values, tag.member)
    return member if tag.element is None else member[tag.element]


def _lines(unit: ProgramUnit, names: re.Pattern[str]) -> list[str]:
    lines: list[str] = []
    open_blocks: list[str] = []

    def put(text: str, less: int = 0) -> None:
        depth = sum(kind != "CASE" for kind in open_blocks)
        lines.append("  " * (depth - less) + text)

    for statement in _statements(unit.body):
        if match := re.match(r"(IF|WHILE) (.*) (?:THEN|DO)$", statement):
            put(f"{match[1].lower()} {_expression(match[2], names)}:")
            open_blocks.append(match[1])
        elif match := re.match(r"FOR (\w+) := (\d+) TO (\d+) DO$", statement):
            put(f"for own.{match[1]} in range({match[2]}, {match[3]} + 1):")
            open_blocks.append("FOR")
        elif match := re.match(r"ELSIF (.*) THEN$", statement):
            put(f"elif {_expression(match[1], names)}:", 1)
        elif match := re.match(r"CASE (.*) OF$", statement):
            put(f"case = {_expression(match[1], names)}")
            put("if False: pass")
            open_blocks.append("CASE")
        elif match := re.match(r"(\d+): ([\w.\[\]]+) := (.*)$", statement):
            put(f"elif case == {match[1]}: {_expression(f'{match[2]} := {match[3]}', names)}")
        elif statement == "ELSE":
            is_case = open_blocks[-1] == "CASE"
            put("else:", 0 if is_case else 1)
            open_blocks[-1] = "OTHERWISE" if is_case else open_blocks[-1]
        elif statement.startswith("END_"):
            open_blocks.pop()
        else:
            put(_simple(statement, names))
    return lines


def _simple(statement: str, names: re.Pattern[str]) -> str:
    """A call of a timer, or an assignment."""
    if match := re.match(r"(\w+)\(IN := (.*), PT := (.*)\)$", statement):
        return f"own.{match[1]}.tick({_expression(match[2], names)}, {_expression(match[3], names)})"
    target, _, value = statement.partition(" := ")
    return f"{_expression(target, names)} = {_expression(value, names)}"


def _statements(lines: Iterable[str]) -> list[str]:
    """Without their ends; one that goes on in the next line is one."""
    found: list[str] = []
    split = (re.sub(r"( THEN|;) (?=\S)", r"\1\n", line.strip()) for line in lines)
    for line in (line.rstrip(";") for text in split for line in text.split("\n")):
        if line.startswith("AND "):
            found[-1] += f" {line}"
        else:
            found.append(line)
    return found


def _expression(text: str, names: re.Pattern[str]) -> str:
    """What stands in quotes stays as it is."""
    code, quote, rest = text.partition("'")
    for pattern, replacement in WORDS:
        code = re.sub(pattern, replacement, code)
    # Operands by name, and assignments.
    return names.sub(r"own.\1", code).replace(" := ", "=") + quote + rest
