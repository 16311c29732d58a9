"""The page for those who come from another client names things that exist, and tests that show them."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pathlib import Path

import click
import pytest

from gatewayd import rtde
from gatewayd.cli import command as root
from gatewayd.rtde.fields import INPUTS, OUTPUTS, Field
from tests.docs.rtde_clients.rows import CLIENTS, SHOWN, Row, rows

TESTS = Path(__file__).parents[2]
FIELD = "field"
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
    fields = [row for row in of(client) if row.shown_by == FIELD]
    for row in fields:
        known: Mapping[str, Field] = INPUTS if row.group.startswith("Inputs") else OUTPUTS
        name = row.ours.strip("`")
        assert name in known or name.replace("_X", "_0") in known or name.replace("_X", "_64") in known, name


def test_what_shows_them_is_a_test() -> None:
    for test in SHOWN.values():
        file, _, function = test.partition("::")
        assert function in functions(TESTS / file), test


def test_everything_is_shown_by_something_and_nothing_shows_what_is_not_there() -> None:
    assert {row.shown_by for row in rows()} == SHOWN.keys()


def test_what_is_declined_has_its_reason() -> None:
    for row in rows():
        if row.is_declined:
            assert ":" in row.ours or ";" in row.ours, row.name


@cache
def functions(path: Path) -> frozenset[str]:
    return frozenset(
        node.name
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    )
