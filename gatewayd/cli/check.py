"""`gatewayd check`: every mistake in mapping files in one pass, without a robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

from gatewayd.cli.files import format_option, mapping_files, read_named

if TYPE_CHECKING:
    from gatewayd.mapping.compiled import Unreadable
    from gatewayd.report.findings import CheckOutcome

CLEAN, FOUND, UNREADABLE = 0, 1, 2
"""Exit codes."""


def _complete_rules(
    _context: click.Context, _param: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Ids and names of rules that begin with `incomplete`, with what they find."""
    from gatewayd.mapping.rules.catalogue import complete

    return [
        CompletionItem(name, help=rule.summary)
        for rule in complete()
        for name in (rule.id, rule.slug)
        if incomplete and name.casefold().startswith(incomplete.casefold())
    ]


@click.command(
    name="check",
    epilog="""\b
Examples:
  gatewayd check my-cell.yaml
  gatewayd check cells/*.yaml               cells of one gateway: what they share is checked too
  gatewayd check /etc/gatewayd              the same for all files of a directory
  gatewayd check --separately a.yaml b.yaml  two mappings that never run together
  gatewayd check --strict my-cell.yaml      warnings count as errors
  gatewayd check --format github *.yaml     annotations in a pull request
  gatewayd check --explain GW214            why a rule exists and what to do
  gatewayd check --explain all              the list of all rules

\b
A finding looks like this:
  cell.yaml:12:53: error GW214 register-overlap: `parts` lies at holding registers 101 to 102 (400102 to 400103), ...
      cell.yaml:11:53: `cycles`, holding registers 100 to 101 (400101 to 400102), first used here
      hint: the line fits at 102 to 103 (400103 to 400104)

\b
Exit codes:
  0  nothing found, or warnings only
  1  errors; with --strict also warnings
  2  wrong usage, or a file that cannot be read (the others are checked all the same)
""",
)
@click.argument("files", nargs=-1, type=click.Path(allow_dash=True))
@format_option(
    "text",
    "json",
    "github",
    help="How findings are written: for people, for programs, for GitHub's annotations.",
)
@click.option("--strict", is_flag=True, help="Fail on warnings too.")
@click.option(
    "--separately", is_flag=True, help="Check each file by itself: the cells will not run in one gateway."
)
@click.option(
    "--explain",
    metavar="RULE",
    shell_complete=_complete_rules,
    help="Explain a rule by its id or name, or list `all`, and stop.",
)
@click.pass_context
def command(
    context: click.Context,
    files: tuple[str, ...],
    form: str,
    explain: str | None,
    *,
    strict: bool,
    separately: bool,
) -> None:
    """Find every mistake in mapping FILES, all in one pass, each with file, line and column.

    It checks all that can be known without the plant: the text, the Modbus addresses, the robot's fields, who may
    write, what happens when a side is lost, and what number conversions lose. `-` reads standard input; a directory
    stands for its mapping files, *.yaml and *.yml, except those whose names begin with a dot.
    """
    if explain is not None:
        click.echo(_explain(explain), nl=False)
        return
    if not files:
        raise click.UsageError("name at least one mapping file, for example: gatewayd check my-cell.yaml")
    outcome = _check(files, separately=separately)
    click.echo(_written(outcome, form), nl=False)
    if outcome.unreadable:
        context.exit(UNREADABLE)
    context.exit(FOUND if outcome.errors or (strict and outcome.findings) else CLEAN)


def _check(files: tuple[str, ...], *, separately: bool) -> CheckOutcome:
    from gatewayd.mapping.loader import load, load_together
    from gatewayd.mapping.remarks import remarks
    from gatewayd.report.findings import CheckOutcome

    readable: list[tuple[str, bytes]] = []
    unreadable: list[Unreadable] = []
    for name, content in map(read_named, mapping_files(files)):
        if isinstance(content, bytes):
            readable.append((name, content))
        else:
            unreadable.append(content)
    loaded = tuple(load(data, name) for name, data in readable) if separately else load_together(readable)
    findings = tuple(finding for mapping in loaded for finding in mapping.diagnostics)
    sound = [mapping for mapping in loaded if mapping.plan is not None]
    noted = tuple((mapping.name, remark) for mapping in sound for remark in remarks(mapping.cell))
    return CheckOutcome(tuple(name for name, _ in readable), findings, tuple(unreadable), noted)


def _written(outcome: CheckOutcome, form: str) -> str:
    from gatewayd.report.findings import as_github, as_json, as_text

    if form == "json":
        return as_json(outcome)
    if form == "github":
        return as_github(outcome)
    return as_text(outcome, colour=_wants_colour())


def _wants_colour() -> bool:
    import os
    import sys

    return sys.stdout.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def _explain(name: str) -> str:
    from gatewayd.mapping.diagnostics import retired_rule_of, rule_of
    from gatewayd.mapping.rules.catalogue import complete, explanation

    rules = complete()
    if name == "all":
        return "".join(
            f"{rule.id}  {rule.slug:<24} {rule.severity.value:<8} {rule.summary}\n" for rule in rules
        )
    rule = rule_of(name) or retired_rule_of(name)
    if rule is None:
        from gatewayd.report.wording import did_you_mean

        known = [*(rule.id for rule in rules), *(rule.slug for rule in rules)]
        hint = did_you_mean(name, known, "`gatewayd check --explain all` lists them")
        raise click.BadParameter(f"there is no rule `{name}`; {hint}", param_hint="'--explain'")
    return explanation(rule)
