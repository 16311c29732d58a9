"""The keys of a scenario file: one row for each, with what reads its value."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from gatewayd.simulator.faults import ADAPTERS, DropAt, LongLists
from gatewayd.simulator.kinematics import MODELS
from gatewayd.simulator.settings import read_field, read_inputs, read_seconds


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


def _text(value: Any) -> str:
    _require(isinstance(value, str), "is no text; put it in quotes")
    return str(value)


def _truth(value: Any) -> bool:
    _require(isinstance(value, bool), "is neither true nor false")
    return bool(value)


def _number(value: Any) -> float:
    _require(isinstance(value, int | float) and not isinstance(value, bool), "is no number")
    return float(value)


def _within(low: float, high: float) -> Callable[[Any], float]:
    def read(value: Any) -> float:
        number = _number(value)
        _require(low <= number <= high, f"is not within {low:g}..{high:g}")
        return number

    return read


def _whole(low: int, high: int) -> Callable[[Any], int]:
    def read(value: Any) -> int:
        _require(isinstance(value, int) and not isinstance(value, bool), "is no whole number")
        return int(_within(low, high)(value))

    return read


def _seconds(value: Any) -> float:
    return read_seconds(_number(value))


def _positive(value: Any) -> float:
    return _within(0.001, 1e9)(value)


def _choice(words: Iterable[str]) -> Callable[[Any], str]:
    def read(value: Any) -> str:
        _require(_text(value) in words, f"is not one of {', '.join(words)}")
        return str(value)

    return read


def _texts(value: Any) -> tuple[str, ...]:
    _require(isinstance(value, list), 'is no list; write ["one", "two"]')
    return tuple(map(_text, value))


def _table(value: Any) -> dict[str, Any]:
    _require(isinstance(value, dict), "is no table; write [robots.NAME.faults]")
    return dict(value)


ROBOT_KEYS: Mapping[str, Callable[[Any], Any]] = {
    "port": _whole(1, 65535),
    "series": _choice(("cb3", "e", "x")),
    "version": _text,
    "model": _choice(MODELS),
    "frequency": _within(1, 1000),
    "uptime": _seconds,
    "program": _text,
    "fields": lambda value: tuple(map(read_field, _texts(value))),
    "hold": lambda value: tuple(sorted(read_inputs(_texts(value)))),
    "start": _text,
    "timeline": _text,
    "begin": _choice(("start", "client")),
    "repeat": _positive,
    "faults": _table,
}
"""What a robot's table may have, and how each value is read: ValueError says what is wrong with it."""

FAULT_KEYS: Mapping[str, Callable[[Any], Any]] = {
    "protocol_v1": _truth,
    "text_on_connect": _text,
    "boot_restart": _seconds,
    "adapter": _choice(ADAPTERS),
    "unreadable": lambda value: read_inputs(_texts(value)),
    "strict_lists": lambda value: LongLists(_choice(tuple(way.value for way in LongLists))(value)),
    "drop_at": lambda value: DropAt.parse(_text(value)),
    "drop_times": _whole(1, 1_000_000),
    "delay": _seconds,
    "linger": _seconds,
    "overflow_close": lambda value: None if value == "never" else _seconds(value),
    "drop": _within(0, 1),
    "duplicate": _within(0, 1),
    "split": _within(0, 1),
    "seed": _whole(-(1 << 62), 1 << 62),
    "freeze": _truth,
    "creep": _truth,
    "silence": _truth,
}
"""The same of its table `faults`."""

FAULT_ATTRIBUTES = {"protocol_v1": "v1_only", "strict_lists": "long_lists"}
"""Keys whose attribute of `Faults` has another name."""
