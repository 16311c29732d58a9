"""What imports are told of the cell, and what they make of what nobody said: its name, where the PLC connects to."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from ipaddress import ip_network
from pathlib import Path
from typing import Any, Final

import click

_EVERYWHERE, _HERE = "0.0.0.0:502", "127.0.0.1:502"
_MAX_CELL: Final = 64


_CELL_OPTIONS: Final = (
    click.option("--cell", metavar="NAME", help="Name of the cell; otherwise made of the file's name."),
    click.option(
        "--series", type=click.Choice(["cb3", "e", "x"]), help="Series of the controller, for `check`."
    ),
    click.option("--version", metavar="VERSION", help="Its software, for example 5.12, for `check`."),
)


_OUTPUT_OPTIONS: Final = (
    click.option(
        "-o",
        "--output",
        "out",
        metavar="OUT",
        type=click.Path(dir_okay=False),
        help="The mapping file to write; standard output otherwise.",
    ),
    click.option("--force", is_flag=True, help="Overwrite OUT if it exists."),
)


def output_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give an import the options -o and --force."""
    return _given(command, _OUTPUT_OPTIONS)


strict_option: Final = click.option("--strict", is_flag=True, help="Doubts count as errors.")
"""Gives an import that guesses the option --strict."""


def cell_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give an import the options --cell, --series and --version."""
    return _given(command, _CELL_OPTIONS)


def _given(command: Callable[..., Any], options: Iterable[Callable[..., Any]]) -> Callable[..., Any]:
    for option in reversed(tuple(options)):
        command = option(command)
    return command


def cell_name(file: str) -> str:
    """`record-configuration` for `record_configuration.xml`."""
    return re.sub(r"[^a-z0-9]+", "-", Path(file).stem.lower()).strip("-")[:_MAX_CELL].rstrip("-") or "robot"


def listen_address(writers: Iterable[str]) -> str:
    """Port 502, from other machines only if a writer is one; what is no address, the check of the mapping says."""
    return _HERE if all(map(_is_here, writers)) else _EVERYWHERE


def _is_here(address: str) -> bool:
    try:
        return ip_network(address, strict=False).is_loopback
    except ValueError:
        return False
