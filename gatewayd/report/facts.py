"""What a plan says about each of its parts, as short texts for people: one fact for each key of the mapping file.

Two plans differ in a part where the texts of a fact differ, so every number that matters stands in some fact. Indices
never do: variables, locks and writers go by their names. What a link says, its kind describes.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from gatewayd.core.definition import Direction, Fallback, Lock, ValueKind, Variable
from gatewayd.links.contract import Description
from gatewayd.links.registry import kind_of, kinds
from gatewayd.mapping.plan import Plan
from gatewayd.report.format import exact, interval, seconds

Facts = Mapping[str, str]
"""Name of a fact -> what the plan says; what stands at "nothing" is missing."""

FOR_PEOPLE = frozenset({"comment", "unit"})
"""Facts about variables that change nothing of what the gateway does."""

_BIT_WORD = re.compile(r"(input|output)_bit_registers(\d+)_to_\d+")


def described(plan: Plan) -> dict[str, Description]:
    """What each link says of itself, by name, in the order of their kinds."""
    order = [kind.key for kind in kinds()]
    links = sorted(plan.links.items(), key=lambda named: order.index(named[1].kind))
    return {name: kind_of(link.kind).describe(link, plan.cell) for name, link in links}


def variables(plan: Plan) -> dict[str, Facts]:
    """Facts by name of the variable, in the order of the file."""
    links = described(plan)
    found: dict[str, Facts] = {}
    for index, variable in enumerate(plan.cell.variables):
        facts = {
            "direction": variable.direction.value,
            "robot": robot_name(variable),
            "type": _type(variable),
            **{
                name: ", ".join(place.text for place in link.places.get(index, ()))
                for name, link in links.items()
                if link.places
            },
            "limits": _limits(variable),
            **_policy(plan, variable),
            **_when_lost(variable),
            "valid": "running" if variable.valid_running else "",
            "deadband": exact(variable.deadband) if variable.deadband else "",
            "unit": variable.unit,
            "comment": variable.comment,
        }
        found[variable.name] = _present(facts)
    return found


def groups(plan: Plan) -> dict[str, Facts]:
    """Facts by name of the group; the lock of a single variable is among the facts of the variable."""
    return {
        lock.name: _present(
            {"members": ", ".join(plan.cell.variables[index].name for index in lock.members)}
            | _ownership(plan, lock)
        )
        for lock in plan.cell.locks
        if _is_group(plan, lock)
    }


def writers(plan: Plan) -> dict[str, Facts]:
    """Facts by name of the writer."""
    links = described(plan)
    return {
        writer.name: _present(
            {name: link.writers.get(index, "") for name, link in links.items()}
            | {
                "heartbeat": seconds(writer.heartbeat),
                "timeout": seconds(writer.timeout),
                "timeout_counts": "writes" if writer.counts_writes else "",
                "grace": seconds(writer.grace or None),
            }
        )
        for index, writer in enumerate(plan.cell.writers)
    }


def links(plan: Plan) -> dict[str, Facts]:
    """Facts by name of the link."""
    return {name: _present(link.settings) for name, link in described(plan).items()}


def robot_name(variable: Variable) -> str:
    """What the variable is in the robot, field, element or bit, as the mapping file names it."""
    if variable.via:
        return f"{variable.via}.{variable.field.removeprefix(f'{variable.via}.')}"
    word = _BIT_WORD.fullmatch(variable.field)
    if word is not None and variable.bit is not None:
        return f"{word[1]}_bit_register_{int(word[2]) + variable.bit}"
    element = "" if variable.element is None else f"[{variable.element}]"
    bit = "" if variable.bit is None else f".{variable.bit}"
    return f"{variable.field}{element}{bit}"


def _policy(plan: Plan, variable: Variable) -> dict[str, str]:
    if variable.lock is None:
        return {}
    lock = plan.cell.locks[variable.lock]
    return {"group": lock.name} if _is_group(plan, lock) else _ownership(plan, lock)


def _ownership(plan: Plan, lock: Lock) -> dict[str, str]:
    names = [plan.cell.writers[writer].name for writer in lock.owners]
    return {
        "owner": (" > " if lock.takeover else ", ").join(names),
        "lease": seconds(lock.lease),
        "takeover": "whole" if lock.whole else "",
    }


def _is_group(plan: Plan, lock: Lock) -> bool:
    return [plan.cell.variables[index].name for index in lock.members] != [lock.name]


def _type(variable: Variable) -> str:
    if variable.low is None or variable.high is None:
        return {ValueKind.BOOL: "bool", ValueKind.INT: "int", ValueKind.FLOAT: "double"}[variable.kind]
    bits = int(variable.high).bit_length()
    return f"int{bits + 1}" if variable.low < 0 else f"uint{bits}"


def _limits(variable: Variable) -> str:
    limits = variable.limits
    return "" if limits is None else interval(limits.low, limits.high) + (" clamped" if limits.clamp else "")


def _when_lost(variable: Variable) -> dict[str, str]:
    if variable.direction is Direction.INPUT:
        return {"on_release": _fallback(variable.on_release)}
    return {"on_stale": _fallback(variable.on_stale)}


def _fallback(fallback: Fallback) -> str:
    if fallback.value is None:
        return fallback.kind.value
    return exact(fallback.value)


def _present(facts: Mapping[str, str]) -> Facts:
    return {name: text for name, text in facts.items() if text}
