"""What a gateway answers about variables and events, in words for a terminal. Pure: JSON objects in, texts out."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from gatewayd.links.registry import kinds
from gatewayd.report.format import age


def owner(variable: Mapping[str, Any]) -> str:
    """`plc, 4.2 s left`; `robot` for outputs."""
    if variable["forced"] is not None:
        return f"forced, {age(variable['forced']['remaining'])} left"
    if variable["direction"] == "output":
        return "robot"
    name = variable["owner"] or "free"
    return name if variable["lease"] is None else f"{name}, {age(variable['lease'])} left"


def quality(name: str) -> str:
    """`out of range` for `out_of_range`."""
    return name.replace("_", " ")


def places(variable: Mapping[str, Any]) -> str:
    """`400011`, `2010h:01`, or several: its places on all links, by notation or else by what comes first."""
    found: list[Mapping[str, Any]] = []
    for kind in kinds():
        here = variable.get(kind.key) if kind.place else None
        found += here if isinstance(here, list) else [here] if here else []
    return " ".join(str(place.get("notation") or next(iter(place.values()))) for place in found)


def clock(time: str) -> str:
    """The local time of a UTC time stamp."""
    return datetime.fromisoformat(time).astimezone().strftime("%H:%M:%S")
