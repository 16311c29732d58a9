"""`gatewayd reload`: have the running gateway read its mapping files again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gatewayd.cli.remote import REFUSED, echo_json, json_option, on_gateway, readable
from gatewayd.core.objection import MEANINGS, ObjectionKind

if TYPE_CHECKING:
    from collections.abc import Mapping

    from gatewayd.control.client import Client

_KINDS = "\n".join(f"  {kind:<11}{meaning}" for kind, meaning in MEANINGS.items())
PATIENCE = 60.0
"""Seconds for the answer: many large files take a while on a small machine."""


@click.command(
    name="reload",
    epilog="""\b
Examples:
  gatewayd reload
  gatewayd reload --accept weakening   a longer time-out or wider limits, on purpose
  gatewayd diff /etc/gatewayd/press.yaml new.yaml   what it would change, before you do it

\b
Kinds of objections, each refused unless it is accepted:
KINDS
With any error in any file the old mapping runs on.
Exit codes:
  0  what runs now is what the files say
  1  refused, or a file has errors: the old mapping runs on, the reasons are printed
  2  wrong usage, or no gateway could be reached
""".replace("KINDS", _KINDS),
)
@click.option(
    "--accept",
    "kinds",
    multiple=True,
    type=click.Choice([kind.value for kind in ObjectionKind]),
    metavar="KIND",
    help="Apply the new mapping in spite of objections of this kind; may be repeated.",
)
@click.option("--force", is_flag=True, help="Apply the new mapping in spite of all objections.")
@on_gateway
@json_option
@click.pass_context
def command(
    context: click.Context, client: Client, *, kinds: tuple[str, ...], force: bool, as_json: bool
) -> None:
    """Have the running gateway read, check and compare its mapping files again, and serve them if that is safe.

    Links whose settings did not change stay up; owners and values of variables that did not change stay as they are.
    """
    from gatewayd.control.client import ControlError

    answer: Mapping[str, Any]
    try:
        answer = client.post("/v1/reload", {"force": force, "accept": list(kinds)}, patience=PATIENCE)
    except ControlError as error:
        if "result" not in error.body:
            raise
        answer = error.body
    done = answer.get("result") in ("applied", "unchanged")
    if as_json:
        echo_json(answer)
    else:
        for line in _lines(readable(answer)):
            click.echo(line, err=not done)
    context.exit(0 if done else REFUSED)


def _lines(answer: Mapping[str, Any]) -> list[str]:
    """What happened, in one line; then every reason, and what is or would be different."""
    result, reasons = answer.get("result"), answer.get("reasons", ())
    if result == "unchanged":
        # Not the mapping, but certificates that could not be read again, say.
        lines = ["nothing has changed" + (", but:" if reasons else "")]
    elif result == "applied":
        lines = [f"reloaded in {answer.get('swap_ms', 0):.1f} ms"]
    elif result == "refused":
        lines = ["refused, the old mapping runs on:"]
    else:
        lines = ["failed, the old mapping runs on:"]
    kinds = [each["kind"] for each in answer.get("objections", ())] if result == "refused" else []
    remedies = [f"--accept {kind}: {MEANINGS[kind]}" for kind in ObjectionKind if kind in kinds]
    if len(remedies) > 1:
        remedies.append("--force: all of this")
    return [*lines, *(f"  {line}" for line in (*reasons, *remedies, *answer.get("details", ())))]
