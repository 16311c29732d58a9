"""`gatewayd rtde set`: write inputs of a robot, once, verified."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gatewayd.cli.rtde.target import TARGET, Target

if TYPE_CHECKING:
    from gatewayd.cli.rtde.assignments import Assignments
    from gatewayd.rtde import Robot

_PATIENCE = 3.0
"""Seconds to wait for the first package, and for each value to be shown by the robot."""
_RECIPE = "set"
_STATE = "runtime_state"


@click.command(
    name="set",
    epilog="""\b
What can be set:
  input_int_register_24=7           registers: integers, reals (0.5), words of bits (0x1f)
  input_bit_register_70=on          bits 0 to 127; the others of the word keep what they hold
  standard_digital_output_3=on      also configurable_... 0 to 7, tool_... 0 and 1; the others stay as they are
  standard_analog_output_0=5V       or 12mA: the unit selects the domain
  speed_slider=50%                  or 0.5
  external_force_torque=0,0,5,0,0,0

\b
Examples:
  gatewayd rtde set 192.0.2.10 input_int_register_24=7 input_bit_register_70=on
  gatewayd rtde set 192.0.2.10 standard_digital_output_3=off --while-running

\b
Exit codes:
  0  written, and shown by the robot
  1  refused: a gateway serves the robot, a program runs, a field is in use; or the robot was not reached
  2  wrong usage
""",
)
@click.argument("host", type=TARGET)
@click.argument("assignments", nargs=-1, required=True, metavar="FIELD=VALUE...")
@click.option(
    "--while-running", is_flag=True, help="Write although a program runs, or it is not known whether."
)
@click.option(
    "--socket",
    type=click.Path(path_type=Path),
    envvar="GATEWAYD_CONTROL",
    help="Ask the gateway at this control socket, too, whether it serves the robot; all that are found here are asked.",
)
@click.option(
    "--beside-unknown-gateway",
    is_flag=True,
    help="Write although a gateway runs here of which it cannot be found out whether it serves the robot.",
)
def command(
    host: Target,
    assignments: tuple[str, ...],
    *,
    while_running: bool,
    socket: Path | None,
    beside_unknown_gateway: bool,
) -> None:
    """Write to inputs of the robot at HOST: claim them, write, wait until the robot shows it, and give them back.

    This can MOVE THE ROBOT, or what it works with. The values stay in the controller afterwards: nothing sets them
    back. Refused where a gateway on this machine serves the robot, as it would not know (use gatewayd force), and while
    a program runs.
    """
    import asyncio

    from gatewayd.cli.rtde.assignments import AssignmentError, parse_assignments
    from gatewayd.cli.rtde.guard import gateway_in_the_way
    from gatewayd.cli.rtde.robots import RobotFailure, failures

    try:
        wanted = parse_assignments(assignments)
    except AssignmentError as error:
        raise click.UsageError(str(error)) from error
    refusal = gateway_in_the_way(*host, socket, beside_unknown=beside_unknown_gateway)
    if refusal:
        raise RobotFailure(f"nothing was written: {refusal}")
    with failures():
        asyncio.run(_set(host, wanted, while_running=while_running))
    click.echo("The controller keeps these values: nothing sets them back.")


async def _set(host: Target, wanted: Assignments, *, while_running: bool) -> None:
    from gatewayd import rtde
    from gatewayd.cli.rtde.guard import program_in_the_way
    from gatewayd.cli.rtde.robots import RobotFailure, failure_text
    from gatewayd.report.printable import printable

    robot = rtde.connect(
        host[0],
        port=host[1],
        outputs=[_STATE],
        inputs={_RECIPE: wanted.fields()},
        strict=False,
        reconnect=None,
    )
    async with robot:
        held = [each for each in robot.unavailable if not each.output]
        if held:
            texts = "; ".join(f"{each.field}: {each.word}, {each.hint}" for each in held)
            raise RobotFailure(f"nothing was written: {texts}")
        try:
            sample = await robot.newer(_PATIENCE)
        except (rtde.RtdeError, TimeoutError) as error:
            raise RobotFailure(f"nothing was written: {failure_text(error)}") from error
        problem = program_in_the_way(sample.runtime_state if _STATE in sample else None)
        if problem and not while_running:
            raise RobotFailure(f"nothing was written: {problem}; --while-running writes all the same")
        async for line in _written(robot, wanted):
            click.echo(printable(line))


async def _written(robot: Robot, wanted: Assignments) -> AsyncIterator[str]:
    """Write one after the other; a line for each that the robot has."""
    from gatewayd.rtde.api.verification import shown_by

    if wanted.registers:
        verified = all(map(shown_by, wanted.registers))
        await robot.write(_RECIPE, wanted.registers, verify=verified, timeout=_PATIENCE)
        for name, value in wanted.registers.items():
            shown = "" if shown_by(name) else ", sent; the robot does not show what it holds"
            yield f"{name} = {_text(value)}{shown}"
    if wanted.bits:
        await robot.set_input_bits(wanted.bits, verify=True, timeout=_PATIENCE)
    for number, value in wanted.bits.items():
        yield f"input_bit_register_{number} = {_text(value)}"
    switches = {
        "standard": robot.set_standard_digital_outputs,
        "configurable": robot.set_configurable_digital_outputs,
        "tool": robot.set_tool_digital_outputs,
    }
    for kind, pins in wanted.pins.items():
        await switches[kind](pins, verify=True, timeout=_PATIENCE)
        for number, value in pins.items():
            yield f"{kind}_digital_output_{number} = {_text(value)}"
    for number, (amount, unit) in wanted.analog.items():
        in_unit = {"volts": amount} if unit == "V" else {"milliamperes": amount}
        await robot.set_analog_output(number, **in_unit, verify=True, timeout=_PATIENCE)
        yield f"standard_analog_output_{number} = {amount:g} {unit}"
    if wanted.slider is not None:
        await robot.set_speed_slider(wanted.slider, allow_zero=True, verify=True, timeout=_PATIENCE)
        yield f"speed_slider = {wanted.slider:.0%}"


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)
