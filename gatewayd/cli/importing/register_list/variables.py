"""Places of a register list as variables: rows of one name are one variable, `recipe[0]` and its followers one line.

A list that names no field of the robot gets the next free registers of the program, by the type of its numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from gatewayd.cli.importing.register_list.findings import ListFindings
from gatewayd.cli.importing.register_list.rows import ListedPlace

_ELEMENT = re.compile(r"(.+)\[(\d+)\]")
_NUMBERED = re.compile(r"(?P<head>.*?(?:_register_|\[|\.))(?P<number>\d+)(?P<tail>\]?)")
_MAX_REGISTERS: Final = {"bit": 64, "int": 24, "double": 24}
"""Registers of each kind that no URCap claims; bits are those of two words."""


@dataclass(frozen=True, slots=True)
class ListedLine:
    """One line of the mapping: a variable, or a family of variables."""

    name: str
    robot: str
    """As the mapping names it: `output_int_register_0..23`."""
    places: tuple[ListedPlace, ...]
    """Of the variable, of a family those of its first element."""
    rows: tuple[ListedPlace, ...]
    """All of them."""

    @property
    def first(self) -> ListedPlace:
        """Its first row."""
        return self.rows[0]


def lines(found: Sequence[ListedPlace], findings: ListFindings) -> list[ListedLine]:
    """The lines of the mapping, in the order of the list."""
    variables = _variables(_with_registers(found, findings), findings)
    made: dict[str, list[tuple[ListedPlace, ...]]] = {}
    for rows in variables:
        made.setdefault(_base(rows[0].name), []).append(rows)
    return [_line(base, members, findings) for base, members in made.items()]


def _variables(found: Sequence[ListedPlace], findings: ListFindings) -> list[tuple[ListedPlace, ...]]:
    """Rows of one name follow each other and speak of one field: they are one variable at several places."""
    made: dict[str, list[ListedPlace]] = {}
    last = ""
    for place in found:
        known = made.setdefault(place.name, [])
        if known and (last != place.name or known[0].robot != place.robot):
            line = known[0].row.line
            findings.error(
                place.row.place("name"), f"`{place.name}` is in line {line} already", "give it another name"
            )
        if any(not place.row.text("robot") and place.area == other.area for other in known):
            text = f"`{place.name}` is in line {known[0].row.line} already: one value at two addresses"
            findings.doubt(place.row.place("name"), text, "give it another name if that is another value")
        known.append(place)
        last = place.name
    return [tuple(rows) for rows in made.values()]


def _base(name: str) -> str:
    element = _ELEMENT.fullmatch(name)
    return name if element is None else element[1]


def _line(base: str, members: Sequence[tuple[ListedPlace, ...]], findings: ListFindings) -> ListedLine:
    first = members[0]
    rows = tuple(row for member in members for row in member)
    if first[0].name == base:
        for member in members[1:]:
            text = f"`{member[0].name}` beside `{base}`"
            findings.error(member[0].row.place("name"), text, "give one of them another name")
        return ListedLine(base, first[0].robot, first, rows)
    for index, member in enumerate(members):
        if member[0].name != f"{base}[{index}]":
            text = f"`{member[0].name}` where `{base}[{index}]` would follow"
            findings.error(member[0].row.place("name"), text, "number the elements from 0, without a gap")
            break
    return ListedLine(base, _range([member[0] for member in members], findings), first, rows)


def _range(members: Sequence[ListedPlace], findings: ListFindings) -> str:
    """`output_int_register_0..23`, `actual_q[0..5]`, `actual_digital_input_bits.0..7`."""
    found = [_NUMBERED.fullmatch(member.robot) for member in members]
    first, last = found[0], found[-1]
    if first is None or last is None:
        findings.error(
            members[0].row.place("robot"), f"`{members[0].robot}` has no numbered neighbours", _ALONE
        )
        return members[0].robot
    start = int(first["number"])
    for index, (member, match) in enumerate(zip(members, found, strict=True)):
        if match is None or (match["head"], int(match["number"])) != (first["head"], start + index):
            findings.error(
                member.row.place("robot"), f"`{member.robot}` does not follow the one before", _ALONE
            )
            break
    return f"{first['head']}{start}..{last['number']}{first['tail']}"


_ALONE: Final = "give the variable a name without an index"


def _with_registers(found: Sequence[ListedPlace], findings: ListFindings) -> list[ListedPlace]:
    """The same with a register of the program for each variable that has no field."""
    free = {(side, kind): 0 for side in ("input", "output") for kind in _MAX_REGISTERS}
    chosen: dict[str, str] = {}
    return [
        place if place.robot else replace(place, robot=_register(place, free, chosen, findings))
        for place in found
    ]


def _register(
    place: ListedPlace, free: dict[tuple[str, str], int], chosen: dict[str, str], findings: ListFindings
) -> str:
    side, kind = "input" if place.is_input else "output", _kind(place)
    if place.name not in chosen:
        number = free[side, kind]
        free[side, kind] += 1
        if number >= _MAX_REGISTERS[kind]:
            text = f"the robot has no {side}_{kind}_register after {_MAX_REGISTERS[kind] - 1}"
            hint = "leave out what the robot program does not need, or name fields of the robot in a column `robot`"
            findings.repeated_error(place.row.place("name"), text, hint)
        chosen[place.name] = f"{side}_{kind}_register_{number}"
        findings.repeated_doubt(
            place.row.place("name"),
            "the list names no field of the robot: the next free register is proposed",
            "add a column `robot`, or change `robot:` in the result",
        )
    return chosen[place.name]


def _kind(place: ListedPlace) -> str:
    if place.type in ("bit", "bool"):
        return "bit"
    scaled = (place.scale or 1) % 1 != 0 or (place.offset or 0) % 1 != 0
    return "double" if scaled or place.type.startswith("float") else "int"


def owners(found: Sequence[ListedPlace]) -> tuple[str, ...]:
    """Names of the writers that own something, in the order of the list."""
    return tuple(dict.fromkeys(name for place in found for name in _owners(place.row.text("owner"))))


def _owners(text: str) -> Iterator[str]:
    for name in re.split(r"[>,]", text):
        if name.strip() and name.strip() != "any":
            yield name.strip()
