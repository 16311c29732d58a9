"""What a plan says about each of its parts, as short texts for people: one fact for each key of the mapping file.

Two plans differ in a part where the texts of a fact differ, so every number that matters stands in some fact. Indices
never do: variables, locks and writers are told by name.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Any

from gatewayd.core.definition import Direction, Fallback, Lock, ValueKind, Variable
from gatewayd.links.canopen_node.plan import canopen_of
from gatewayd.links.modbus_server.plan import ModbusPlan, Placement, modbus_of
from gatewayd.links.robot.plan import robot_of
from gatewayd.mapping.plan import Plan
from gatewayd.modbus.areas import AREA_NAMES

__all__ = ["FOR_PEOPLE", "Facts", "groups", "links", "variables", "writers"]

Facts = Mapping[str, str]
"""Name of a fact -> what the plan says; what stands at "nothing" is missing."""

FOR_PEOPLE = frozenset({"comment", "unit"})
"""Facts about variables that change nothing of what the gateway does."""

_BIT_WORD = re.compile(r"(input|output)_bit_registers(0|32)_to_(?:31|63)")


def variables(plan: Plan) -> dict[str, Facts]:
    """Facts by name of the variable, in the order of the file."""
    places: dict[int, list[Placement]] = {}
    modbus = modbus_of(plan)
    for placement in modbus.placements if modbus is not None else ():
        places.setdefault(placement.variable, []).append(placement)
    objects = _objects(plan)
    found: dict[str, Facts] = {}
    for index, variable in enumerate(plan.cell.variables):
        placed = ", ".join(map(_place, places.get(index, ())))
        facts = {
            "direction": variable.direction.value,
            "robot": _target(variable),
            "type": _type(variable),
            "modbus": placed,
            "canopen": objects.get(index, ""),
            "limits": _limits(variable),
            **_policy(plan, variable),
            **_when_lost(variable),
            "valid": "running" if variable.valid_running else "",
            "deadband": _number(variable.deadband) if variable.deadband else "",
            "unit": variable.unit,
            "comment": variable.comment,
        }
        found[variable.name] = _told(facts)
    return found


def groups(plan: Plan) -> dict[str, Facts]:
    """Facts by name of the group; the lock of a single variable is told with the variable."""
    return {
        lock.name: _told(
            {"members": ", ".join(plan.cell.variables[index].name for index in lock.members)}
            | _ownership(plan, lock)
        )
        for lock in plan.cell.locks
        if _is_group(plan, lock)
    }


def writers(plan: Plan) -> dict[str, Facts]:
    """Facts by name of the writer."""
    found: dict[str, Facts] = {}
    modbus = modbus_of(plan)
    for index, writer in enumerate(plan.cell.writers):
        networks = modbus.writers if modbus is not None else ()
        peers = ", ".join(_network(network) for network, one in networks if one == index)
        timeout = "" if writer.timeout is None else _seconds(writer.timeout)
        heartbeat = "" if writer.heartbeat is None else _seconds(writer.heartbeat)
        grace = _seconds(writer.grace) if writer.grace else ""
        counts = "writes" if writer.counts_writes else ""
        found[writer.name] = _told(
            {
                "modbus": peers,
                "heartbeat": heartbeat,
                "timeout": timeout,
                "timeout_counts": counts,
                "grace": grace,
            }
        )
    return found


def links(plan: Plan) -> dict[str, Facts]:
    """Facts by link: `robot`, `modbus`, and `canopen` where the plan has one."""
    found: dict[str, Facts] = {"robot": _told(_robot(plan))}
    modbus = modbus_of(plan)
    if modbus is not None:
        found["modbus"] = _told(_modbus(modbus))
    canopen = canopen_of(plan)
    if canopen is not None:
        found["canopen"] = _told(
            {
                field.name: _text(plan, field.name, getattr(canopen, field.name))
                for field in dataclasses.fields(canopen)
                if field.name != "objects"
            }
        )
    return found


def _robot(plan: Plan) -> dict[str, str]:
    robot, watchdog = robot_of(plan), robot_of(plan).watchdog
    return {
        "host": robot.host,
        "port": str(robot.port),
        "frequency": f"{_number(robot.frequency)} Hz" if robot.frequency else "the controller's own",
        "stale_after": _seconds(plan.cell.stale_after),
        "on_connect": "fallback" if plan.cell.clear_on_connect else "adopt",
        "adopt_for": "none" if plan.cell.adopt_for is None else _seconds(plan.cell.adopt_for),
        "verify": str(robot.verify).lower(),
        "watchdog": ""
        if watchdog is None
        else f"{watchdog.field} at {_number(watchdog.frequency)} Hz"
        + "".join(f", requires {plan.cell.writers[writer].name}" for writer in watchdog.requires),
        "subscribed": " ".join(sorted(robot.outputs)),
        "claimed": " ".join(sorted(robot.inputs)),
    }


def _modbus(modbus: ModbusPlan) -> dict[str, str]:
    host = f"[{modbus.host}]" if ":" in modbus.host else modbus.host
    return {
        "listen": f"{host}:{modbus.port}",
        "unit": str(modbus.unit),
        "allow": ", ".join(map(_network, modbus.allow)) or "everybody",
        "connections": str(modbus.connections),
        "idle_timeout": "none" if modbus.idle_timeout is None else _seconds(modbus.idle_timeout),
        "gaps": "zero" if modbus.fill_gaps else "refuse",
    }


def _policy(plan: Plan, variable: Variable) -> dict[str, str]:
    if variable.lock is None:
        return {}
    lock = plan.cell.locks[variable.lock]
    return {"group": lock.name} if _is_group(plan, lock) else _ownership(plan, lock)


def _ownership(plan: Plan, lock: Lock) -> dict[str, str]:
    names = [plan.cell.writers[writer].name for writer in lock.owners]
    return {
        "owner": (" > " if lock.takeover else ", ").join(names),
        "lease": "" if lock.lease is None else _seconds(lock.lease),
        "takeover": "whole" if lock.whole else "",
    }


def _is_group(plan: Plan, lock: Lock) -> bool:
    return [plan.cell.variables[index].name for index in lock.members] != [lock.name]


def _target(variable: Variable) -> str:
    """The robot's field, element or bit as the mapping file spells it."""
    word = _BIT_WORD.fullmatch(variable.field)
    if word is not None and variable.bit is not None:
        return f"{word[1]}_bit_register_{int(word[2]) + variable.bit}"
    element = "" if variable.element is None else f"[{variable.element}]"
    bit = "" if variable.bit is None else f".{variable.bit}"
    return f"{variable.field}{element}{bit}"


def _type(variable: Variable) -> str:
    if variable.low is None or variable.high is None:
        return {ValueKind.BOOL: "bool", ValueKind.INT: "int", ValueKind.FLOAT: "double"}[variable.kind]
    bits = int(variable.high).bit_length()
    return f"int{bits + 1}" if variable.low < 0 else f"uint{bits}"


def _place(placement: Placement) -> str:
    """`holding 100 (400101) int32`, `holding 0.3 (400001.3)`, `coil 5 (000006)`."""
    bit = "" if placement.bit is None else f".{placement.bit}"
    notation = f"{placement.area.notation(placement.address)}{bit}"
    text = f"{AREA_NAMES[placement.area]} {placement.address}{bit} ({notation})"
    codec = placement.codec
    if codec is None:
        return text
    order = "" if codec.order == "ABCD" else f" {codec.order}"
    scale = "" if codec.scale == 1 else f" * {_number(codec.scale)}"
    offset = f" + {_number(codec.offset)}" if codec.offset else ""
    return f"{text} {codec.type}{order}{scale}{offset}"


def _objects(plan: Plan) -> dict[int, str]:
    """CANopen objects by variable index, for any plan whose `canopen` has `objects`."""
    found: dict[int, str] = {}
    for one in getattr(canopen_of(plan), "objects", ()):
        text = f"{one.index:04X}h sub {one.subindex} {_text(plan, 'type', one.type)}"
        found[one.variable] = f"{found[one.variable]}, {text}" if one.variable in found else text
    return found


def _limits(variable: Variable) -> str:
    limits = variable.limits
    return (
        ""
        if limits is None
        else f"{_number(limits.low)}..{_number(limits.high)}" + (" clamped" if limits.clamp else "")
    )


def _when_lost(variable: Variable) -> dict[str, str]:
    if variable.direction is Direction.INPUT:
        return {"on_release": _fallback(variable.on_release)}
    return {"on_stale": _fallback(variable.on_stale)}


def _fallback(fallback: Fallback) -> str:
    if fallback.value is None:
        return fallback.kind.value
    return _number(fallback.value)


def _text(plan: Plan, name: str, value: Any) -> str:
    """Any value of a link's plan; `variable`, `quality_of` and `...writer` are indices and shown by name."""
    if value is None:
        return "" if name == "quality_of" else "none"
    if name in ("variable", "quality_of"):
        return str(plan.cell.variables[value].name)
    if name.endswith("writer"):
        return str(plan.cell.writers[value].name)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Enum):
        return value.name.lower()
    if isinstance(value, tuple):
        return "; ".join(_text(plan, "", item) for item in value)
    if dataclasses.is_dataclass(value):
        named = getattr(value, "name", None)
        if isinstance(named, str) and name == "type":
            return named
        return " ".join(_parts(plan, value))
    return str(value)


def _parts(plan: Plan, value: Any) -> Iterator[str]:
    for field in dataclasses.fields(value):
        text = _text(plan, field.name, getattr(value, field.name))
        if text:
            yield f"{field.name}={text}"


def _told(facts: Mapping[str, str]) -> Facts:
    return {name: text for name, text in facts.items() if text}


def _seconds(seconds: float) -> str:
    return f"{_number(seconds)} s"


def _number(number: float) -> str:
    """Every digit that matters, and none that does not."""
    return repr(number).removesuffix(".0").lower()


def _network(network: Any) -> str:
    return str(network.network_address) if network.num_addresses == 1 else str(network)
