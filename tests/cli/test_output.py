"""Files that commands write."""

from __future__ import annotations

from pathlib import Path

import click
import pytest
from click.exceptions import Exit

from gatewayd.cli.output import refuse_existing, write_bytes, write_text


@pytest.fixture
def context() -> click.Context:
    return click.Context(click.Command("x"))


def test_the_first_file_that_exists_is_named_with_the_remedy(tmp_path: Path) -> None:
    new, old = tmp_path / "new", tmp_path / "old"
    old.touch()
    with pytest.raises(click.UsageError) as refused:
        refuse_existing(new, old, overwrite=False)
    assert (
        refused.value.message == f"{old}: is there already; choose another name, or overwrite it with --force"
    )
    refuse_existing(new, old, overwrite=True)
    refuse_existing(new, overwrite=False)


def test_text_keeps_its_line_ends_and_has_its_encoding(context: click.Context, tmp_path: Path) -> None:
    write_text(context, tmp_path / "a", "°\n")
    write_text(context, str(tmp_path / "b"), "x\r\n", encoding="ascii")
    assert (tmp_path / "a").read_bytes() == b"\xc2\xb0\n"
    assert (tmp_path / "b").read_bytes() == b"x\r\n"


@pytest.mark.parametrize("name", ["", "a\0b"])
def test_what_cannot_be_written_ends_the_command_in_one_line(
    name: str, context: click.Context, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(Exit) as ended:
        write_bytes(context, tmp_path / name, b"x")
    assert ended.value.exit_code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert ": cannot be written: " in line


def test_text_that_the_encoding_lacks_ends_the_command(
    context: click.Context, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(Exit):
        write_text(context, tmp_path / "a", "°", encoding="ascii")
    assert "cannot be written: 'ascii' codec can't encode" in capsys.readouterr().err
