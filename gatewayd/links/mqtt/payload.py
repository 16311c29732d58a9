"""Values as JSON, and commands from it (RFC 8259: no NaN, no infinity). Pure.

A value: `{"value": 12.5, "quality": "good", "time": "2026-11-29T09:00:00.123Z"}`. `time` is when its source had it, by
the wall clock; null: it never had one. A value that JSON cannot say is null, and `special` says which it is.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final, NoReturn

from gatewayd.links.mqtt.publisher import ValueSample

MAX_ID: Final = 100
"""Characters of the name that a sender gives a command."""
_KEYS: Final = frozenset({"id", "write", "request", "release"})
_MAX_NAMES: Final = 1024
_END_OF_TIME: Final = 253_402_300_799.0
"""The last second of the year 9999: a clock that shows a later one is broken."""


class CommandError(ValueError):
    """A payload is no command; the text says why."""


@dataclass(frozen=True, slots=True)
class CellCommand:
    """What somebody sent. Without anything in it, it is a sign of life."""

    id: str | int | None = None
    write: Mapping[str, object] | None = None
    request: Sequence[str] = ()
    release: Sequence[str] = ()
    release_all: bool = False


def utc(wall: float) -> str:
    """`2026-11-22T09:00:00.123Z`."""
    inside = min(max(wall, 0.0), _END_OF_TIME)
    return datetime.fromtimestamp(inside, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def value_fields(sample: ValueSample, ahead: float, unit: str = "") -> dict[str, object]:
    """The object that says one value; `ahead`: seconds by which the wall clock is before the monotonic one."""
    value = sample.value
    special = isinstance(value, float) and not math.isfinite(value)
    found: dict[str, object] = {
        "value": None if special else value,
        "quality": sample.quality.name.lower(),
        "time": utc(sample.time + ahead) if math.isfinite(sample.time) else None,
    }
    if special:
        found["special"] = str(value)
    if unit:
        found["unit"] = unit
    return found


def encode(found: Mapping[str, object]) -> bytes:
    """As UTF-8, without blanks."""
    return json.dumps(found, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()


def decode_command(payload: bytes) -> CellCommand:
    """What a payload says. Raises CommandError, whatever its bytes are."""
    found = _object(payload)
    unknown = sorted(found.keys() - _KEYS)
    if unknown:
        raise CommandError(f"unknown key {unknown[0][:40]!r}; known are {', '.join(sorted(_KEYS))}")
    name = found.get("id")
    if not isinstance(name, str | int | None) or isinstance(name, bool) or len(str(name)) > MAX_ID:
        raise CommandError(f"`id` is no text or number of at most {MAX_ID} characters")
    if isinstance(name, str) and not name.isascii() and any(0xD800 <= ord(each) <= 0xDFFF for each in name):
        # JSON's escapes can say half a character, which no answer could repeat.
        raise CommandError("`id` has half a surrogate pair")
    if len(found.keys() - {"id"}) > 1:
        raise CommandError("one command has one of write, request and release")
    return CellCommand(
        name,
        _written(found),
        _names(found, "request"),
        () if found.get("release") == "all" else _names(found, "release"),
        found.get("release") == "all",
    )


def _written(found: Mapping[str, object]) -> Mapping[str, object] | None:
    write = found.get("write")
    if "write" not in found:
        return None
    if not isinstance(write, dict) or not 0 < len(write) <= _MAX_NAMES:
        raise CommandError('`write` is no object such as {"speed": 0.5}')
    return write


def _object(payload: bytes) -> dict[str, object]:
    try:
        found = json.loads(
            payload.decode("utf-8"),
            object_pairs_hook=_once,
            parse_constant=_no_constant,
            parse_float=_finite,
        )
    except CommandError:
        raise
    except (ValueError, RecursionError) as error:
        raise CommandError("not JSON") from error
    if not isinstance(found, dict):
        raise CommandError('not an object such as {"write": {"speed": 0.5}}')
    return found


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise CommandError("a key stands there twice")
    return found


def _finite(text: str) -> float:
    """A real; one that has no room for it would be infinite, which nobody has said."""
    found = float(text)
    if not math.isfinite(found):
        raise CommandError(f"{text[:40]} has no room in a real")
    return found


def _no_constant(text: str) -> NoReturn:
    raise CommandError(f"{text} is no JSON")


def _names(found: Mapping[str, object], key: str) -> Sequence[str]:
    if key not in found:
        return ()
    names = found[key]
    listed = [names] if isinstance(names, str) else names
    if not isinstance(listed, list) or not 0 < len(listed) <= _MAX_NAMES:
        raise CommandError(f"`{key}` is no name and no list of names")
    texts = [name for name in listed if isinstance(name, str)]
    if len(texts) < len(listed):
        raise CommandError(f"`{key}` has something that is no name")
    return texts
