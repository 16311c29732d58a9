"""Rules GW306, GW314 and GW607: how often the controller sends."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.robot.rates import MIN_RATE, package_period
from gatewayd.links.robot.rules.controller import controller
from gatewayd.links.robot.sections import RobotSection
from gatewayd.mapping.diagnostics import Diagnostic, Rule
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.report.wording import number, seconds


@cell_rule("GW306")
def rate_above_base(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A rate above the controller's own."""
    series, _ = controller(cell.document)
    robot = cell.document.part(RobotSection)
    if robot is None or series is None:
        return
    wanted = [(robot.spec.frequency, robot.at("frequency"), "packages")]
    if robot.spec.watchdog is not None:
        wanted.append((robot.spec.watchdog.frequency, robot.at("watchdog", "frequency"), "watchdog feeds"))
    for frequency, position, what in wanted:
        if frequency > series.base_rate:
            runs = f"series {series.word} runs at {series.base_rate} Hz"
            message = f"{number(frequency)} {what} per second are asked for, but {runs}"
            yield rule.at(position, message, hint=f"ask for {series.base_rate} or less")


@cell_rule("GW314")
def rate_too_low(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A rate of less than one package in ten seconds."""
    robot = cell.document.part(RobotSection)
    if robot is not None and 0 < robot.spec.frequency < MIN_RATE:
        message = f"{number(robot.spec.frequency)} Hz is less than one package in ten seconds"
        hint = f"`frequency` is in Hz: write at least {number(MIN_RATE)}, or 0 for the controller's own rate"
        yield rule.at(robot.at("frequency"), message, hint=hint)


@cell_rule("GW607")
def stale_too_soon(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Stale_after shorter than the time between two packages."""
    robot = cell.document.part(RobotSection)
    if robot is None or robot.spec.stale_after is None or 0 < robot.spec.frequency < MIN_RATE:
        return
    period = package_period(robot.spec)
    if robot.spec.stale_after < period:
        message = (
            f"stale_after {seconds(robot.spec.stale_after)} is shorter than the {seconds(period)} "
            f"between two packages"
        )
        hint = f"leave it out, or write at least {seconds(2 * period)}"
        yield rule.at(robot.at("stale_after"), message, hint=hint)
