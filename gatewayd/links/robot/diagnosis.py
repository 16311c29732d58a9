"""What a look at a controller means for a mapping: what was met -> observations. Pure; the way there is in `doctor`."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Final, NamedTuple

from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.links.examination import Observation, Outcome
from gatewayd.links.robot.availability import unavailable
from gatewayd.links.robot.controller import contradiction
from gatewayd.links.robot.plan import RobotPlan
from gatewayd.report.format import counted, listed
from gatewayd.rtde.catalogue import likely_holders, suggest
from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.loss import Loss, LossReason, connect_failure
from gatewayd.rtde.messages import IN_USE, NOT_FOUND, TextLevel, TextMessage
from gatewayd.rtde.session import Session
from gatewayd.rtde.types import DataType
from gatewayd.rtde.visit import Visit

PORT = "port"
SERVICE = "RTDE service"
_LISTED = 6
_TEXTS = 3
_SLOW = 0.9
"""Share of the agreed rate below which packages are missing."""


class _Why(NamedTuple):
    cause: str
    remedy: str


_REFUSED_BY: Final = {
    LossReason.REFUSED: _Why(
        "nothing listens there: the robot is booting, its RTDE service is off, or it is another machine",
        "enable RTDE on the pendant (Settings > Security > Services); after power-up wait a minute",
    ),
    LossReason.UNREACHABLE: _Why(
        "the robot is off or has another address, or a switch or firewall is between",
        "compare with the pendant (Settings > System > Network); check power and cables; `ping` it",
    ),
    LossReason.CLOSED: _Why(
        "something between, or the controller, ends connections at once",
        "look for a firewall or proxy between, and whether the port is RTDE's: 30004",
    ),
}
"""Why a port does not accept connections."""

_NO_SESSION: Final = {
    LossReason.UNANSWERED: _Why(
        "it accepts connections but is silent: the controller hangs or starts, or the port is another service's",
        "check `robot: host:` and `port:`; if they are right, restart the controller",
    ),
    LossReason.PROTOCOL: _Why(
        "what listens there is no RTDE service", "check `robot: host:` and `port:`, usually 30004"
    ),
    LossReason.CLOSED: _Why(
        "too many RTDE clients are connected, or the controller restarts its RTDE service",
        "end clients that nobody needs (recorders, dashboards, a second driver), then try again",
    ),
    LossReason.RESTARTED: _Why(
        "the controller restarts its RTDE service some 40 s after power-up", "wait a minute and try again"
    ),
}
"""Why there was no session."""
_UNKNOWN: Final = _Why("not known", "try again; if it stays, `gatewayd trace robot` shows what is said")


def port_refused(error: OSError, address: str) -> Observation:
    """The port did not accept a connection."""
    loss = connect_failure(error, address)
    cause, remedy = _REFUSED_BY.get(loss.reason, _UNKNOWN)
    text = f"{address}: {os.strerror(error.errno).lower() if error.errno else error}"
    return Observation(PORT, Outcome.PROBLEM, text, cause, remedy)


def session_missing(loss: Loss | None) -> Observation:
    """There was no session."""
    reason, text = (loss.reason, loss.text) if loss is not None else (LossReason.FAILED, "no session")
    cause, remedy = _NO_SESSION.get(reason, _UNKNOWN)
    return Observation(SERVICE, Outcome.PROBLEM, text, cause, remedy)


def spoken(session: Session, plan: RobotPlan) -> Iterator[Observation]:
    """Protocol and software, against what the mapping says."""
    if session.protocol > 1:
        yield Observation.well(SERVICE, f"answers, protocol version {session.protocol}")
    else:
        chosen = plan.frequency not in (0.0, 125.0)
        yield Observation(
            SERVICE,
            Outcome.WARNING if chosen else Outcome.NOTE,
            "answers, protocol version 1 only",
            "the controller's software is old: the rate cannot be chosen",
            "update the controller, or remove `robot: frequency:`",
        )
    yield _software(session, plan)


def _software(session: Session, plan: RobotPlan) -> Observation:
    version, series = session.controller.software, session.series
    text = f"{session.controller}, series {series.word if series is not None else 'unknown'}"
    declared = f"`series: {series.word}` and `version: {version.major}.{version.minor}`" if series else ""
    found = contradiction(plan, version)
    if found is not None and found.is_grave:
        cause = "the robot was exchanged or its software is older than the mapping was made for"
        return Observation(
            "version", Outcome.WARNING, found.text, cause, f"write {declared}, then `gatewayd check`"
        )
    if found is not None:
        return Observation("version", Outcome.NOTE, found.text)
    if plan.series is None and plan.version is None and series is not None:
        text = f"{text}; with {declared} in the mapping, `gatewayd check` knows its fields"
        return Observation("version", Outcome.NOTE, text)
    return Observation.well("version", text)


def outputs(
    session: Session, plan: RobotPlan, cell: CellDefinition, read: Collection[str]
) -> Iterator[Observation]:
    """Every output of the mapping, and the inputs in `read`, which are read back: what of them is missing or other."""
    refused = {item.field: item.word for item in session.unavailable if item.output}
    wanted = (*plan.outputs, *read)
    missing = [name for name in wanted if refused.get(name) == NOT_FOUND]
    for name in missing:
        yield Observation(
            "field", Outcome.PROBLEM, f"{name}: the controller does not have it", *_absence(name, session)
        )
    for name in wanted:
        if name in refused and name not in missing:
            cause = (
                "the controller did not take so long a list" if refused[name] == "TOO_LONG" else "not known"
            )
            yield Observation(
                "field", Outcome.PROBLEM, f"{name}: {refused[name]}", cause, "map fewer outputs"
            )
    others = [variable for variable in cell.variables if variable.direction is Direction.OUTPUT]
    for index, reason in unavailable(session, others, dict(plan.types)).items():
        if others[index].field not in refused:
            text = f"{others[index].name} ({others[index].field}): {reason}"
            remedy = "write the controller's type in the mapping (`type:` of the field)"
            yield Observation(
                "field", Outcome.PROBLEM, text, "another type than the mapping was made for", remedy
            )
    there = sum(name not in refused for name in wanted)
    if there:
        yield Observation.well(
            "fields", f"{there} of {counted(len(wanted), 'field')} of the mapping can be read"
        )


def _absence(name: str, session: Session) -> tuple[str, str]:
    """Why the controller does not have a field, and what to do."""
    known = OUTPUTS.get(name) or INPUTS.get(name)
    if known is None:
        close = suggest(name)
        return (
            "no guide has the name",
            f"did you mean {close[0]}?" if close else "correct the name in the mapping",
        )
    series = session.series
    if series is None or not known.exists(series):
        return (
            f"controllers of series {series.word if series else '?'} do not have it",
            "remove it from the mapping",
        )
    first = known.first_version(series)
    since = (
        f"the guides have it from {first} on" if first is not None else "its software is too old, or special"
    )
    return since, "update the controller, or remove the field from the mapping"


def claims(words: Mapping[str, str], session: Session) -> Iterator[Observation]:
    """What claiming showed: the controller's word for each input, its type where it could be claimed."""
    missing = [name for name, word in words.items() if word == NOT_FOUND]
    for name in missing:
        why = _absence(name, session)
        yield Observation("claims", Outcome.PROBLEM, f"{name}: the controller does not have it", *why)
    in_use = [name for name, word in words.items() if word == IN_USE]
    yield from held({name: likely_holders(name, session.controller.software) for name in in_use})
    free = sum(word in DataType.__members__ for word in words.values())
    if free:
        yield Observation.well("claims", f"{counted(free, 'input')} can be claimed")


def held(holders: dict[str, str]) -> Iterator[Observation]:
    """Inputs that other clients hold -> who that probably is."""
    fields: dict[str, list[str]] = {}
    for name, who in holders.items():
        fields.setdefault(who, []).append(name)
    for who, names in fields.items():
        yield Observation(
            "claims",
            Outcome.PROBLEM,
            f"in use by another client: {listed(names, _LISTED)}",
            f"probably {who}",
            "disable that client (pendant: Installation > Fieldbus), or map registers that it does not use; the "
            "gateway takes them as soon as they are free",
        )


def rate(visited: Visit, session: Session) -> Observation:
    """Whether data comes as agreed."""
    agreed = 1 / session.period
    measured = visited.rate
    if measured is None:
        text = (
            visited.loss.text if visited.loss is not None else f"{counted(visited.packages, 'package')} came"
        )
        cause = (
            "the robot is not powered, its safety set-up is not confirmed, or its program stops the output"
        )
        return Observation(
            "data", Outcome.PROBLEM, text, cause, "switch the robot on and confirm its safety set-up"
        )
    if visited.advance <= 0:
        text = f"packages come, but the controller's clock stands still ({measured:.0f} Hz)"
        return Observation(
            "data", Outcome.PROBLEM, text, "its control process hangs", "restart the controller"
        )
    text = f"{measured:.0f} Hz, {agreed:g} Hz agreed"
    if (visited.packages - 1) / visited.advance < _SLOW * agreed:
        cause = "the controller is too busy to send every package"
        remedy = "ask for less: a lower `robot: frequency:`, fewer outputs, fewer RTDE clients"
        return Observation("data", Outcome.WARNING, f"{text}: packages are left out", cause, remedy)
    if measured < _SLOW * agreed:
        return Observation(
            "data", Outcome.NOTE, f"{text}: the controller's clock goes slow, as a simulator's may"
        )
    return Observation.well("data", text)


def text_messages(texts: Sequence[TextMessage]) -> Iterator[Observation]:
    """The controller's last texts, each once."""
    for text in list(dict.fromkeys(texts))[-_TEXTS:]:
        level = {each.value: each.name.lower() for each in TextLevel}.get(text.level, f"level {text.level}")
        yield Observation("text", Outcome.NOTE, f"the controller says ({level}): {text.message}")
