"""What is known of a cell's controller, for people: its software, what it said last, what it does not give and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from gatewayd.core.definition import Variable
from gatewayd.links.robot.plan import RobotPlan
from gatewayd.report.format import listed
from gatewayd.rtde.catalogue import likely_holders
from gatewayd.rtde.fields import Series, SoftwareVersion
from gatewayd.rtde.messages import IN_USE, TextLevel, TextMessage
from gatewayd.rtde.session import Session

_LISTED = 3
_LEVELS = {level.value: level.name.lower() for level in TextLevel}


class ControllerNotes:
    """Kept over sessions: what was last known stands until a controller says otherwise."""

    def __init__(self) -> None:
        self._figures: dict[str, object] = {"controller": None, "series": None, "protocol": None}
        self._version: SoftwareVersion | None = None
        self._text: tuple[TextMessage, float] | None = None
        self._unavailable: list[dict[str, object]] = []
        self._held: tuple[str, ...] = ()

    def agreed(self, session: Session) -> None:
        """A session has begun."""
        self._version = session.controller.software
        self._figures = {
            "controller": str(session.controller),
            "series": session.series.word if session.series is not None else None,
            "protocol": session.protocol,
        }

    def text(self, message: TextMessage, now: float) -> None:
        """The controller has sent a text."""
        self._text = message, now

    def refused(
        self, session: Session | None, reasons: Mapping[int, str], variables: Sequence[Variable]
    ) -> None:
        """These variables are unavailable, for these reasons; the watchdog's register is one of no variable."""
        fields: dict[tuple[str, str], list[str]] = {}
        for index, reason in reasons.items():
            fields.setdefault((variables[index].field, reason), []).append(variables[index].name)
        self._unavailable = [
            {"field": field, "reason": reason, "variables": names}
            for (field, reason), names in fields.items()
        ]
        missing = session.unavailable if session is not None else ()
        self._held = tuple(wish.field for wish in missing if wish.word == IN_USE and not wish.output)

    def figures(self, plan: RobotPlan, now: float) -> dict[str, object]:
        """For the control interface."""
        found = contradiction(plan, self._version)
        return {
            **self._figures,
            "contradiction": found.text if found is not None else None,
            "last_text": self._last_text(now),
            "unavailable": self._unavailable,
            "held_elsewhere": [{"field": field, "probably": self._holders(field)} for field in self._held],
        }

    def problems(self, plan: RobotPlan) -> tuple[str, ...]:
        """What of it keeps a cell that is connected from being well, in words."""
        holders: dict[str, list[str]] = {}
        for field in self._held:
            holders.setdefault(self._holders(field), []).append(field)
        held = (
            f"another client holds {listed(fields, _LISTED)}: probably {who}"
            for who, fields in holders.items()
        )
        # What others hold is reported above, together.
        reasons = (
            f"{missing['field']}: {missing['reason']}"
            for missing in self._unavailable
            if not str(missing["reason"]).startswith(IN_USE)
        )
        found = contradiction(plan, self._version)
        return (*held, *reasons, *((found.text,) if found is not None and found.is_grave else ()))

    def _holders(self, field: str) -> str:
        return likely_holders(field, self._version)

    def _last_text(self, now: float) -> dict[str, object] | None:
        if self._text is None:
            return None
        message, at = self._text
        level = _LEVELS.get(message.level, str(message.level))
        return {"text": message.message, "source": message.source, "level": level, "age": round(now - at, 3)}


class Contradiction(NamedTuple):
    """What the mapping says of the controller, and what the controller says."""

    text: str
    is_grave: bool
    """Whether something that was checked need not hold; a newer controller has everything that an older one has."""


def contradiction(plan: RobotPlan, version: SoftwareVersion | None) -> Contradiction | None:
    """How the software of the controller differs from what the mapping says of it; None if it does not."""
    if version is None or (plan.series is None and plan.version is None):
        return None
    declared = SoftwareVersion.parse(plan.version) if plan.version is not None else None
    series = Series.from_word(plan.series) if plan.series is not None else None
    runs = f"the controller runs {version}"
    if series is not None and series.major != version.major:
        return Contradiction(f"the mapping says series {series.word}, {runs}", is_grave=True)
    if declared is None or (declared[:2] == version[:2] and declared <= version):
        return None
    text = f"the mapping says software {declared}, {runs}"
    if declared.major == version.major and declared < version:
        return Contradiction(f"{text}, which is newer", is_grave=False)
    return Contradiction(f"{text}: fields that were checked may be missing", is_grave=True)
