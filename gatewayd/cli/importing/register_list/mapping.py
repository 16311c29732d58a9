"""The mapping file of a register list, and which of its lines is which row."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal

from gatewayd.cli.importing.register_list.numbers import WORDS
from gatewayd.cli.importing.register_list.rows import ListedPlace
from gatewayd.cli.importing.register_list.variables import ListedLine

_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_.-]*|[0-9]{1,3}(?:\.[0-9]{1,3}){3}(?::[0-9]+|/[0-9]+)?")
_WORDS_OF_YAML = frozenset({"true", "false", "null", "none"})
_OF_WORDS = frozenset({"ABCD", "CDAB"})
"""Orders that say nothing of a single register."""
_OWN_TYPES = frozenset({"", "bit"})


@dataclass(frozen=True, slots=True)
class ListSettings:
    """What no list says of a cell."""

    cell: str
    host: str
    listen: str
    writers: Mapping[str, str]
    """Name -> address."""
    series: str | None = None
    version: str | None = None


@dataclass(frozen=True, slots=True)
class MadeMapping:
    """The text, and the row that each line of it is made from."""

    text: str
    rows: Mapping[int, ListedLine]
    """By line of the text, from 1."""


def mapping_of(lines: Sequence[ListedLine], settings: ListSettings, source: str) -> MadeMapping:
    """The mapping, one line for each variable or family."""
    text = [*_head(lines, settings, source), "", "variables:"]
    rows: dict[int, ListedLine] = {}
    for line in lines:
        text.append(_variable(line, settings))
        rows[len(text)] = line
    return MadeMapping("\n".join(text) + "\n", rows)


def _head(lines: Sequence[ListedLine], settings: ListSettings, source: str) -> Iterator[str]:
    yield f"# Proposed by `gatewayd import csv` from {json.dumps(source)}: read it before you use it."
    yield ""
    yield "gatewayd: 1"
    yield f"cell: {_text(settings.cell)}"
    yield ""
    yield "robot:"
    yield f"  host: {_text(settings.host)}"
    if settings.series is not None:
        yield f"  series: {settings.series}"
    if settings.version is not None:
        yield f"  version: {json.dumps(settings.version)}"
    yield ""
    yield "modbus:"
    yield f"  listen: {_text(settings.listen)}"
    if settings.writers:
        yield f"  allow: [{_joined(map(_text, dict.fromkeys(settings.writers.values())))}]"
        yield ""
        yield "writers:"
        for name, address in settings.writers.items():
            yield f"  {name}: {{modbus: {_text(address)}, timeout: 2s}}"
    groups = _groups(lines)
    if groups:
        yield ""
        yield "groups:"
        yield from (f"  {name}: {{{_joined(_ownership(place))}}}" for name, place in groups.items())


def _groups(lines: Sequence[ListedLine]) -> dict[str, ListedPlace]:
    found: dict[str, ListedPlace] = {}
    for line in lines:
        if line.first.row.text("group"):
            found.setdefault(line.first.row.text("group"), line.first)
    return found


def _variable(line: ListedLine, settings: ListSettings) -> str:
    first = line.first
    entries = [_place(place) for place in line.places]
    places = entries[0] if len(entries) == 1 else "[" + ", ".join(entries) + "]"
    parts = [f"robot: {_text(line.robot)}", f"modbus: {places}"]
    row = first.row
    if first.is_input:
        parts += _owned(first, settings)
        if row.text("on_release"):
            parts.append(f"on_release: {_value(row.text('on_release'))}")
    elif row.text("on_stale"):
        parts.append(f"on_stale: {_value(row.text('on_stale'))}")
    if first.limits is not None:
        parts.append(f"limits: [{_number(first.limits[0])}, {_number(first.limits[1])}]")
    if row.text("clamp").lower() == "true":
        parts.append("clamp: true")
    if row.text("valid"):
        parts.append(f"valid: {_text(row.text('valid'))}")
    parts += [f"{key}: {_text(row.text(key))}" for key in ("unit", "comment") if row.text(key)]
    return f"  {line.name}: {{{_joined(parts)}}}"


def _owned(place: ListedPlace, settings: ListSettings) -> list[str]:
    if place.row.text("group"):
        return [f"group: {_text(place.row.text('group'))}"]
    if place.row.text("owner"):
        return list(_ownership(place))
    return [f"owner: {next(iter(settings.writers), 'any')}"]


def _ownership(place: ListedPlace) -> Iterator[str]:
    row = place.row
    names = [name.strip() for name in re.split(r"[>,]", row.text("owner")) if name.strip()]
    yield f"owner: {names[0]}" if len(names) == 1 else f"owner: [{_joined(names)}]"
    shared = len(names) > 1 or names == ["any"]
    if place.lease is not None:
        yield f"lease: {_number(place.lease)}s"
    elif shared and row.text("number"):
        yield "lease: none"
    if len(names) > 1 and row.text("takeover").lower() in ("true", "false"):
        yield f"takeover: {row.text('takeover').lower()}"
    if row.text("group") and row.text("whole").lower() == "true":
        yield "whole: true"


def _place(place: ListedPlace) -> str:
    address = f"{place.address}.{place.part}" if place.part else str(place.address)
    settings = []
    if place.type not in _OWN_TYPES:
        settings.append(f"type: {place.type}")
    if place.order and (place.order not in _OF_WORDS or WORDS.get(place.type) != 1):
        settings.append(f"order: {place.order}")
    if place.scale is not None and (place.scale != 1 or place.type not in ("float32", "float64", "bool")):
        settings.append(f"scale: {_number(place.scale)}")
    if place.offset:
        settings.append(f"offset: {_number(place.offset)}")
    if place.area == "holding" and not settings:
        return address
    return "{" + ", ".join([f"{place.area}: {address}", *settings]) + "}"


def _joined(parts: Iterable[str]) -> str:
    return ", ".join(parts)


def _number(value: float) -> str:
    """A decimal number as the language takes it: no exponent."""
    return f"{Decimal(repr(value)):f}".removesuffix(".0")


def _value(text: str) -> str:
    """A fallback: a word of the language or a number as it is, everything else quoted."""
    return text if re.fullmatch(r"[a-z]+|-?\d+(\.\d+)?", text) else json.dumps(text)


def _text(text: str) -> str:
    """A text as YAML takes it for one."""
    if _PLAIN.fullmatch(text) and text.lower() not in _WORDS_OF_YAML:
        return text
    return json.dumps(text, ensure_ascii=False)
