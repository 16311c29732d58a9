"""What a gateway answers about variables and events, in words for a terminal. Pure: JSON objects in, texts out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gatewayd.links.registry import kinds
from gatewayd.report.format import age
from gatewayd.report.format import value as with_unit
from gatewayd.report.words import meaning


def value(variable: Mapping[str, Any]) -> str:
    """`12.5 N`, `7 running`: the value with its unit, and what it means where it stands for a state."""
    return f"{with_unit(variable['value'], variable['unit'])} {meaning(variable['value'], variable)}".rstrip()


def owner(variable: Mapping[str, Any]) -> str:
    """`plc, 4.2 s left`; `robot` for outputs."""
    if variable["forced"] is not None:
        return f"forced, {age(variable['forced']['remaining'])} left{_reported(variable)}"
    if variable["direction"] == "output":
        return "robot"
    name = variable["owner"] or "free"
    return name if variable["lease"] is None else f"{name}, {age(variable['lease'])} left"


def _reported(variable: Mapping[str, Any]) -> str:
    """The truth beside a force: `; reports 0.2 m` of an output, `; robot holds 3 N, stale` of an input."""
    forced = variable["forced"]
    if forced.get("reported_quality") is None:
        return ""
    shown = value({**variable, "value": forced["reported"]})
    good = forced["reported_quality"] == "good"
    verb = "robot holds" if variable["direction"] == "input" else "reports"
    return f"; {verb} {shown}" + ("" if good else f", {quality(forced['reported_quality'])}")


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
    """`02:15:07.042Z` of a time stamp: as the log has it, without the date."""
    return time.partition("T")[2]
