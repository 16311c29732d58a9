"""URScript as far as generated programs use it: a parser and an interpreter, after Universal Robots' script manual.

No controller is here, and no registry has a parser: this one is ours, so it shows that a text is well-formed by our
reading of the manual, and what it computes. It parses what was tried of Universal Robots' own example programs.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

_TOKEN = re.compile(
    r"""(?P<blank>[ \t]+|\#[^\n]*)|(?P<line>\n)|(?P<number>\d+\.\d*(?:[eE][-+]?\d+)?|\d+(?:[eE][-+]?\d+)?)
    |(?P<text>"[^"\n]*")|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<mark>[<>=!]=|[-+*/%<>=()\[\]{},:.])""",
    re.VERBOSE,
)
KEYWORDS = frozenset(
    {
        "and",
        "break",
        "continue",
        "def",
        "elif",
        "else",
        "end",
        "False",
        "global",
        "halt",
        "if",
        "join",
        "kill",
    }
    | {"local", "loop", "not", "or", "return", "run", "sec", "thread", "True", "while", "xor"}
)
_COMPARING: dict[str, Callable[[Any, Any], Any]] = {
    "==": operator.eq, "!=": operator.ne, "<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge,
}  # fmt: skip
_ADDING: dict[str, Callable[[Any, Any], Any]] = {"+": operator.add, "-": operator.sub}
_TIMES: dict[str, Callable[[Any, Any], Any]] = {"*": operator.mul, "/": operator.truediv, "%": operator.mod}

Scope = dict[str, Any]
Expression = Callable[[Scope], Any]
Statement = Callable[[Scope], None]


class Halted(Exception):
    """The program executed `halt`."""


class _Return(Exception):
    def __init__(self, value: Any) -> None:
        super().__init__()
        self.value = value


class _Break(Exception):
    pass


@dataclass
class Script:
    """A program: what it defines, and what it is given."""

    functions: dict[str, Callable[..., Any]] = field(default_factory=dict)
    parameters: dict[str, list[str]] = field(default_factory=dict)
    variables: Scope = field(default_factory=dict)

    def call(self, name: str, *values: Any, **named: Any) -> Any:
        return self.functions[name](*values, **named)


def load(text: str, **given: Callable[..., Any]) -> Script:
    """Parse a program and run it; SyntaxError names the line. `given` are the controller's functions."""
    script = Script(functions={"floor": math.floor, **given})
    for statement in _Parser(text, script).block(frozenset()):
        statement(script.variables)
    return script


class _Parser:
    def __init__(self, text: str, script: Script) -> None:
        self._script = script
        self._tokens = list(self._read(text))
        self._at = 0

    def _read(self, text: str) -> Sequence[tuple[str, str, int]]:
        tokens, place, line = [], 0, 1
        while place < len(text):
            match = _TOKEN.match(text, place)
            if match is None:
                raise SyntaxError(f"line {line}: {text[place : place + 20]!r}")
            place, kind = match.end(), match.lastgroup or ""
            if kind == "name" and match[0] in KEYWORDS:
                kind = "keyword"
            if kind != "blank":
                tokens.append((kind, match[0], line))
            line += kind == "line"
        return [*tokens, ("line", "\n", line), ("line", "", line)]

    # -- tokens ------------------------------------------------------------------------------------------------------

    def _is(self, *texts: str) -> bool:
        return self._tokens[self._at][1] in texts

    def _next(self) -> tuple[str, str, int]:
        self._at += 1
        return self._tokens[self._at - 1]

    def _take(self, text: str) -> None:
        _, found, line = self._next()
        if found != text:
            raise SyntaxError(f"line {line}: {found!r} instead of {text!r}")

    def _name(self) -> str:
        kind, text, line = self._next()
        if kind != "name":
            raise SyntaxError(f"line {line}: {text!r} is no name")
        return text

    # -- statements --------------------------------------------------------------------------------------------------

    def block(self, ends: frozenset[str]) -> list[Statement]:
        found: list[Statement] = []
        while True:
            while self._is("\n"):
                self._next()
            if self._is("") and not ends:
                return found
            if self._is(*ends):
                return found
            found.append(self._statement())
            if not self._is("\n", ""):
                raise SyntaxError(
                    f"line {self._tokens[self._at][2]}: {self._tokens[self._at][1]!r} after a statement"
                )

    def _statement(self) -> Statement:
        kind, text, line = self._tokens[self._at]
        if kind == "keyword" and text in _STATEMENTS:
            self._next()
            return _STATEMENTS[text](self)
        if kind in ("name", "keyword"):
            return self._simple()
        raise SyntaxError(f"line {line}: {text!r} begins no statement")

    def _definition(self) -> Statement:
        name = self._name()
        self._take("(")
        parameters: list[tuple[str, Expression | None]] = []
        while not self._is(")"):
            parameter = self._name()
            default = None
            if self._is("="):
                self._next()
                default = self._expression()
            parameters.append((parameter, default))
            if self._is(","):
                self._next()
        self._take(")")
        self._take(":")
        body = self.block(frozenset({"end"}))
        self._take("end")
        if name in self._script.parameters:
            raise SyntaxError(f"{name} is defined twice")
        self._script.parameters[name] = [parameter for parameter, _ in parameters]
        self._script.functions[name] = self._function(name, parameters, body)
        return lambda _: None

    def _function(
        self, name: str, parameters: list[tuple[str, Expression | None]], body: list[Statement]
    ) -> Callable[..., Any]:
        def function(*values: Any, **named: Any) -> Any:
            scope = {
                key: default(self._script.variables) for key, default in parameters if default is not None
            }
            scope |= dict(zip((key for key, _ in parameters), values, strict=False)) | named
            if set(scope) != {key for key, _ in parameters} or len(values) > len(parameters):
                raise TypeError(f"{name} takes {parameters}, not {values} {named}")
            try:
                _run(body, scope)
            except _Return as returned:
                return returned.value
            return None

        return function

    def _condition(self) -> Statement:
        branches = [(self._head(), self.block(frozenset({"elif", "else", "end"})))]
        otherwise: list[Statement] = []
        while self._is("elif"):
            self._next()
            branches.append((self._head(), self.block(frozenset({"elif", "else", "end"}))))
        if self._is("else"):
            self._next()
            self._take(":")
            otherwise = self.block(frozenset({"end"}))
        self._take("end")

        def run(scope: Scope) -> None:
            _run(next((body for test, body in branches if _truth(test(scope))), otherwise), scope)

        return run

    def _head(self) -> Expression:
        test = self._expression()
        self._take(":")
        return test

    def _loop(self) -> Statement:
        test = self._head()
        body = self.block(frozenset({"end"}))
        self._take("end")

        def run(scope: Scope) -> None:
            while _truth(test(scope)):
                try:
                    _run(body, scope)
                except _Break:
                    return

        return run

    def _return(self) -> Statement:
        value = (lambda _: None) if self._is("\n") else self._expression()

        def run(scope: Scope) -> None:
            raise _Return(value(scope))

        return run

    def _halt(self) -> Statement:
        def run(_: Scope) -> None:
            raise Halted

        return run

    def _break(self) -> Statement:
        def run(_: Scope) -> None:
            raise _Break

        return run

    def _declaration(self) -> Statement:
        target = self._tokens[self._at][1]
        is_global = self._tokens[self._at - 1][1] == "global"
        self._name()
        self._take("=")
        value = self._expression()

        def run(scope: Scope) -> None:
            (self._script.variables if is_global else scope)[target] = value(scope)

        return run

    def _simple(self) -> Statement:
        """An assignment or a call."""
        target = self._tokens[self._at][1]
        if self._tokens[self._at + 1][1] == "=":
            self._name()
            self._take("=")
            value = self._expression()

            def assign(scope: Scope) -> None:
                (scope if target in scope else self._script.variables)[target] = value(scope)

            return assign
        expression = self._expression()
        if self._is("="):
            self._next()
            self._expression()
        return lambda scope: expression(scope) and None

    # -- expressions -------------------------------------------------------------------------------------------------

    def _expression(self) -> Expression:
        left = self._negation()
        while self._is("and", "or", "xor"):
            left = _combined(self._next()[1], left, self._negation())
        return left

    def _negation(self) -> Expression:
        if self._is("not"):
            self._next()
            inner = self._negation()
            return lambda scope: not _truth(inner(scope))
        return self._chain(_COMPARING, lambda: self._chain(_ADDING, lambda: self._chain(_TIMES, self._unary)))

    def _chain(
        self, operators: dict[str, Callable[[Any, Any], Any]], part: Callable[[], Expression]
    ) -> Expression:
        left = part()
        while self._is(*operators):
            left = _applied(operators[self._next()[1]], left, part())
        return left

    def _unary(self) -> Expression:
        if self._is("-"):
            self._next()
            inner = self._unary()
            return lambda scope: -inner(scope)
        return self._followed(self._primary())

    def _followed(self, value: Expression) -> Expression:
        """An index or a member, which generated programs do not have: parsed only."""
        while self._is("[", "."):
            if self._next()[1] == ".":
                self._name()
                if self._is("("):
                    self._arguments()
            else:
                self._expression()
                self._take("]")
        return value

    def _primary(self) -> Expression:
        kind, text, line = self._next()
        if kind == "number":
            number = float(text) if re.search(r"[.eE]", text) else int(text)
            return lambda _: number
        if kind == "text":
            return lambda _: text[1:-1]
        if text in ("True", "False"):
            return lambda _: text == "True"
        if text == "(":
            inner = self._expression()
            self._take(")")
            return inner
        if text == "[":
            return self._list()
        if kind == "name" or (kind == "keyword" and text == "run"):
            return self._named(text) if kind == "name" else self._followed(self._primary())
        raise SyntaxError(f"line {line}: {text!r} in an expression")

    def _list(self) -> Expression:
        items: list[Expression] = []
        while not self._is("]"):
            items.append(self._expression())
            if self._is(","):
                self._next()
        self._take("]")
        return lambda scope: [item(scope) for item in items]

    def _named(self, name: str) -> Expression:
        if name == "p" and self._is("["):
            self._next()
            return self._list()
        if not self._is("("):
            return lambda scope: scope[name] if name in scope else self._script.variables[name]
        values, named = self._arguments()

        def call(scope: Scope) -> Any:
            given = {key: value(scope) for key, value in named.items()}
            return self._script.functions[name](*[value(scope) for value in values], **given)

        return call

    def _arguments(self) -> tuple[list[Expression], dict[str, Expression]]:
        self._take("(")
        values: list[Expression] = []
        named: dict[str, Expression] = {}
        while not self._is(")"):
            if self._tokens[self._at + 1][1] == "=":
                key = self._name()
                self._take("=")
                named[key] = self._expression()
            else:
                values.append(self._expression())
            if not self._is(")"):
                self._take(",")
        self._take(")")
        return values, named


_STATEMENTS: dict[str, Callable[[_Parser], Statement]] = {
    "def": _Parser._definition,
    "thread": _Parser._definition,
    "if": _Parser._condition,
    "while": _Parser._loop,
    "return": _Parser._return,
    "halt": _Parser._halt,
    "break": _Parser._break,
    "local": _Parser._declaration,
    "global": _Parser._declaration,
}


def _run(body: Sequence[Statement], scope: Scope) -> None:
    for statement in body:
        statement(scope)


def _truth(value: Any) -> bool:
    """URScript has no truth of numbers."""
    if not isinstance(value, bool):
        raise TypeError(f"{value!r} is no boolean")
    return value


def _combined(word: str, left: Expression, right: Expression) -> Expression:
    if word == "and":
        return lambda scope: _truth(left(scope)) and _truth(right(scope))
    if word == "or":
        return lambda scope: _truth(left(scope)) or _truth(right(scope))
    return lambda scope: _truth(left(scope)) != _truth(right(scope))


def _applied(apply: Callable[[Any, Any], Any], left: Expression, right: Expression) -> Expression:
    return lambda scope: apply(left(scope), right(scope))
