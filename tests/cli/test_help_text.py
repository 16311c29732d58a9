"""Help on narrow and wide terminals."""

from __future__ import annotations

import re
from collections.abc import Iterator

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.cli import command
from gatewayd.cli.help_text import fitting


def contexts(group: click.Group, parent: click.Context) -> Iterator[click.Context]:
    yield parent
    for name in group.list_commands(parent):
        found = group.get_command(parent, name)
        assert found is not None
        context = click.Context(found, parent=parent, info_name=name)
        if isinstance(found, click.Group):
            yield from contexts(found, context)
        else:
            yield context


@pytest.mark.parametrize("width", [60, 80, 200])
def test_every_help_fits(width: int) -> None:
    """Only commands to type, and options with their arguments, may be longer: they are copied as one line."""
    root = click.Context(command, info_name="gatewayd", terminal_width=width)
    for context in contexts(command, root):
        for line in context.get_help().splitlines():
            assert len(line) <= width or re.match(r" *(gatewayd|git|cell\.yaml:|Usage:)", line), line


@given(st.lists(st.text("ab1. ", min_size=1, max_size=12), max_size=12).map(" ".join), st.integers(20, 100))
def test_no_word_is_lost(line: str, width: int) -> None:
    assert " ".join(fitting(line, width)).split() == line.split()


def test_a_command_stays_whole_and_its_meaning_goes_below() -> None:
    line = "  gatewayd show --all my-cell.yaml      every element of ranges"
    assert list(fitting(line, 45)) == ["  gatewayd show --all my-cell.yaml", "      every element of ranges"]


def test_the_meaning_of_a_code_stays_in_its_column() -> None:
    assert list(fitting("  70   a defect of gatewayd itself", 24)) == [
        "  70   a defect of",
        "       gatewayd itself",
    ]
