"""Mappings and generated programs for these tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from gatewayd.links.robot.urscript.export import EXPORTS
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan

MAPPINGS = Path(__file__).parents[4] / "mappings"
HEAD = """\
gatewayd: 1
cell: press
robot: {{host: 127.0.0.1{robot}}}
modbus: {{listen: 127.0.0.1:1502}}
writers:
  plc: {{modbus: 127.0.0.2, timeout: 1s}}
  hmi: {{modbus: 127.0.0.3, timeout: 1s}}
variables:
"""


def plan_of(variables: str, robot: str = "") -> Plan:
    found = load((HEAD.format(robot=robot) + variables).encode(), "press.yaml")
    assert found.plan is not None, [finding.message for finding in found.diagnostics]
    return found.plan


def shipped(name: str) -> Plan:
    path = MAPPINGS / name
    found = load(path.read_bytes(), str(path)).plan
    assert found is not None
    return found


def script(plan: Plan, **options: Any) -> str:
    (export,) = EXPORTS
    return export.make(plan, **options)


class Registers:
    """The registers of a controller, as its script functions have them."""

    def __init__(self) -> None:
        self.values: dict[str, Any] = {}
        self.said: list[str] = []

    def functions(self) -> dict[str, Callable[..., Any]]:
        found: dict[str, Callable[..., Any]] = {
            "textmsg": lambda *texts: self.said.append("".join(map(str, texts))),
            "popup": lambda text, **_: self.said.append(text),
            "sync": lambda: None,
        }
        for side in ("input", "output"):
            for kind, zero in (("boolean", False), ("integer", 0), ("float", 0.0)):
                register = f"{side}_{kind}_register"
                found[f"read_{register}"] = self._reader(register, zero)
                found[f"write_{register}"] = self._writer(register, type(zero))
        return found

    def _reader(self, register: str, zero: Any) -> Callable[[int], Any]:
        return lambda number: self.values.get(f"{register} {number}", zero)

    def _writer(self, register: str, kind: type) -> Callable[[int, Any], None]:
        def write(number: int, value: Any) -> None:
            assert type(value) is kind, f"{register} {number}: {value!r}"
            self.values[f"{register} {number}"] = value

        return write
