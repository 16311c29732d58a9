from __future__ import annotations

import json
import stat
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli.token import command
from gatewayd.control.token_file import read_tokens


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "tokens"


def run(file: Path, *arguments: str) -> Result:
    return CliRunner().invoke(command, [*arguments, "--file", str(file)])


def test_a_token_is_made_listed_and_revoked(file: Path) -> None:
    made = run(file, "create", "anna", "--role", "engineer", "--expires", "8h")
    assert made.exit_code == 0, made.output
    text = made.stdout.strip()
    found = read_tokens(file).find(text)
    assert found is not None
    assert (found.name, found.role.title, found.expires - found.created) == ("anna", "engineer", 8 * 3600)
    assert "anna: engineer until " in made.stderr
    assert text not in file.read_text()
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    shown = run(file, "list").stdout
    assert "anna" in shown
    assert text not in shown
    assert json.loads(run(file, "list", "--json").stdout)[0]["role"] == "engineer"
    assert run(file, "revoke", "anna").stdout == "anna is revoked\n"
    assert read_tokens(file).tokens == ()


@pytest.mark.parametrize(
    "arguments, code, words",
    [
        (("create", "anna", "--role", "viewer"), 1, "there is a token anna already"),
        (("create", "a b", "--role", "viewer"), 1, "is no name"),
        (("create", "bert"), 2, "Missing option '--role'"),
        (("create", "bert", "--role", "root"), 2, "'viewer', 'operator', 'engineer'"),
        (("create", "bert", "--role", "viewer", "--expires", "11y"), 2, "up to 10y"),
        (("create", "bert", "--role", "viewer", "--expires", "90"), 2, "90d"),
        (("create", "bert", "--role", "viewer", "--expires", "0d"), 2, "8h, 90d, 1y"),
        (("revoke", "bert"), 1, "there is no token bert"),
    ],
)
def test_what_is_wrong_is_said_with_the_remedy(
    file: Path, arguments: tuple[str, ...], code: int, words: str
) -> None:
    assert run(file, "create", "anna", "--role", "viewer").exit_code == 0
    before = file.read_bytes()
    done = run(file, *arguments)
    assert (done.exit_code, words in done.stderr) == (code, True), done.output
    assert file.read_bytes() == before


def test_a_file_that_is_none_of_tokens(file: Path) -> None:
    for arguments in (("list",), ("revoke", "anna")):
        done = run(file, *arguments)
        assert done.exit_code == 2
        assert "No such file" in done.stderr
    done = run(file / "tokens", "create", "anna", "--role", "viewer")
    assert done.exit_code == 2
    file.write_text("secret-of-the-former-kind")
    file.chmod(0o600)
    done = run(file, "create", "anna", "--role", "viewer")
    assert done.exit_code == 1
    assert "move it away" in done.stderr
    assert "secret" not in done.output


def test_names_are_completed(file: Path) -> None:
    assert run(file, "create", "anna", "--role", "viewer").exit_code == 0
    revoke = command.commands["revoke"]
    context = revoke.make_context("revoke", ["--file", str(file)], resilient_parsing=True)
    assert [item.value for item in revoke.params[0].shell_complete(context, "a")] == ["anna"]
    assert revoke.params[0].shell_complete(context, "x") == []
