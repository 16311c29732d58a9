"""`gatewayd status`: how a running gateway is, at a glance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import click

from gatewayd.cli.printing import echo
from gatewayd.cli.remote import cell_option, echo_json, json_option, on_gateway, readable

if TYPE_CHECKING:
    from gatewayd.control.client import Client

DEGRADED = 1
"""Exit code when something is wrong."""
_EVENTS = 5
_LAG = 0.1
"""Seconds of lag that are worth a word."""

Answer = Mapping[str, Any]


@click.command(
    name="status",
    epilog="""\b
Examples:
  gatewayd status
  gatewayd status --json | jq .cells[].robot.state
  gatewayd status >/dev/null || echo "the cell needs a look"

\b
Exit codes:
  0  healthy: all is available, fresh, writable, as given and in range; nothing forced or held, no writer lost
  1  degraded: what is wrong is printed
  2  wrong usage, or no gateway could be reached
""",
)
@on_gateway
@cell_option
@json_option
@click.pass_context
def command(context: click.Context, client: Client, cell: str | None, *, as_json: bool) -> None:
    """Print the state of the running gateway: links, rates, ages, owners, refusals, the last events."""
    answer = client.get("/v1/status")
    limit = _EVENTS * (max(1, len(answer["cells"])) if cell is None else 1)
    events = client.get("/v1/events", limit=limit, cell=cell)["events"]
    locks = client.get("/v1/locks", cell=cell)["locks"]
    if cell is not None:
        answer = _narrowed(answer, cell)
    if as_json:
        echo_json(answer)
    else:
        for line in _lines(*readable([answer, locks, events])):
            echo(line)
    context.exit(0 if answer["healthy"] else DEGRADED)


def _narrowed(answer: Answer, cell: str) -> dict[str, Any]:
    """The answer for one cell alone."""
    (wanted,) = [found for found in answer["cells"] if found["name"] == cell]
    of_others = tuple(f"{other['name']}: " for other in answer["cells"] if other is not wanted)
    problems = (
        [text for text in answer["problems"] if not text.startswith(of_others)]
        if of_others
        else answer["problems"]
    )
    return {**answer, "cells": [wanted], "problems": problems, "healthy": not problems}


def _lines(answer: Answer, locks: list[Answer], events: list[Answer]) -> Iterator[str]:
    from gatewayd.report.format import span

    healthy = answer["healthy"]
    state = click.style("healthy" if healthy else "degraded", fg="green" if healthy else "red", bold=True)
    yield f"gatewayd {answer['version']} is {state}, up {span(answer['uptime'])} (pid {answer['pid']})"
    for problem in answer["problems"]:
        yield click.style(f"  ! {problem}", fg="red")
    for cell in answer["cells"]:
        yield ""
        yield from _cell(cell, [lock for lock in locks if lock["cell"] == cell["name"]])
    if events:
        yield ""
        yield click.style("last events", bold=True)
        several = len(answer["cells"]) > 1
        for event in events:
            where = f"{event['cell']}: " if several else ""
            text = click.style(f"{where}{event['text']}", fg="yellow" if event["bad"] else None)
            yield f"  {event['time']} {text}"


def _cell(cell: Answer, locks: list[Answer]) -> Iterator[str]:
    from gatewayd.report.format import counted

    yield (
        click.style(cell["name"], bold=True)
        + f"  {cell['source']}, mapping {cell['fingerprint']}"
        + (f", the gateway stood still {counted(cell['gaps'], 'time')}" if cell["gaps"] else "")
    )
    yield from _part("robot", _robot(cell["robot"], cell["problems"]))
    for link in cell["links"]:
        if link["name"] != "robot":
            yield from _part(link["name"], [_link(link)])
    yield from _part("writers", [_writer(writer, cell["locks"]["total"]) for writer in cell["writers"]])
    yield from _part("variables", [_variables(cell["variables"])])
    yield from _part("locks", _locks(locks))
    yield from _part("writes", _writes(cell))


def _part(title: str, lines: list[str]) -> Iterator[str]:
    for line in lines:
        yield f"  {title:<10} {line}"
        title = ""


def _link(link: Answer) -> str:
    words = click.style(link["words"], fg=_colour(link["level"]))
    return f"{link['address']} {words}" + (f", {link['detail']}" if link["detail"] else "")


def _colour(level: str) -> str | None:
    from gatewayd.links.contract import Level
    from gatewayd.report.words import LEVEL_COLOURS

    return None if level == "idle" else LEVEL_COLOURS[Level[level.upper()]]


def _robot(robot: Answer, problems: list[str]) -> list[str]:
    from gatewayd.report.format import ago
    from gatewayd.report.words import LEVEL_COLOURS, SOURCE_LEVELS, SOURCES, source

    state = source(robot["state"])
    first = f"{robot['address']} {click.style(SOURCES[state], fg=LEVEL_COLOURS[SOURCE_LEVELS[state]])}"
    if robot["state"] == "fresh":
        # No rate was measured yet just after the start: 0 Hz would be a lie.
        first += f" at {robot['frequency']:g} Hz" if robot["frequency"] else ""
        if not robot["writable"]:
            first += click.style(", not writable yet", fg="yellow")
    first += f", last package {ago(robot['age'])}" if robot["age"] is not None else ""
    return [first, ", ".join(_counts(robot)), *_controller(robot, problems)]


def _counts(robot: Answer) -> Iterator[str]:
    from gatewayd.report.format import age, counted

    yield from (counted(robot["packages"], "package"), f"{robot['skipped']} skipped", f"{robot['late']} late")
    if robot.get("pauses"):
        yield counted(robot["pauses"], "pause")
    if robot.get("overtaken"):
        yield f"{robot['overtaken']} overtaken"
    yield counted(robot["sessions"], "session")
    strange = {kind: count for kind, count in (robot.get("strange") or {}).items() if count}
    if strange:
        text = f"{counted(sum(strange.values()), 'strange package')} ({', '.join(strange)})"
        yield click.style(text, fg="yellow")
    if robot["mismatches"]:
        yield click.style(f"{robot['mismatches']} read back differently", fg="red")
    for count, words in ((robot["unadopted"], "not known"), (robot["differing"], "different in the robot")):
        if count:
            yield click.style(f"{counted(count, 'input')} {words}", fg="red")
    if robot["lag"] >= _LAG:
        yield click.style(f"{age(robot['lag'])} behind", fg="yellow")
    if robot["adoption"]:
        left = age(robot["adoption"])
        yield click.style(f"adopted values without an owner fall back in {left}", fg="yellow")
    if robot["watchdog"] is not None:
        yield "watchdog fed" if robot["watchdog"] else click.style("watchdog not fed", fg="red")


def _controller(robot: Answer, problems: list[str]) -> Iterator[str]:
    """What is known of the controller itself; a gateway that was started before an upgrade does not say it."""
    from gatewayd.report.format import ago

    if robot.get("controller") is not None:
        series = f" (series {robot['series']})" if robot["series"] is not None else ""
        yield f"software {robot['controller']}{series}, RTDE protocol {robot['protocol']}"
    if robot.get("contradiction") is not None and robot["contradiction"] not in problems:
        yield click.style(robot["contradiction"], fg="yellow")
    text = robot.get("last_text")
    if text is not None:
        yield f"last text {ago(text['age'])}, {text['level']}: {text['text']}"


def _writer(writer: Answer, locks: int) -> str:
    from gatewayd.report.format import ago, counted, verb

    if writer["alive"]:
        state, colour = f"connected, last request {ago(writer['age'])}", "green"
    elif writer["age"] is None:
        return f"{writer['name']} {verb('have', writer['name'])} not connected yet"
    else:
        state, colour = f"lost, last request {ago(writer['age'])}", "red"
    owned = f"{verb('own', writer['name'])} {writer['locks']} of {counted(locks, 'lock')}"
    return f"{writer['name']} {click.style(state, fg=colour)}, {owned if locks else 'there are no locks'}"


def _variables(counts: Answer) -> str:
    if not counts["total"]:
        return "none"
    if counts["good"] == counts["total"]:
        return f"{counts['total']}, all good"
    from gatewayd.cli.phrases import quality

    others = [
        f"{count} {quality(name)}"
        for name, count in counts.items()
        if count and name not in ("total", "good")
    ]
    return f"{counts['total']}: {counts['good']} good, " + click.style(", ".join(others), fg="yellow")


def _locks(locks: list[Answer]) -> list[str]:
    from gatewayd.report.format import age, counted

    held = [
        f"{lock['name']}: {lock['owner']}"
        + (f", {age(lock['remaining'])} left" if lock["remaining"] is not None else "")
        for lock in locks
        if lock["owner"] is not None
    ]
    shown = held[:_EVENTS] + ([f"and {len(held) - _EVENTS} more"] if len(held) > _EVENTS else [])
    return shown or [counted(len(locks), "lock") + (", none owned" if locks else "")]


def _writes(cell: Answer) -> list[str]:
    from gatewayd.report.format import ago, counted

    writes, last = cell["writes"], cell["last_refusal"]
    lines = [f"{writes['accepted']} accepted, {writes['refused']} refused"]
    if last is not None:
        lines.append(f"last refusal {ago(last['age'])}: {last['text']}")
    count, asked = sum(cell["unserved"].values()), cell["last_unserved"]
    if asked is not None:
        when = f"{'the last ' if count > 1 else ''}{ago(asked['age'])}"
        lines.append(f"{counted(count, 'request')} not served, {when}: {asked['text']}")
    return lines
