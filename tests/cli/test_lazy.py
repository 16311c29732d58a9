"""Groups that know their commands by a table."""

from __future__ import annotations

import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from gatewayd.cli.lazy import LazyGroup


@pytest.fixture
def group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> LazyGroup:
    """A group of two commands: `good`, and `class`, whose module has another name."""
    package = f"lazy_{tmp_path.name}"
    (tmp_path / package).mkdir()
    (tmp_path / package / "__init__.py").write_text("")
    for name, module in (("good", "good"), ("class", "classes")):
        text = f"import click\n\n@click.command('{name}')\ndef command() -> None:\n    click.echo('{name} ran')\n"
        (tmp_path / package / f"{module}.py").write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    table = {"good": "Does good.", "class": "Goes to class."}
    return LazyGroup("some", package=package, summaries=table, modules={"class": "classes"})


@pytest.mark.parametrize("name", ["good", "class"])
def test_a_command_is_imported_when_it_is_used(group: LazyGroup, name: str) -> None:
    done = CliRunner().invoke(group, [name])
    assert (done.exit_code, done.output) == (0, f"{name} ran\n")


def test_help_and_completion_import_no_command(group: LazyGroup) -> None:
    before = set(sys.modules)
    listed = CliRunner().invoke(group, ["--help"]).output
    assert listed.index("good   Does good.") < listed.index("class  Goes to class.")
    completed = group.shell_complete(click.Context(group), "cl")
    assert [(item.value, item.help) for item in completed] == [("class", "Goes to class.")]
    assert [name for name in set(sys.modules) - before if name.startswith("lazy_")] == []


def test_a_misspelt_command_is_answered_with_the_right_one(group: LazyGroup) -> None:
    done = CliRunner().invoke(group, ["goood"])
    assert done.exit_code == 2
    assert "No such command 'goood'. Did you mean 'good'?" in done.output
    assert "Did you mean" not in CliRunner().invoke(group, ["xyz"]).output
