"""A cell as a daemon would serve it, without sockets and with time in the test's hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from gatewayd.control.api import Moment
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, Value
from gatewayd.links.contract import Link, LinkHealth, SourceLink, TapOf
from gatewayd.mapping.loader import load_together
from gatewayd.mapping.plan import Plan

MAPPING = """\
gatewayd: 1
cell: {name}
robot: {{host: 192.0.2.10, watchdog: {{field: input_int_register_23, frequency: 10, requires: [plc]}}}}
modbus: {{listen: '127.0.0.1:{port}', unit: 1}}
writers:
  plc: {{modbus: 192.0.2.20}}
  hmi: {{modbus: 192.0.2.21, timeout: 1s}}
groups:
  motion: {{owner: [plc, hmi], lease: 2s}}
variables:
  start: {{robot: input_bit_register_33, modbus: 0.1, owner: plc}}
  limit:
    robot: input_double_register_0
    modbus: {{holding: 20, type: int16, scale: 0.1}}
    limits: [0, 150]
    owner: plc
    unit: N
    comment: how hard
  speed: {{robot: input_double_register_1, modbus: 24, group: motion, on_release: 0.5}}
  path: {{robot: input_int_register_1, modbus: 28, group: motion, on_release: hold}}
  {extra}: {{robot: output_int_register_0, modbus: [100, {{input: 7}}], on_stale: exception}}
  tcp: {{robot: actual_TCP_pose, modbus: 200}}
  door: {{robot: actual_digital_input_bits.3, modbus: {{discrete: 64}}}}
"""
START, LIMIT, SPEED, PATH, CYCLES = range(5)


@dataclass
class ServedLink(Link):
    """A link that says of itself what a test has it say."""

    state: LinkHealth

    def health(self) -> LinkHealth:
        return self.state


@dataclass
class ServedSource(ServedLink, SourceLink):
    """The robot, which reads back what a test has it hold."""

    held: dict[int, Value] = field(default_factory=dict)

    def read_back(self, variable: int) -> Value | None:
        return self.held.get(variable)


@dataclass
class Served:
    """A cell with its links."""

    plan: Plan
    cell: Cell

    def __post_init__(self) -> None:
        self.source = ServedSource(LinkHealth(figures={"address": "192.0.2.10:30004", "watchdog": False}))
        unit = LinkHealth(
            "Modbus 127.0.0.1:1502", words="listening, no connections", figures={"connections": 0}
        )
        self.links: dict[str, Link] = {"robot": self.source, "modbus": ServedLink(unit)}

    def without_session(self, why: str) -> None:
        """The robot link cannot reach the controller."""
        self.source.state = replace(self.source.state, problems=(why,))


@dataclass
class FixedGateway:
    """What `Api` asks of a daemon."""

    runtimes: Sequence[Served]
    wrong: list[str] = field(default_factory=list)
    tap_of: TapOf | None = None
    """The taps that it has."""

    def troubles(self) -> Sequence[str]:
        return self.wrong

    def trace(self, tap_of: TapOf | None) -> None:
        self.tap_of = tap_of


def plan(name: str = "press", port: int = 1502, extra: str = "cycles") -> Plan:
    (loaded,) = load_together([(f"{name}.yaml", MAPPING.format(name=name, port=port, extra=extra).encode())])
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def bring_up(cell: Cell, now: float) -> None:
    """The robot is there, all inputs are 0, all outputs 1."""
    cell.robot_connected(now)
    variables = cell.definition.variables
    cell.adopt({n: one.kind.zero for n, one in enumerate(variables) if one.direction is Direction.INPUT}, now)
    assert cell.package_arrived(now, now)
    for index in cell.image.outputs:
        cell.image.values[index] = type(variables[index].kind.zero)(1)
    cell.outputs_written(now)


def at(now: float) -> Moment:
    """The wall clock runs 1.8e9 s ahead."""
    return Moment(now, 1_800_000_000.0 + now)
