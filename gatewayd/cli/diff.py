"""`gatewayd diff`: what a new mapping file changes of an old one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gatewayd.cli.files import format_option, name_of, read_file, reason_of
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from gatewayd.mapping.plan import Plan

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

    It compares what the files mean: the order of keys, spelling and formatting make no difference. The section `tests`
    does not count, as in a reload: a mistake in it is a note on standard error. `-` reads standard input.
    """
    from gatewayd.report.diff import as_json, as_text, compare

    if old == new == "-":
        raise click.UsageError("only one of the two files can be standard input")
    before, after = map(_plan_of, (old, new))
    if before is None or after is None:
        context.exit(UNREADABLE)
    changes = compare(before, after)
    click.echo(as_json(changes) if form == "json" else as_text(changes), nl=False)
    context.exit(DIFFERENT if changes else SAME)


def _plan_of(file: str) -> Plan | None:
    """What a reload would serve; None after it was said why there is nothing. Mistakes in `tests` are notes."""
    from gatewayd.mapping.loader import load, load_together
    from gatewayd.report.findings import CheckOutcome, as_text

    name = name_of(file)
    try:
        data = read_file(file)
    except (OSError, ValueError) as error:
        click.echo(printable(f"{name}: cannot be read: {reason_of(error)}"), err=True)
        return None
    loaded = load(data, name)
    if loaded.plan is not None:
        return loaded.plan
    (served,) = load_together([(name, data)], tests=False)
    if served.plan is None:
        click.echo(as_text(CheckOutcome((name,), loaded.diagnostics)), nl=False, err=True)
        return None
    for finding in loaded.diagnostics:
        if finding not in served.diagnostics:
            place = f"{finding.position.file}:{finding.position.line}:{finding.position.column}"
            text = f"{place}: note: {finding.rule.id} {finding.rule.slug}, in tests only: {finding.message}"
            click.echo(printable(text), err=True)
    return served.plan
