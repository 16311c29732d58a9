"""Print the manual page gatewayd(1), made from what the commands say with --help.

`python packaging/manual.py > gatewayd.1`. SOURCE_DATE_EPOCH dates it.
"""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Iterator

import click

from gatewayd import __version__
from gatewayd.cli import COMMANDS, command

FILES = {
    "/etc/gatewayd/*.yaml": "One mapping for each robot cell.",
    "/etc/default/gatewayd": "Environment of the service.",
    "/run/gatewayd/control.sock": "Control socket of the service.",
    "/var/lib/gatewayd": "State of the service.",
    "/usr/share/doc/gatewayd": "The documentation, and examples of mappings and drop-ins.",
}


def plain(text: str) -> str:
    """Text as roff takes it: nothing in it is a command."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return re.sub(r"^([.'])", r"\\&\1", text, flags=re.MULTILINE)


def paragraphs(text: str) -> Iterator[str]:
    """Help as click writes it: paragraphs; what begins with a backspace is lines that stay as they are."""
    for paragraph in re.split(r"\n\s*\n", text.strip()):
        head, _, rest = paragraph.partition("\n")
        if head.strip() == "\b":
            yield f".PP\n.nf\n{plain(rest)}\n.fi"
        else:
            yield f".PP\n{plain(' '.join(paragraph.split()))}"


def options(ctx: click.Context) -> Iterator[str]:
    """What the command takes."""
    for parameter in ctx.command.get_params(ctx):
        term, text = parameter.get_help_record(ctx) or ("", "")
        if text:
            yield f".TP\n.B {plain(term)}\n{plain(text)}"


def described(ctx: click.Context) -> Iterator[str]:
    """Usage, text and options of one command."""
    yield f".B gatewayd {ctx.info_name}\n{plain(' '.join(ctx.command.collect_usage_pieces(ctx)))}"
    yield from paragraphs(ctx.command.help or "")
    yield from options(ctx)
    yield from paragraphs(ctx.command.epilog or "")


def variables(contexts: list[click.Context]) -> Iterator[str]:
    """The variables of the environment that stand for options."""
    found: dict[str, list[str]] = {}
    for ctx in contexts:
        for parameter in ctx.command.params:
            if isinstance(parameter.envvar, str):
                found.setdefault(parameter.envvar, []).append(f"{ctx.info_name} {parameter.opts[0]}")
    for name, places in sorted(found.items()):
        yield f".TP\n.B {name}\nStands for the option: {plain(', '.join(places))}."
    yield ".TP\n.B GATEWAYD_TRACEBACK\n1: show where an internal error came from."


def commands(root: click.Context, group: click.Group, name: str, before: str = "") -> Iterator[click.Context]:
    """A command of a group, and those that belong to it: `locks`, `locks take`."""
    found = group.get_command(root, name)
    assert found is not None
    yield click.Context(found, info_name=before + name, parent=root, **found.context_settings)
    if isinstance(found, click.Group):
        for inner in found.list_commands(root):
            yield from commands(root, found, inner, f"{before}{name} ")


def page(date: str) -> str:
    """The whole page."""
    root = click.Context(command, info_name="gatewayd", **command.context_settings)
    contexts = [made for name in COMMANDS for made in commands(root, command, name)]
    purpose, _, example = (command.help or "").partition("\n\n")
    lines = [
        f'.TH GATEWAYD 1 {date} "gatewayd {__version__}" "User Commands"',
        ".SH NAME\ngatewayd \\- fieldbus gateway for Universal Robots controllers",
        ".SH SYNOPSIS\n.B gatewayd\n[OPTIONS] COMMAND [ARGS]...",
        ".SH DESCRIPTION",
        *paragraphs(purpose),
        *paragraphs(example),
        ".SH OPTIONS",
        *options(root),
        ".SH COMMANDS",
    ]
    for ctx in contexts:
        lines += [f".SS {ctx.info_name}", *described(ctx)]
    lines += [".SH EXIT STATUS", *paragraphs(command.epilog or "")]
    lines += [".SH ENVIRONMENT", *variables(contexts)]
    lines += [".SH FILES", *(f".TP\n.I {plain(path)}\n{text}" for path, text in FILES.items())]
    lines += [".SH SEE ALSO\n.BR systemd.service (5),\n.I /usr/share/doc/gatewayd/README.md"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    now = int(os.environ.get("SOURCE_DATE_EPOCH") or time.time())
    sys.stdout.write(page(time.strftime("%Y-%m-%d", time.gmtime(now))))
