"""`gatewayd test`: the tests of mapping files, with the core in simulated time."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import click

from gatewayd.cli.files import format_option, mapping_files, read_named

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gatewayd.mapping.compiled import Unreadable
    from gatewayd.maptest.report import RunReport
    from gatewayd.maptest.run import FileOutcome

PASSED, FAILED, UNREADABLE = 0, 1, 2
"""Exit codes."""


@click.command(
    name="test",
    epilog="""\b
Examples:
  gatewayd test my-cell.yaml
  gatewayd test cells/*.yaml                     every file by itself
  gatewayd test -v my-cell.yaml                  name what passed too
  gatewayd test --only "lost plc" my-cell.yaml   tests with these words in their names
  gatewayd test --format junit my-cell.yaml > tests.xml

\b
Tests stand in the mapping file, under `tests:`. Nothing that runs depends on them:
  tests:
    the hmi is refused while the plc holds speed:
      - {by: plc, write: {speed: 50}}
      - {by: hmi, write: {speed: 30}, refused: held}
      - {after: 3s, expect: {speed: 0}}

\b
A failure looks like this:
  cell.yaml:42:30: failed: "a lost plc stops the robot": step 2: expected speed 0, is 50 (owner plc since 0 s)
      hint: what ends the ownership of plc by itself: its lease at 5 s

\b
Exit codes:
  0  all tests passed
  1  a test failed, a file has errors, or there is no test at all
  2  wrong usage, or a file that cannot be read (the others are tested all the same)
""",
)
@click.argument("files", nargs=-1, required=True, type=click.Path(allow_dash=True))
@format_option(
    "text", "json", "junit", help="How results are written: for people, for programs, as JUnit's XML."
)
@click.option("--only", metavar="TEXT", help="Carry out the tests whose names contain this, in any case.")
@click.option("-v", "--verbose", is_flag=True, help="Name the tests that passed too (text only).")
@click.pass_context
def command(
    context: click.Context, files: tuple[str, ...], form: str, only: str | None, *, verbose: bool
) -> None:
    """Carry out the tests that stand in mapping FILES, in simulated time, without robot and bus.

    Every file is checked first, as by `gatewayd check`; tests of a file with errors are not carried out. Each test
    begins with a cell of its own: the robot is connected, its registers are zero, and no writer has come. `-` reads
    standard input; a directory stands for its mapping files.
    """
    report = _run(files, only or "", say=partial(_say, verbose=verbose) if form == "text" else None)
    if only and not (report.carried_out or report.broken or report.unreadable):
        raise click.BadParameter(f"no test has `{only}` in its name", param_hint="'--only'")
    click.echo(_written(report, form), nl=False)
    if report.unreadable:
        context.exit(UNREADABLE)
    context.exit(FAILED if report.failed or report.broken or not report.carried_out else PASSED)


def _run(files: Sequence[str], only: str, say: Callable[[FileOutcome], None] | None) -> RunReport:
    from gatewayd.mapping.loader import load
    from gatewayd.maptest.report import RunReport
    from gatewayd.maptest.run import run_file

    wanted = only.casefold()
    outcomes: list[FileOutcome] = []
    unreadable: list[Unreadable] = []
    for name, content in map(read_named, mapping_files(files)):
        if not isinstance(content, bytes):
            unreadable.append(content)
            continue
        outcomes.append(run_file(load(content, name), lambda test: wanted in test.casefold()))
        if say is not None:
            say(outcomes[-1])
    return RunReport(tuple(outcomes), tuple(unreadable))


def _say(outcome: FileOutcome, *, verbose: bool) -> None:
    """Report a file as soon as its tests have ended."""
    from gatewayd.maptest.report import file_text

    click.echo(file_text(outcome, verbose=verbose), nl=False)


def _written(report: RunReport, form: str) -> str:
    from gatewayd.maptest.report import as_json, as_junit, summary

    return {"text": summary, "json": as_json, "junit": as_junit}[form](report)
