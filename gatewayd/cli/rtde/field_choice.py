"""Which fields a command is for: names as people type them, or a recipe of another client's file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import click

from gatewayd.rtde.catalogue import suggest
from gatewayd.rtde.fields import INPUTS, OUTPUTS, UNTYPED
from gatewayd.rtde.session import TIMESTAMP
from gatewayd.rtde.types import DataType

USUAL = (
    TIMESTAMP,
    "target_q",
    "actual_q",
    "actual_qd",
    "actual_current",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "speed_scaling",
    "robot_mode",
    "safety_mode",
    "runtime_state",
    "actual_digital_input_bits",
    "actual_digital_output_bits",
)
"""What is recorded if nobody says what: what every controller has, and the plotters ask for."""

Fields = Mapping[str, DataType | None]
"""Names in their order, with the types that are declared."""


def named(texts: Iterable[str], known: Mapping[str, object] = OUTPUTS) -> tuple[str, ...]:
    """The names of `a,b c` and the like, each once. UsageError for one that cannot be a field.

    One that is in no guide is let through, as the controller may be newer, unless a known one comes so near that it
    is a slip of the pen.
    """
    given = tuple(texts)
    names = tuple(dict.fromkeys(name for text in given for name in text.replace(",", " ").split()))
    if given and not names:
        raise click.UsageError("no field is named: gatewayd rtde fields lists them")
    for name in names:
        if name in known or name in UNTYPED:
            continue
        if not name.isascii() or not name.isidentifier():
            raise click.UsageError(f"{name!r} is not the name of a field, see gatewayd rtde fields")
        near = suggest(name, known)
        if near and near[0].lower() == name.lower():
            raise click.UsageError(f"there is no field {name}: it is written {near[0]}")
    return names


def hint(name: str) -> str:
    """`; did you mean actual_q?` where a name is in no guide and another comes near; else empty."""
    if name in OUTPUTS or name in INPUTS:
        return ""
    near = suggest(name)
    return f"; did you mean {' or '.join(near)}?" if near else ""


def of_file(path: str | Path, key: str | None) -> Fields:
    """The fields of a recipe file, with their declared types; UsageError where it cannot be used."""
    from gatewayd.rtde.recipes import RecipeFileError, read_recipes

    try:
        recipe = read_recipes(path).recipe(key)
    except RecipeFileError as error:
        raise click.UsageError(str(error)) from error
    except OSError as error:
        raise click.UsageError(f"{path}: cannot be read: {error.strerror or error}") from error
    return {field.name: field.type for field in recipe.fields}
