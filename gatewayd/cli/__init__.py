"""The command line: one module per command, imported when the command is used, so that `--help` answers at once."""

from __future__ import annotations

import click

from gatewayd import __version__
from gatewayd.cli.help_text import FittingFormatter
from gatewayd.cli.lazy import LazyGroup

COMMANDS = {
    "demo": "Simulator, gateway, PLC, I/O island and CANopen master together.",
    "check": "Find every mistake in mapping files, without a robot.",
    "doctor": "Find out why a cell does not work, and what to do.",
    "test": "Carry out the tests of mapping files, in simulated time.",
    "diff": "Print what a new mapping file changes.",
    "show": "Print the register table of a mapping file.",
    "export": "Write a PLC program, robot program functions, an EDS or a DCF.",
    "simulate": "Simulate a robot controller to connect to.",
    "run": "Serve the cells of mapping files: the daemon.",
    "reload": "Make the running gateway read its mapping files again.",
    "status": "Print the state of the running gateway.",
    "watch": "Watch the variables of the running gateway live.",
    "devices": "Print the devices, find them on a line, read and write one.",
    "locks": "Print who owns what; take and release locks.",
    "events": "Print past events, and follow new ones.",
    "trace": "Print the traffic on the links of the running gateway, decoded.",
    "force": "Force a variable to a value, for commissioning.",
    "unforce": "End a force before its time.",
    "token": "Make, list and revoke tokens for the status page and its API.",
    "standby": "Print which of two gateways serves a cell; hand it over.",
    "rtde": "Work with a robot's RTDE interface, without a mapping.",
    "import": "Make a mapping from a register list, data sheet or recipe.",
    "completion": "Print the completion script of a shell.",
}
"""Name -> what the list of commands says. Module `gatewayd.cli.NAME` has the click command as `command`."""

_MODULES = {"import": "importing"}
"""Command -> its module, where no module can have its name."""

HELP = """\
gatewayd puts the fieldbus registers of a Universal Robots controller, and any other RTDE field, on Modbus TCP and
on CANopen, in both directions, with one owner per variable. What lies where is declared in one mapping file per robot
cell.

\b
Five commands from nothing to a running cell:
  gatewayd demo                           see it work, no robot needed
  gatewayd check mappings/*.yaml          try the shipped mappings
  gatewayd show mappings/small-cell.yaml  the register list for the PLC
  gatewayd simulate                       a controller on your desk
  gatewayd run my-cell.yaml               the daemon itself
"""

EPILOG = """\
\b
Exit codes:
  0    all is well
  1    the command found something, or what it had to do failed
  2    wrong usage, or a file that cannot be read
  70   a defect in gatewayd itself; GATEWAYD_TRACEBACK=1 shows where
  130  interrupted by Ctrl-C
"""


# Of all commands, those of groups among them, which make contexts of their own.
click.Context.formatter_class = FittingFormatter


@click.group(
    cls=LazyGroup,
    package="gatewayd.cli",
    summaries=COMMANDS,
    modules=_MODULES,
    help=HELP,
    epilog=EPILOG,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(__version__, "-V", "--version", prog_name="gatewayd", message="%(prog)s %(version)s")
def command() -> None:
    """The root of all commands; does nothing itself."""
