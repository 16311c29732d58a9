"""The page for those who come from another client names things that exist, and tests that show them.

Whether a test shows what its row says only a person can judge; what can be checked is checked: the test exists, with
the case that is named, and its text has every name of ours in it.
"""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import click
import pytest

from gatewayd import rtde
from gatewayd.cli import command as root
from gatewayd.rtde.fields import INPUTS, OUTPUTS, Field
from tests.docs.rtde_clients.rows import CLIENTS, Row, ShowingTest, rows

TESTS = Path(__file__).parents[2]
COUNTS = {"python": 149, "cpp": 132, "dotnet": 175}
"""Rows of the inventory that was made of their documents; one that gets lost would not be missed otherwise."""

every_client = pytest.mark.parametrize("client", CLIENTS)


def of(client: str) -> list[Row]:
    return [row for row in rows() if row.client == client]


@every_client
def test_no_row_is_lost(client: str) -> None:
    assert len(of(client)) == COUNTS[client]


@every_client
def test_what_is_ours_exists(client: str) -> None:
    missing = [(row.name, name) for row in of(client) for name in row.references if not exists(name)]
    assert not missing


def exists(name: str) -> bool:
    """Whether `gatewayd.rtde` has it: a public name, an attribute of one, or something in a module."""
    found: object = rtde
    path = "gatewayd.rtde"
    for word in name.split("."):
        path = f"{path}.{word}"
        if hasattr(found, word) or word in getattr(found, "__annotations__", ()):
            found = getattr(found, word, None)
            continue
        try:
            found = import_module(path)
        except ModuleNotFoundError:
            return False
    return True


@every_client
def test_commands_and_their_options_exist(client: str) -> None:
    missing = [(row.name, text) for row in of(client) for text in row.commands if not is_command(text)]
    assert not missing


def is_command(text: str) -> bool:
    """Whether the words are commands of the program, and what begins with a dash an option of the last one."""
    found: click.Command | None = root
    context = click.Context(root)
    for word in text.split():
        if word.startswith("-"):
            assert found is not None
            return any(word in parameter.opts for parameter in found.get_params(context))
        if not isinstance(found, click.Group):
            return False
        found = found.get_command(context, word)
        if found is None:
            return False
    return True


@every_client
def test_fields_are_those_of_the_catalogue(client: str) -> None:
    fields = [row for row in of(client) if row.group in ("Inputs", "Outputs")]
    assert len(fields) == (88 if client == "dotnet" else 0)
    for row in fields:
        known: Mapping[str, Field] = INPUTS if row.group == "Inputs" else OUTPUTS
        name = row.ours.strip("`")
        assert name in known or name.replace("_X", "_0") in known or name.replace("_X", "_64") in known, name
        assert [test.case for test in row.shown_by] == [name]


@every_client
def test_everything_of_ours_is_shown_by_a_test(client: str) -> None:
    """Only what is declined, and names nothing of ours, has none."""
    wrong = [row.name for row in of(client) if not row.shown_by and (names_of(row) or not row.is_declined)]
    assert not wrong


@every_client
def test_what_shows_them_is_a_test(client: str) -> None:
    wrong = [
        (row.name, test)
        for row in of(client)
        for test in row.shown_by
        if not test.function.startswith("test_") or test.function not in definitions(TESTS / test.file)
    ]
    assert not wrong


@every_client
def test_cases_that_are_named_exist(client: str) -> None:
    wrong = [
        (row.name, test)
        for row in of(client)
        for test in row.shown_by
        if test.case is not None and test.case not in cases(test.file, test.function)
    ]
    assert not wrong


@every_client
def test_what_shows_them_speaks_of_them(client: str) -> None:
    """Every name of ours is a word of a test of its row, of what that uses in its module, or of its cases."""
    wrong = {
        row.name: missing
        for row in of(client)
        if (missing := names_of(row) - set().union(*map(words_of, row.shown_by)))
    }
    assert not wrong


FRAMEWORK = frozenset(
    {"rtde", "gatewayd", "sample", "recording", "async", "with", "for", "len", "list", "HOST", "PORT", "OUT"}
)
"""Words of code that are no names of ours."""


def names_of(row: Row) -> set[str]:
    """The names of ours in a row: of a dotted one its last part, and each word of a command."""
    found: set[str] = set()
    for text in row.code:
        if text.startswith("docs/"):
            continue
        if text.startswith("rtde."):
            found.add(text.split("(")[0].rsplit(".", 1)[-1])
        else:
            found |= set(re.findall(r"-{0,2}[A-Za-z_][\w-]*", re.sub(r'"[A-Z0-9]+"', "", text)))
    return {name for name in found if name not in FRAMEWORK and name not in dir(builtins)}


def words_of(test: ShowingTest) -> set[str]:
    """The words of a test and of all that it uses in its module."""
    text = source(TESTS / test.file, test.function) + f" {test.case}"
    return set(re.findall(r"-{0,2}[A-Za-z_][\w-]*|\w+", text))


def test_what_is_declined_has_its_reason() -> None:
    for row in rows():
        if row.is_declined:
            assert ":" in row.ours or ";" in row.ours, row.name


@cache
def definitions(path: Path) -> Mapping[str, str]:
    """The text of everything that a module defines, decorators included."""
    text = path.read_text("utf-8")
    lines = text.splitlines(keepends=True)
    return dict(_definitions(ast.parse(text), lines))


def _definitions(module: ast.Module, lines: list[str]) -> Iterator[tuple[str, str]]:
    for node in module.body:
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                names = [node.name]
                first = min((each.lineno for each in node.decorator_list), default=node.lineno)
            case ast.Assign(targets=targets):
                names = [
                    name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)
                ]
                first = node.lineno
            case ast.AnnAssign(target=ast.Name(id=name)):
                names, first = [name], node.lineno
            case _:
                continue
        yield from ((name, "".join(lines[first - 1 : node.end_lineno])) for name in names)


@cache
def source(path: Path, function: str) -> str:
    """The text of a function, and of what it uses in its module, and that in its turn."""
    defined = definitions(path)
    found: dict[str, str] = {}
    wanted = [function]
    while wanted:
        name = wanted.pop()
        found[name] = defined[name]
        wanted += {word for word in re.findall(r"\w+", found[name]) if word in defined and word not in found}
    return "".join(found.values())


@cache
def cases(file: str, function: str) -> frozenset[str]:
    """The ids of the cases of a parametrised test, as pytest makes them."""
    module = import_module(f"tests.{file.removesuffix('.py').replace('/', '.')}")
    marks = [
        mark for mark in getattr(getattr(module, function), "pytestmark", ()) if mark.name == "parametrize"
    ]
    found = [""]
    for mark in marks:  # the last decorator varies fastest, and stands first in the id
        names, values = mark.args
        count = len(names.split(",")) if isinstance(names, str) else len(names)
        ids = mark.kwargs.get("ids")
        own = [_id(value, count, ids, number) for number, value in enumerate(values)]
        found = [f"{before}-{each}" if before else each for before in found for each in own]
    return frozenset(found)


def _id(value: Any, count: int, ids: Any, number: int) -> str:
    if getattr(value, "id", None):
        return str(value.id)
    if callable(ids):
        return str(ids(value))
    if ids is not None:
        return str(list(ids)[number])
    parts = value if count > 1 else (value,)
    return "-".join(map(str, parts))
