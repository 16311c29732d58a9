"""The robot program: rules that make outputs answer inputs, one a line, run in order in every control cycle.

    TARGET = SOURCE [* NUMBER] [+ NUMBER] [after DURATION] [for DURATION]
    TARGET = not SOURCE [after DURATION] [for DURATION]
    TARGET = count SOURCE | count every DURATION
    TARGET = toggle SOURCE | toggle every DURATION
    TARGET = NUMBER

TARGET and SOURCE are RTDE names: a field (`output_int_register_0`), an element of a vector (`actual_TCP_pose[2]`), a
bit of an integer (`actual_digital_input_bits.0`), or a reserved bit by its own name (`output_bit_register_0` to `_63`).
`NAME_0..23` on both sides makes one rule for each number. A source may be any field, a target any but the inputs, which
only clients write, and the cycle counters.

- a plain source is echoed, multiplied and moved by the numbers; integers are rounded and kept within their range
- `after` delays every change; `for` makes a pulse of that length out of every change from 0
- `count` adds 1 at every change of its source from 0, or at every interval; `toggle` inverts
- DURATION is a number with `ms` or `s`; `#` starts a comment; `;` separates rules on one line

Example, a handshake: `output_bit_register_0 = input_bit_register_0 for 300ms` (busy) and
`output_bit_register_1 = input_bit_register_0 after 300ms` (done).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from gatewayd.report.format import counted
from gatewayd.rtde.catalogue import bit_word
from gatewayd.rtde.fields import BITS_PER_WORD

DEMO = """\
output_bit_registers0_to_31 = input_bit_registers0_to_31
output_bit_registers32_to_63 = input_bit_registers32_to_63
output_int_register_0..23 = input_int_register_0..23
output_double_register_0..23 = input_double_register_0..23
"""
"""Echoes every reserved input register and bit to the output of the same number."""


class ProgramError(ValueError):
    """A program that cannot be run: what is wrong, and where."""

    def __init__(self, source: str, line: int, column: int, message: str) -> None:
        super().__init__(f"{source}:{line}:{column}: {message}")
        self.line = line
        """Line of the source, from 1."""
        self.column = column
        """Column of the line, from 1."""


class RuleOperation(Enum):
    """What a rule makes of its source."""

    ECHO = "echo"
    NOT = "not"
    COUNT = "count"
    TOGGLE = "toggle"
    CONSTANT = "constant"


@dataclass(frozen=True, slots=True)
class FieldReference:
    """One value a rule reads or writes."""

    field: str
    part: int | None
    """Bit (`of_bit`) or element of the field; None for the whole."""
    of_bit: bool
    source: str
    line: int
    column: int

    def error(self, message: str) -> ProgramError:
        """`message` about this reference."""
        return ProgramError(self.source, self.line, self.column, message)


@dataclass(frozen=True, slots=True)
class ProgramRule:
    """One assignment. Durations in seconds, 0 = none."""

    target: FieldReference
    operation: RuleOperation
    input: FieldReference | None = None
    """What is read; None for a constant and for `every`."""
    scale: float = 1.0
    offset: float = 0.0
    """Also the value of a constant."""
    every: float = 0.0
    after: float = 0.0
    pulse: float = 0.0

    @property
    def plain(self) -> bool:
        """Whether the source is passed on as it is."""
        altered = self.scale != 1 or self.offset != 0 or self.after or self.pulse
        return self.operation is RuleOperation.ECHO and not altered


def parse(text: str, source: str = "program") -> tuple[ProgramRule, ...]:
    """The rules of `text`, ranges expanded. `source` names it in a ProgramError."""
    rules: list[ProgramRule] = []
    for number, line in enumerate(text.splitlines(), 1):
        start = 0
        for statement in line.split("#", 1)[0].split(";"):
            if statement.strip():
                rules.extend(_Statement(source, number, start, statement).rules())
            start += len(statement) + 1
    return tuple(rules)


_TOKEN = re.compile(
    r"\s*(?:(?P<name>[A-Za-z_]\w*(?:\.\.\d+)?(?:\[\d+\]|\.\d+)?)"
    r"|(?P<number>\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)(?P<unit>ms\b|s\b)?"
    r"|(?P<sign>[-+*=]))"
)
_NAME = re.compile(
    r"(?P<stem>\w+?)(?P<first>\d+)?(?:\.\.(?P<last>\d+))?(?:\[(?P<element>\d+)\]|\.(?P<bit>\d+))?"
)
_RESERVED_BIT = re.compile(r"(input|output)_bit_register_(\d+)")
_SECONDS = {"ms": 0.001, "s": 1.0}
_WORDS = frozenset({"not", "count", "toggle", "every", "after", "for"})
_MOST_IN_RANGE = 128


class _Statement:
    """Recursive descent over the tokens of one rule."""

    def __init__(self, source: str, line: int, start: int, text: str) -> None:
        self._source, self._line = source, line
        self._end = start + len(text.rstrip()) + 1
        self._tokens = list(self._tokenize(text, start))
        self._at = 0

    def rules(self) -> Iterator[ProgramRule]:
        targets = self._references("a target")
        self._sign("=", needed=True)
        shape, inputs = self._expression(targets)
        if self._at < len(self._tokens):
            raise self._error(f"unexpected {self._text()!r}")
        for target, item in zip(targets, inputs, strict=True):
            yield replace(shape, target=target, input=item)

    def _expression(
        self, targets: list[FieldReference]
    ) -> tuple[ProgramRule, Sequence[FieldReference | None]]:
        """A rule for the first target, and the source of each target."""
        first, count = targets[0], len(targets)
        nothing = [None] * count
        for word in (RuleOperation.COUNT, RuleOperation.TOGGLE):
            if self._word(word.value):
                if self._word("every"):
                    return ProgramRule(first, word, every=self._duration()), nothing
                return ProgramRule(first, word), self._inputs(count)
        if self._kind() in ("number", "sign"):
            return ProgramRule(first, RuleOperation.CONSTANT, offset=self._signed()), nothing
        operation = RuleOperation.NOT if self._word("not") else RuleOperation.ECHO
        inputs = self._inputs(count)
        scale, offset = (1.0, 0.0) if operation is RuleOperation.NOT else self._line_equation()
        after = self._duration() if self._word("after") else 0.0
        pulse = self._duration() if self._word("for") else 0.0
        return ProgramRule(first, operation, scale=scale, offset=offset, after=after, pulse=pulse), inputs

    def _line_equation(self) -> tuple[float, float]:
        scale = self._signed() if self._sign("*") else 1.0
        if self._sign("+"):
            return scale, self._signed()
        return scale, -self._signed() if self._sign("-") else 0.0

    def _inputs(self, count: int) -> list[FieldReference]:
        column = self._column()
        inputs = self._references("a source")
        if len(inputs) != count:
            raise self._error(f"{counted(count, 'target')}, but {counted(len(inputs), 'source')}", column)
        return inputs

    def _references(self, wanted: str) -> list[FieldReference]:
        if self._kind() != "name" or self._text() in _WORDS:
            raise self._error(f"expected {wanted}" + (f", not {self._text()!r}" if self._kind() else ""))
        parts = _NAME.fullmatch(self._text())
        if parts is None:
            raise self._error(f"{self._text()!r} is not a name")
        column = self._column()
        stem, first, last = parts["stem"], parts["first"], parts["last"]
        if last is not None and (first is None or not 0 <= int(last) - int(first) < _MOST_IN_RANGE):
            raise self._error(
                f"{self._text()!r} is not a range: write NAME_0..23, at most {_MOST_IN_RANGE} numbers"
            )
        self._at += 1
        numbers = [first or ""] if last is None else [str(n) for n in range(int(first), int(last) + 1)]
        return [self._reference(stem + number, parts["element"], parts["bit"], column) for number in numbers]

    def _reference(self, name: str, element: str | None, bit: str | None, column: int) -> FieldReference:
        reserved = _RESERVED_BIT.fullmatch(name)
        part = element if bit is None else bit
        number, of_bit = None if part is None else int(part), bit is not None
        if reserved and int(reserved[2]) < 2 * BITS_PER_WORD and part is None:
            (name, number), of_bit = bit_word(reserved[1], int(reserved[2])), True
        return FieldReference(name, number, of_bit, self._source, self._line, column)

    def _signed(self) -> float:
        negative = self._sign("-")
        if self._kind() != "number" or self._tokens[self._at]["unit"]:
            raise self._error("expected a number")
        value = float(self._tokens[self._at]["number"])
        self._at += 1
        return -value if negative else value

    def _duration(self) -> float:
        unit = self._tokens[self._at]["unit"] if self._kind() == "number" else None
        if not unit:
            raise self._error("expected a duration with its unit, as 200ms or 1.5s")
        value = float(self._tokens[self._at]["number"])
        self._at += 1
        return value * _SECONDS[unit]

    def _word(self, word: str) -> bool:
        found = self._kind() == "name" and self._text() == word
        self._at += found
        return found

    def _sign(self, sign: str, *, needed: bool = False) -> bool:
        found = self._kind() == "sign" and self._text() == sign
        if needed and not found:
            raise self._error(f"expected {sign!r}")
        self._at += found
        return found

    def _kind(self) -> str | None:
        if self._at >= len(self._tokens):
            return None
        return next(kind for kind in ("name", "number", "sign") if self._tokens[self._at][kind])

    def _text(self) -> str:
        return self._tokens[self._at].group().strip()

    def _column(self) -> int:
        if self._at >= len(self._tokens):
            return self._end
        token = self._tokens[self._at]
        return self._offset + token.end() - len(self._text()) + 1

    def _error(self, message: str, column: int | None = None) -> ProgramError:
        """`message` about the present token, or about `column`."""
        return ProgramError(self._source, self._line, self._column() if column is None else column, message)

    def _tokenize(self, text: str, start: int) -> Iterator[re.Match[str]]:
        self._offset, at, end = start, 0, len(text.rstrip())
        while at < end:
            token = _TOKEN.match(text, at)
            if token is None:
                at += len(text[at:]) - len(text[at:].lstrip())
                raise self._error(f"unexpected {text[at]!r}", start + at + 1)
            yield token
            at = token.end()
