"""Conditions on the values of a package, as people type them: `runtime_state == 2 and actual_TCP_force[2] > 50`. Pure.

A condition compares fields with numbers. `FIELD[3]` is an element of a vector, `FIELD.5` a bit of a number; a field
alone is true if it is not zero. A state may be named by its word: `runtime_state == running`. `not` binds closer than
`and`, and `and` closer than `or`; parentheses group.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NoReturn

from gatewayd.report.format import counted
from gatewayd.rtde.enums import MEANINGS
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.types import INTEGER_RANGES

Test = Callable[[Sequence[Scalar]], bool]
"""Whether a condition holds for the flat values of a package."""

_TOKEN = re.compile(
    r"\s*(?:(?P<number>[+-]?(?:0[xX][0-9A-Fa-f]+|(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?))"
    r"|(?P<place>[A-Za-z_]\w*(?:\[[0-9]{1,3}\]|\.[0-9]{1,3})?)|(?P<sign>==|!=|<=|>=|<|>|=|\(|\)))",
    re.ASCII,
)
_PLACE = re.compile(r"(\w+)(?:\[([0-9]+)\]|\.([0-9]+))?")
_OPERATORS: Mapping[str, Callable[[Scalar, Scalar], bool]] = {
    "==": operator.eq,
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_TRUTHS = {"true": 1, "on": 1, "false": 0, "off": 0}
_RESERVED = frozenset({"and", "or", "not", *_TRUTHS})
_MAX_LENGTH = 1000
_MAX_DEPTH = 50
_EXAMPLE = "write for example: runtime_state == 2 and actual_TCP_force[2] > 50"


class ConditionError(ValueError):
    """A condition that cannot be used; the text says where and why."""


@dataclass(frozen=True, slots=True)
class ValuePlace:
    """Where a value is found in a package."""

    field: str
    element: int | None = None
    bit: int | None = None


@dataclass(frozen=True, slots=True)
class Comparison:
    """A value against a number."""

    place: ValuePlace
    sign: str
    number: Scalar


@dataclass(frozen=True, slots=True)
class Negation:
    """The contrary of a part."""

    part: Node


@dataclass(frozen=True, slots=True)
class Junction:
    """Several parts, all of which have to hold (`every`), or one of them."""

    parts: tuple[Node, ...]
    every: bool


Node = Comparison | Negation | Junction


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition that was read."""

    text: str
    root: Node

    @property
    def fields(self) -> tuple[str, ...]:
        """The fields that it needs, each once, in their order."""
        return tuple(dict.fromkeys(_fields(self.root)))

    def test(self, recipe: Recipe) -> Test:
        """The condition for packages of this recipe.

        ConditionError for a field, an element or a bit that they do not have.
        """
        return _test(self.root, recipe)


def parse_condition(text: str) -> Condition:
    """Read a condition; ConditionError says at which column it cannot be understood."""
    if len(text) > _MAX_LENGTH:
        raise ConditionError(f"longer than {counted(_MAX_LENGTH, 'character')}")
    parser = _Parser(text)
    root = parser.alternatives(0)
    parser.end()
    return Condition(text, root)


class _Parser:
    """Recursive descent over the tokens of one text."""

    def __init__(self, text: str) -> None:
        self._tokens: list[tuple[str, str, int]] = []
        at, end = 0, len(text.rstrip())
        while at < end:
            found = _TOKEN.match(text, at)
            if found is None:
                while text[at].isspace():
                    at += 1
                raise ConditionError(f"column {at + 1}: {text[at]!r} has no meaning here; {_EXAMPLE}")
            kind = found.lastgroup or ""
            self._tokens.append((kind, found[kind], found.start(kind)))
            at = found.end()
        self._length = end
        self._next = 0

    def alternatives(self, depth: int) -> Node:
        """Parts with `or` between them."""
        return self._joined("or", lambda: self._joined("and", lambda: self._part(depth), every=True))

    def end(self) -> None:
        """Nothing may be left."""
        if self._next < len(self._tokens):
            self._fail("`and`, `or` or the end")

    def _joined(self, word: str, part: Callable[[], Node], *, every: bool = False) -> Node:
        parts = [part()]
        while self._take("place", word):
            parts.append(part())
        return parts[0] if len(parts) == 1 else Junction(tuple(parts), every)

    def _part(self, depth: int) -> Node:
        if depth > _MAX_DEPTH:
            raise ConditionError("nested too deeply")
        if self._take("place", "not"):
            return Negation(self._part(depth + 1))
        if self._take("sign", "("):
            inner = self.alternatives(depth + 1)
            if not self._take("sign", ")"):
                self._fail("`)`")
            return inner
        return self._comparison()

    def _comparison(self) -> Node:
        kind, text = self._peek()
        if kind != "place" or text in _RESERVED:
            self._fail("the name of a field")
        self._next += 1
        place = _place(text)
        sign = self._peek()[1]
        if sign not in _OPERATORS:
            return Comparison(place, "!=", 0)
        self._next += 1
        return Comparison(place, sign, self._number(place))

    def _number(self, place: ValuePlace) -> Scalar:
        kind, text = self._peek()
        states = {word.replace(" ", "_").lower(): number for number, word in _words(place).items()}
        if kind == "number":
            number: Scalar | None = _number(text)
        else:
            number = (states | _TRUTHS).get(text.lower())
        if number is None:
            self._fail(f"a number, or one of {', '.join(states)}," if states else "a number")
        self._next += 1
        return number

    def _peek(self) -> tuple[str, str]:
        return self._tokens[self._next][:2] if self._next < len(self._tokens) else ("", "")

    def _take(self, kind: str, text: str) -> bool:
        taken = self._peek() == (kind, text)
        self._next += taken
        return taken

    def _fail(self, wanted: str) -> NoReturn:
        _kind, text = self._peek()
        at = self._tokens[self._next][2] if text else self._length
        found = repr(text) if text else "the end"
        raise ConditionError(f"column {at + 1}: {wanted} is expected, not {found}; {_EXAMPLE}")


def _place(text: str) -> ValuePlace:
    found = _PLACE.fullmatch(text)
    assert found is not None
    return ValuePlace(found[1], *(None if part is None else int(part) for part in found.groups()[1:]))


def _number(text: str) -> Scalar:
    if "x" in text.lower():
        return int(text, 16)
    return int(text) if text.lstrip("+-").isdigit() else float(text)


def _words(place: ValuePlace) -> Mapping[int, str]:
    return MEANINGS.get(place.field, {}) if place.bit is None else {}


def _fields(node: Node) -> list[str]:
    if isinstance(node, Comparison):
        return [node.place.field]
    parts = node.parts if isinstance(node, Junction) else (node.part,)
    return [field for part in parts for field in _fields(part)]


def _test(node: Node, recipe: Recipe) -> Test:
    if isinstance(node, Comparison):
        return _comparison_test(node, recipe)
    if isinstance(node, Negation):
        part = _test(node.part, recipe)
        return lambda values: not part(values)
    parts = [_test(part, recipe) for part in node.parts]
    joined = all if node.every else any
    return lambda values: joined(part(values) for part in parts)


def _comparison_test(comparison: Comparison, recipe: Recipe) -> Test:
    place, number = comparison.place, comparison.number
    compare = _OPERATORS[comparison.sign]
    slot = _slot(place, recipe)
    bit = place.bit
    if bit is None:
        return lambda values: compare(values[slot], number)
    return lambda values: compare(int(values[slot]) >> bit & 1, number)


def _slot(place: ValuePlace, recipe: Recipe) -> int:
    """The index of the value in the flat tuple."""
    name, kind = place.field, recipe.kinds.get(place.field)
    if kind is None:
        raise ConditionError(f"there is no field {name} in the packages")
    if kind.is_vector and place.element is None:
        raise ConditionError(f"{name} is a vector: say which element, {name}[0] to {name}[{kind.count - 1}]")
    if place.element is not None and (not kind.is_vector or place.element >= kind.count):
        last = f"{name}[0] to {name}[{kind.count - 1}]" if kind.is_vector else f"{name} alone"
        raise ConditionError(f"{name}[{place.element}] is not there: {name} is {kind.word}, write {last}")
    if place.bit is not None and kind.code not in INTEGER_RANGES:
        raise ConditionError(f"{name}.{place.bit}: {name} is {kind.word}, which has no bits")
    if place.bit is not None and place.bit >= (kind.bits or 0):
        raise ConditionError(
            f"{name}.{place.bit}: {name} is {kind.word}, with bits 0 to {(kind.bits or 1) - 1}"
        )
    first: int = recipe.slots[name].start
    return first + (place.element or 0)
