"""`gatewayd diff`: what a new mapping file changes of an old one."""

from __future__ import annotations

import click

from gatewayd.cli.files import format_option, load_file

SAME, DIFFERENT, UNREADABLE = 0, 1, 2
"""Exit codes."""


@click.command(
    name="diff",
    epilog="""\b
Examples:
  gatewayd diff running.yaml my-cell.yaml
  git show HEAD:my-cell.yaml | gatewayd diff - my-cell.yaml
  gatewayd diff --format json old.yaml new.yaml

\b
A line begins with + (added), - (removed) or ~ (changed, old -> new).
Exit codes:
  0  no difference
  1  differences
  2  wrong usage, or a file cannot be read or has errors (they are listed)
""",
)
@click.argument("old", type=click.Path(allow_dash=True))
@click.argument("new", type=click.Path(allow_dash=True))
@format_option("text", "json", help="For people or for programs.")
@click.pass_context
def command(context: click.Context, old: str, new: str, form: str) -> None:
    """Print what the mapping NEW changes in the mapping OLD: variables, owners, addresses, settings of the links.

    It compares what the files mean: the order of keys, spelling and formatting make no difference. `-` reads standard
    input.
    """
    from gatewayd.report.diff import as_json, as_text, compare

    if old == new == "-":
        raise click.UsageError("only one of the two files can be standard input")
    before, after = (loaded.plan if loaded is not None else None for loaded in map(load_file, (old, new)))
    if before is None or after is None:
        context.exit(UNREADABLE)
    changes = compare(before, after)
    click.echo(as_json(changes) if form == "json" else as_text(changes), nl=False)
    context.exit(DIFFERENT if changes else SAME)
