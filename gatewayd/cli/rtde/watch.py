"""`gatewayd rtde watch`: fields of a robot, live in a terminal, or as lines for everything else."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from gatewayd.cli.remote import DURATION
from gatewayd.cli.rtde.target import TARGET, Target

if TYPE_CHECKING:
    from rich.console import Console

    from gatewayd.cli.rtde.robot_picture import RobotGlimpse
    from gatewayd.rtde.sync import BlockingRobot

_PATIENCE = 3.0
"""Seconds to wait for the first package."""


@click.command(
    name="watch",
    epilog="""\b
Keys:
  q quit

\b
Examples:
  gatewayd rtde watch 192.0.2.10                          what people usually want to see
  gatewayd rtde watch 192.0.2.10 runtime_state actual_TCP_pose output_int_register_0
  gatewayd rtde watch 192.0.2.10 actual_q --interval 2s | tee log.txt

\b
Exit codes:
  0  ended by q or Ctrl-C
  1  the robot was not reached, or lacks a field
  2  wrong usage
""",
)
@click.argument("host", type=TARGET)
@click.argument("fields", nargs=-1, metavar="[FIELD]...")
@click.option(
    "--interval",
    type=DURATION,
    default="500ms",
    show_default=True,
    metavar="TIME",
    help="Time between two updates.",
)
def command(host: Target, fields: tuple[str, ...], *, interval: float) -> None:
    """Watch the FIELDs of the robot at HOST live, with the measured rate and skipped packages.

    A robot that is lost is waited for; what is shown meanwhile is marked as old. Nothing is written and nothing
    claimed.
    """
    from rich.console import Console

    from gatewayd.cli.rtde.field_choice import USUAL, named
    from gatewayd.cli.rtde.robots import failures
    from gatewayd.cli.terminal import ending_on_signals
    from gatewayd.rtde import sync

    console = Console(highlight=False)
    names = named(fields) or USUAL
    live = console.is_terminal and not console.is_dumb_terminal and sys.stdin.isatty()
    with (
        suppress(KeyboardInterrupt),
        ending_on_signals(),
        failures(),
        sync.connect(host[0], port=host[1], outputs=names, buffer=0) as robot,
    ):
        robot.newer(_PATIENCE)
        if live:
            _live(console, robot, names, max(0.1, interval))
        else:
            _lines(robot, names, max(0.1, interval))


def _look(robot: BlockingRobot, names: tuple[str, ...], before: RobotGlimpse | None) -> RobotGlimpse:
    """What is there now; without a session what was there last, marked as old."""
    from dataclasses import replace

    from gatewayd.cli.rtde.robot_picture import RobotGlimpse

    sample = robot.latest
    loss = robot.last_loss
    if sample is None:
        lost = loss.text if loss is not None else "no data"
        return (
            replace(before, lost=lost) if before is not None else RobotGlimpse(robot.address, {}, lost=lost)
        )
    return RobotGlimpse(
        robot.address,
        {name: sample[name] for name in names},
        timestamp=sample.timestamp,
        rate=robot.measured_frequency,
        skipped=robot.statistics.skipped,
    )


def _lines(robot: BlockingRobot, names: tuple[str, ...], interval: float) -> None:
    from gatewayd.cli.printing import echo
    from gatewayd.cli.rtde.robot_picture import plain

    glimpse = None
    while True:
        glimpse = _look(robot, names, glimpse)
        for line in plain(glimpse):
            echo(line)
        sys.stdout.flush()
        time.sleep(interval)


def _live(console: Console, robot: BlockingRobot, names: tuple[str, ...], interval: float) -> None:
    from rich.live import Live

    from gatewayd.cli.rtde.robot_picture import picture
    from gatewayd.cli.terminal import keys, raw

    glimpse, before = _look(robot, names, None), None
    descriptor = sys.stdin.fileno()
    with raw(descriptor), Live(console=console, screen=True, auto_refresh=False) as screen:
        while True:
            screen.update(picture(glimpse, before, console.size.height), refresh=True)
            if {"q", "Q", "\x03"} & set(keys(descriptor, interval)):
                return
            glimpse, before = _look(robot, names, glimpse), glimpse
