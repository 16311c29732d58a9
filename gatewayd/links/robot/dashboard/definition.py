"""The variables of a cell that the dashboard server brings: type, range and direction."""

from __future__ import annotations

from gatewayd.core.definition import Direction, ValueKind
from gatewayd.links.robot.dashboard.sections import DashboardSection
from gatewayd.links.robot.dashboard.variables import (
    MOVING,
    STATES,
    VERBS,
    VIA,
    field_of,
    meanings_of,
)
from gatewayd.mapping.expanded import Defined
from gatewayd.rtde.ranges import usual_range
from gatewayd.rtde.types import INTEGER_RANGES, DataType

_INT32 = INTEGER_RANGES[DataType.INT32.code]


def defined(name: str, section: DashboardSection | None) -> Defined:
    """The one value that `dashboard: NAME` of a line is."""
    programs = max(map(int, section.programs), default=0) if section is not None else 0
    if name in VERBS:
        direction, kind = Direction.INPUT, ValueKind.INT if name == "load" else ValueKind.BOOL
        known: tuple[int, int] | None = (0, programs) if name == "load" else None
    else:
        direction, kind = Direction.OUTPUT, STATES[name]
        numbers = meanings_of(name)
        known = (0, programs) if name == "loaded" else (0, max(numbers)) if name == "result" else None
    low, high = (known or _INT32) if kind is ValueKind.INT else (None, None)
    return Defined(
        target=field_of(name),
        direction=direction,
        field=field_of(name),
        type=(DataType.INT32 if kind is ValueKind.INT else DataType.BOOL).word,
        kind=kind,
        low=low,
        high=high,
        bit=None,
        element=None,
        usual=usual_range({"program_state": "runtime_state"}.get(name, name)) if known is None else None,
        moves=name in MOVING,
        via=VIA,
    )
