"""`gatewayd token`: make, list and revoke the tokens of those who come over the network."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

if TYPE_CHECKING:
    from collections.abc import Callable

    from gatewayd.control.tokens import TokenSet

DEFAULT_FILE = Path("/etc/gatewayd/tokens")
_REFUSED, _UNREADABLE = 1, 2
"""Exit codes."""
_ROLES = ("viewer", "operator", "engineer")
_DAY = 86400.0
_MAX_DAYS = 3650


class Lifetime(click.ParamType):  # type: ignore[type-arg]
    """`90d`, `12h`, `1y`, as seconds."""

    name = "lifetime"
    _UNITS = {"h": 3600.0, "d": _DAY, "w": 7 * _DAY, "y": 365 * _DAY}  # noqa: RUF012 - never changed
    _TEXT = re.compile(r"([0-9]{1,5})\s*([hdwy])")

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Seconds; fails with a hint."""
        found = self._TEXT.fullmatch(str(value).strip())
        seconds = float(found[1]) * self._UNITS[found[2]] if found else 0.0
        if not 0 < seconds <= _MAX_DAYS * _DAY:
            self.fail(f"{value!r}: write a number with h, d, w or y, up to 10y: 8h, 90d, 1y", param, ctx)
        return seconds


class _TokenError(click.ClickException):
    exit_code = _REFUSED


def _complete_names(context: click.Context, _param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Names in the file, as far as it can be read."""
    from gatewayd.control.token_file import read_tokens
    from gatewayd.control.tokens import TokenFileError

    try:
        tokens = read_tokens(context.params.get("file") or DEFAULT_FILE).tokens
    except (TokenFileError, OSError):
        return []
    return [
        CompletionItem(token.name, help=token.role.title)
        for token in tokens
        if token.name.startswith(incomplete)
    ]


_file_option = click.option(
    "--file",
    type=click.Path(path_type=Path),
    envvar="GATEWAYD_TOKEN_FILE",
    default=DEFAULT_FILE,
    show_default=True,
    is_eager=True,
    help="The file of tokens that `gatewayd run --token-file` reads.",
)


@click.group(
    name="token",
    epilog="""\b
Examples:
  gatewayd token create anna --role engineer
  gatewayd token create prometheus --role viewer --expires 1y
  gatewayd token list
  gatewayd token revoke anna

\b
Roles (each may do what those above it may):
  viewer    read the status page, the API and the metrics
  operator  take and release locks
  engineer  force variables, end forces, reload the mapping

\b
Exit codes:
  0  done, printed
  1  refused: a name that is taken or not there, a file that is not one of tokens
  2  wrong usage, or the file cannot be read or written
""",
)
def command() -> None:
    """Make, list and revoke the tokens by which people and programs use the status page and its API.

    A running gateway notices a change of the file within a second.
    """


@command.command(
    name="create",
    short_help="Make a token, and print it once.",
    epilog="""\b
Examples:
  gatewayd token create anna --role engineer               ends after 90 days
  gatewayd token create shift-2 --role operator --expires 8h
  gatewayd token create prometheus --role viewer --expires 1y > prometheus-token
""",
)
@click.argument("name")
@click.option("--role", type=click.Choice(_ROLES), required=True, help="What it may do.")
@click.option(
    "--expires",
    type=Lifetime(),
    default="90d",
    show_default=True,
    metavar="TIME",
    help="After which it ends.",
)
@_file_option
def create(name: str, role: str, expires: float, file: Path) -> None:
    """Make a token NAME, and print it. It is shown once: the file has only its hash.

    NAME is what the audit, events and the page say of what is done with it: use one token for each person or program.
    """
    import secrets
    import time

    from gatewayd.control.access import ROLES
    from gatewayd.control.tokens import RANDOM_BYTES, new_token, utc_text

    wall = time.time()
    token, text = new_token(name, ROLES[role], wall, expires, secrets.token_bytes(RANDOM_BYTES))
    _change(file, lambda tokens: tokens.with_token(token, wall))
    click.echo(f"{name}: {role} until {utc_text(token.expires)}, in {file}. Its token, shown once:", err=True)
    click.echo(text)


@command.command(name="list", short_help="Print names, roles and when each ends.")
@_file_option
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON, for programs.")
def list_tokens(file: Path, *, as_json: bool) -> None:
    """Print the tokens of the file: name, role, when each was made and when it ends. Never the tokens themselves."""
    import json
    import time

    from gatewayd.control.tokens import utc_text

    wall = time.time()
    found = [
        {
            "name": token.name,
            "role": token.role.title,
            "created": utc_text(token.created),
            "expires": utc_text(token.expires),
            "expired": token.has_ended(wall),
        }
        for token in _read(file).tokens
    ]
    if as_json:
        click.echo(json.dumps(found, indent=2))
        return
    click.echo(f"{'name':<20}  {'role':<8}  {'made':<20}  ends")
    for token in found:
        ended = " (ended)" if token["expired"] else ""
        click.echo(f"{token['name']:<20}  {token['role']:<8}  {token['created']}  {token['expires']}{ended}")


@command.command(name="revoke", short_help="Revoke a token; what it holds ends.")
@click.argument("name", shell_complete=_complete_names)
@_file_option
def revoke(name: str, file: Path) -> None:
    """Revoke token NAME: a running gateway refuses it within a second, and ends what it took and forced.

    The release fallbacks apply, as with `gatewayd locks release` and `gatewayd unforce`.
    """
    if _read(file).named(name) is None:
        raise _TokenError(f"{file}: there is no token {name}; gatewayd token list shows which there are")
    _change(file, lambda tokens: tokens.without(name))
    click.echo(f"{name} is revoked")


def _read(file: Path) -> TokenSet:
    from gatewayd.control.token_file import read_tokens
    from gatewayd.control.tokens import TokenFileError

    try:
        return read_tokens(file)
    except TokenFileError as error:
        raise _TokenError(str(error)) from error
    except OSError as error:
        raise _unusable(file, error) from error


def _change(file: Path, change: Callable[[TokenSet], TokenSet]) -> None:
    from gatewayd.control.token_file import change_tokens
    from gatewayd.control.tokens import TokenFileError

    try:
        change_tokens(file, change)
    except TokenFileError as error:
        raise _TokenError(str(error)) from error
    except OSError as error:
        raise _unusable(file, error) from error


def _unusable(file: Path, error: OSError) -> click.UsageError:
    return click.UsageError(f"{file}: {error.strerror}; name another file with --file")
