"""`gatewayd rtde fields`: which fields a controller has, by the catalogue or by its own answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gatewayd.cli.files import format_option
from gatewayd.cli.rtde.target import TARGET, Target

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gatewayd.cli.rtde.field_rows import FieldRow
    from gatewayd.rtde.fields import Series, SoftwareVersion
    from gatewayd.rtde.survey import Survey

NOT_ALL = 1
"""Exit code: the controller did not answer all of it."""


@click.command(
    name="fields",
    epilog="""\b
Examples:
  gatewayd rtde fields                                  every field that is known of
  gatewayd rtde fields --series e --version 5.12        those that this software should have
  gatewayd rtde fields 192.0.2.10                       those that this controller says it has
  gatewayd rtde fields 192.0.2.10 --ask dexterity       a name that is newer than the catalogue, too
  gatewayd rtde fields 192.0.2.10 --probe-claims        inputs as well, and which are in use
  gatewayd rtde fields --format csv > fields.csv        one line for each register

\b
Exit codes:
  0  printed
  1  the controller was not reached, or did not answer everything
  2  wrong usage
""",
)
@click.argument("host", type=TARGET, required=False)
@click.option("--series", type=click.Choice(["cb3", "e", "x"]), help="Only what this series has.")
@click.option(
    "--version", metavar="VERSION", help="Only what this software has, say 5.12 (its series follows)."
)
@click.option(
    "--ask", "further", multiple=True, metavar="NAME", help="Ask HOST for this output, too. Repeatable."
)
@click.option(
    "--probe-claims",
    is_flag=True,
    help="Ask HOST for inputs, too. Only claiming shows them: each is taken from all others for a moment, "
    "nothing is written.",
)
@format_option("table", "csv", "json", help="For people, for spreadsheets, for programs.")
@click.option("--json", "as_json", is_flag=True, help="The same as --format json.")
@click.pass_context
def command(
    context: click.Context,
    host: Target | None,
    series: str | None,
    version: str | None,
    *,
    further: tuple[str, ...],
    form: str,
    probe_claims: bool,
    as_json: bool,
) -> None:
    """Print the fields of RTDE with type, unit and first version: by the catalogue, or as the controller HOST answers.

    HOST is asked for every field of the catalogue, by recipes that are never started: that disturbs nobody, and
    nothing is written. Its answer is the truth; the catalogue knows what the guides say.
    """
    form = "json" if as_json else form
    if host is None:
        if further or probe_claims:
            raise click.UsageError("--ask and --probe-claims ask a controller: name its HOST")
        _print(form, _catalogue(series, version), {})
        return
    if series or version:
        raise click.UsageError("HOST says its series and version itself: leave --series and --version out")
    found = _survey(host, further, inputs=probe_claims)
    if found.session is not None:
        _print_answers(form, found, with_inputs=probe_claims)
    if found.loss is not None:
        from gatewayd.report.printable import printable

        click.echo(printable(f"gatewayd: {found.loss.text}"), err=True)
        context.exit(NOT_ALL)


def _catalogue(series: str | None, version: str | None) -> list[FieldRow]:
    from gatewayd.cli.rtde.field_rows import catalogue_rows

    return catalogue_rows(*_generation(series, version))


def _generation(series: str | None, version: str | None) -> tuple[Series | None, SoftwareVersion | None]:
    from gatewayd.rtde.fields import Series, SoftwareVersion

    named = Series.from_word(series) if series is not None else None
    if version is None:
        return named, None
    try:
        software = SoftwareVersion.parse(version)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--version'") from error
    own = Series.from_major(software.major)
    if own is None or named not in (None, own):
        known = ", ".join(f"{each.major} ({each.word})" for each in Series)
        raise click.BadParameter(
            f"{version} is no software of series {series or 'cb3, e or x'}: versions begin with {known}",
            param_hint="'--version'",
        )
    return own, software


def _survey(host: Target, further: Sequence[str], *, inputs: bool) -> Survey:
    import asyncio

    from gatewayd.rtde.fields import INPUTS, OUTPUTS, UNTYPED
    from gatewayd.rtde.session import ClientSettings
    from gatewayd.rtde.survey import survey

    outputs = tuple(dict.fromkeys((*OUTPUTS, *sorted(UNTYPED), *further)))
    settings = ClientSettings(host=host[0], port=host[1])
    try:
        found = asyncio.run(survey(settings, outputs, tuple(INPUTS) if inputs else ()))
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--ask'") from error
    # They were asked for in lists that fill up to their limit, out of order: families would not be together.
    found.outputs = {name: found.outputs[name] for name in outputs if name in found.outputs}
    found.inputs = {name: found.inputs[name] for name in INPUTS if name in found.inputs}
    return found


def _print_answers(form: str, found: Survey, *, with_inputs: bool) -> None:
    from gatewayd.cli.rtde.field_rows import answered_rows

    session = found.session
    assert session is not None
    heading = {
        "controller": str(session.controller),
        "series": session.series.word if session.series is not None else None,
        "protocol": session.protocol,
        "complete": found.loss is None,
        "claims_probed": with_inputs,
    }
    _print(form, answered_rows(found.outputs, found.inputs, session.controller.software), heading)
    if form == "table" and not with_inputs:
        click.echo("inputs were not asked for: only claiming shows them, which --probe-claims does")


def _print(form: str, rows: Sequence[FieldRow], heading: dict[str, Any]) -> None:
    from gatewayd.cli.rtde.field_rows import as_csv, as_object
    from gatewayd.report.printable import json_document

    if form == "csv":
        click.echo(as_csv(rows), nl=False)
    elif form == "json":
        document = {"version": 1, **heading, "fields": [as_object(row) for row in rows]}
        click.echo(json_document(document), nl=False)
    else:
        _print_table(rows, heading)


def _print_table(rows: Sequence[FieldRow], heading: dict[str, Any]) -> None:
    from gatewayd.cli.printing import echo
    from gatewayd.cli.rtde.field_rows import folded, is_there, remark
    from gatewayd.report.format import counted
    from gatewayd.report.printable import printable

    if heading:
        series = heading["series"] or "unknown"
        echo(f"controller {heading['controller']}, series {series}, protocol {heading['protocol']}")
    shown = folded(rows)
    columns = ("name", "direction", "type", "unit", "since")
    widths = {column: max(len(column), *(len(getattr(row, column)) for row in shown)) for column in columns}
    echo("  ".join([*(column.ljust(widths[column]) for column in columns), "comment"]), broken=False)
    for row in shown:
        texts = (getattr(row, column).ljust(widths[column]) for column in columns)
        echo(printable("  ".join([*texts, remark(row)]).rstrip()), broken=False)
    there = sum(map(is_there, rows))
    left = f", {len(rows) - there} of them not there" if there < len(rows) else ""
    echo(f"{counted(len(rows), 'field')}{left}")
