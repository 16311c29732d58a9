"""`gatewayd simulate`: a robot controller to connect to."""

from __future__ import annotations

import errno
import logging
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from gatewayd.simulator.fleet import Robots

CANNOT_SERVE = 1
SAFETY_TEXT = "SafetySetup has not been confirmed yet, therefore no data will be send yet"
_MODELS = ("ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e", "ur16e", "ur20", "ur30")
_PROBABILITY = click.FloatRange(0, 1)


def _seconds(_ctx: click.Context, param: click.Parameter, value: str | None) -> float | None:
    """A number of seconds; infinity for `never`, which only --overflow-close takes."""
    if value is None:
        return None
    if value == "never" and param.name == "overflow_close":
        return math.inf
    try:
        seconds = float(value)
    except ValueError:
        seconds = math.nan
    if not 0 <= seconds < math.inf:
        message = f"{value!r} is not a number of seconds"
        raise click.BadParameter(message)
    return seconds


@click.command(
    name="simulate",
    epilog="""\b
The robot program, one rule a line or separated by `;`, run in order in every control cycle:
  TARGET = SOURCE [* NUMBER] [+ NUMBER] [after DURATION] [for DURATION]
  TARGET = not SOURCE [after DURATION] [for DURATION]
  TARGET = count SOURCE | count every DURATION
  TARGET = toggle SOURCE | toggle every DURATION
  TARGET = NUMBER

TARGET and SOURCE are RTDE fields (output_int_register_0), elements (actual_TCP_pose[2]), bits of integers
(actual_digital_input_bits.0) or reserved bits (output_bit_register_0 to _63); NAME_0..23 on both sides makes a rule
for each number. `after` delays every change, `for` turns every change from 0 into a pulse, `count` and `toggle` act
on every change of SOURCE from 0. A DURATION has its unit: 200ms, 1.5s. A # starts a comment.

\b
Commands on standard input (--control stdin), each answered with `ok`, `ok RESULT` or `error REASON`:
  get FIELD                          set FIELD VALUE[,VALUE...]
  hold FIELD[,FIELD...] [by NAME]    free FIELD[,FIELD...]
  power on|off|release               program play|pause|stop
  safety CONDITION: normal, reduced, protective-stop, safeguard-stop, robot-emergency-stop, ...
  freeze on|off                      creep on|off
  silence on|off                     overwrite FIELD VALUE[,...]|off
  pause SECONDS                      delay SECONDS
  drop-clients                       drop-at STEP[:NUMBER]|off
  text MESSAGE                       raw HEX
  clients                            restart
  step [CYCLES] (--stepped)          quit (as does the end of input)

Several robots have names, those of the scenario or robot1, robot2, ...; a command then begins with one:
`left: power on`.

\b
Examples:
  gatewayd simulate --program demo
  gatewayd simulate --program 'output_int_register_0 = input_int_register_0 * 2 + 1'
  gatewayd simulate --program 'output_bit_register_0 = input_bit_register_0 for 300ms' --control stdin
  gatewayd simulate --series cb3 --protocol-v1 --hold input_int_register_3
  gatewayd simulate --scenario cell.toml
  gatewayd simulate --port 30004 --port 30014 --control stdin
  gatewayd simulate --replay robot_data.csv --loop

\b
Exit codes:
  0    stopped by SIGTERM, SIGINT or `quit`
  1    it cannot listen on the address, or the recording cannot be read
  2    wrong usage, or a mistake in the robot program or in the scenario
""",
)
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option(
    "--port",
    "ports",
    type=click.IntRange(0, 65535),
    multiple=True,
    help="TCP port; 0 takes a free one and prints it. Repeatable: a robot on each. Default: 30004, or those of the "
    "scenario.",
)
@click.option(
    "--dashboard",
    type=click.IntRange(0, 65535),
    metavar="PORT",
    help="A dashboard server on this TCP port (a controller has it on 29999); 0 takes a free one and prints it. Not "
    "for PolyScope X, which has none. Default: none.",
)
@click.option(
    "--dashboard-programs",
    metavar="FILE,...",
    help="Programs that can be loaded by it; the first one is. Default: pick.urp,place.urp.",
)
@click.option(
    "--local-control", is_flag=True, help="With --dashboard: an e-Series robot in local control at first."
)
@click.option(
    "--scenario",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Robots and what happens to them when (TOML); other options that describe a robot stand in the file.",
)
@click.option(
    "--replay",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A recording as the robot, from the first client on, then the end. Outputs are those recorded and --field.",
)
@click.option("--loop", is_flag=True, help="With --replay: again and again; timestamps go on.")
@click.option(
    "--speed",
    type=click.FloatRange(0.01, 100),
    default=1.0,
    show_default=True,
    metavar="FACTOR",
    help="Seconds of the controller for each of the clock.",
)
@click.option("--stepped", is_flag=True, help="Time passes by the command `step` alone; needs --control.")
@click.option(
    "--model", type=click.Choice(_MODELS), default="ur5e", show_default=True, help="Size of the arm."
)
@click.option(
    "--series",
    type=click.Choice(["cb3", "e", "x"]),
    help="Controller series. Default: that of --version, else e.",
)
@click.option(
    "--version", help="Controller software, say 5.12.0; later fields are NOT_FOUND. Default: by series."
)
@click.option(
    "--frequency",
    type=click.FloatRange(1, 1000),
    metavar="HZ",
    help="Control cycles per second, instead of the 125 or 500 of the series.",
)
@click.option(
    "--uptime",
    callback=_seconds,
    help="First timestamp. [default: 100; 0 with --boot-restart]",
    metavar="SECONDS",
)
@click.option(
    "--program",
    "programs",
    multiple=True,
    metavar="RULE",
    help="Rule of the robot program (below), or `demo`: echo all reserved registers and bits. Repeatable.",
)
@click.option(
    "--program-file",
    "program_files",
    multiple=True,
    type=click.Path(path_type=Path),
    help="File of such rules. Repeatable.",
)
@click.option(
    "--connections",
    type=click.IntRange(1, 1000),
    default=16,
    show_default=True,
    help="Greatest number of clients at a time.",
)
@click.option("--protocol-v1", "v1_only", is_flag=True, help="Fault: refuse protocol version 2.")
@click.option(
    "--text-on-connect",
    is_flag=False,
    flag_value=SAFETY_TEXT,
    metavar="[TEXT]",
    help="Fault: a text message before anything was asked for, as an unpowered PolyScope X sends it.",
)
@click.option(
    "--boot-restart",
    callback=_seconds,
    metavar="SECONDS",
    help="Fault: restart once, this long after the start, timestamp from 0 again.",
)
@click.option(
    "--adapter",
    type=click.Choice(["profinet", "ethernet-ip"]),
    help="Fault: a fieldbus adapter owns registers 0-23, bits 0-63 and the IO.",
)
@click.option("--hold", metavar="FIELD,...", help="Fault: inputs that the controller itself has claimed.")
@click.option(
    "--field",
    "fields",
    multiple=True,
    metavar="NAME:TYPE",
    help="An output that is newer than the catalogue, or has another type there; may be repeated.",
)
@click.option(
    "--unreadable",
    metavar="FIELD,...",
    help="Fault: inputs that can be claimed, but are NOT_FOUND when read back.",
)
@click.option(
    "--strict-lists",
    is_flag=False,
    flag_value="complain",
    type=click.Choice(["refuse", "complain", "ignore", "close"]),
    help="Fault: how a list of names of more than 2048 bytes is answered: refused with id 0, by a text message alone "
    "(complain, the default), not at all, or by closing the connection.",
)
@click.option(
    "--drop-at",
    metavar="STEP[:NUMBER]",
    help="Fault: close a connection instead of answering this step: version, controller, outputs, inputs, start, "
    "pause, write or data. NUMBER: the first, second, ... of that kind on the connection.",
)
@click.option(
    "--drop-times",
    type=click.IntRange(0),
    default=1,
    show_default=True,
    help="How many connections --drop-at closes; 0: all.",
)
@click.option(
    "--delay",
    callback=_seconds,
    default="0",
    metavar="SECONDS",
    help="Fault: delay packages and answers by this time.",
)
@click.option(
    "--linger",
    type=click.IntRange(0, 3_600_000),
    default=0,
    metavar="MS",
    help="Fault: release claims only this long after a connection has closed.",
)
@click.option(
    "--overflow-close",
    callback=_seconds,
    default="1",
    show_default=True,
    metavar="SECONDS",
    help="Close the connection of a client that has not read for this long; `never`: do not.",
)
@click.option("--drop", type=_PROBABILITY, default=0.0, help="Fault: probability of losing a data package.")
@click.option(
    "--duplicate", type=_PROBABILITY, default=0.0, help="Fault: probability of sending a data package twice."
)
@click.option(
    "--split",
    type=_PROBABILITY,
    default=0.0,
    help="Fault: probability of sending a data package in two segments.",
)
@click.option(
    "--seed", type=int, default=0, show_default=True, help="Seed of the random numbers behind these three."
)
@click.option("--freeze", is_flag=True, help="Fault: the timestamp stands still, packages go on.")
@click.option(
    "--creep", is_flag=True, help="Fault: as --freeze, but the timestamp advances by 1 ns per cycle."
)
@click.option("--silence", is_flag=True, help="Fault: no data packages.")
@click.option("--control", type=click.Choice(["stdin"]), help="Take commands (below) from standard input.")
@click.option("-q", "--quiet", is_flag=True, help="Log warnings only.")
@click.pass_context
def command(ctx: click.Context, /, control: str | None, *, quiet: bool, **options: Any) -> int:
    """Simulate a Universal Robots controller: its RTDE interface with moving values, claims and a robot program.

    It serves several RTDE clients at a time, as a real controller does, and prints one line when it listens. Faults
    are chosen by options; some can also be switched while it runs (--control). A scenario (--scenario) plays them by
    itself, for one robot or several; a recording (--replay) takes the robot's place.
    """
    from gatewayd.cli.simulate_options import UnreadableRecordingError, robots_of
    from gatewayd.logs.records import configure

    level = logging.WARNING if quiet else logging.INFO
    configure(level=level)
    if options["stepped"] and control is None:
        raise click.UsageError("--stepped needs --control stdin: `step` lets time pass")
    try:
        robots = robots_of(ctx, **options)
    except UnreadableRecordingError as error:
        click.echo(f"gatewayd: {error}", err=True)
        return CANNOT_SERVE
    return _run(robots, control=control is not None)


def _run(robots: Robots, *, control: bool) -> int:
    import asyncio

    from gatewayd.service.standard_streams import OutputError
    from gatewayd.simulator.process import serve
    from gatewayd.simulator.replay import Replay

    try:
        asyncio.run(serve(robots, control=control))
    except (BrokenPipeError, OutputError):
        # Of stdout: no fault of the address.
        raise
    except OSError as error:
        click.echo(f"gatewayd: cannot listen on {_refused(robots)}: {_reason(error)}", err=True)
        return CANNOT_SERVE
    followers = [robot.follower for robot in robots.values()]
    return CANNOT_SERVE if any(isinstance(one, Replay) and one.problem for one in followers) else 0


def _refused(robots: Robots) -> str:
    """The address that could not be had."""
    robot = next(robot for robot in robots.values() if not robot.started)
    is_dashboard = robot.dashboard is not None and robot.has_port
    port = robot.dashboard.port if robot.dashboard is not None and is_dashboard else robot.port
    return f"{robot.host}:{port}"


def _reason(error: OSError) -> str:
    # asyncio's own text says "error while attempting to bind" and repeats the address.
    reason = os.strerror(error.errno) if error.errno and error.errno > 0 else str(error)
    if error.errno == errno.EADDRINUSE:
        reason += "; stop the simulator that runs there, or let --port 0 take a free one"
    return reason
