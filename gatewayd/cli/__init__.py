"""The command line: one module per command, imported when the command is used, so that `--help` answers at once."""

from __future__ import annotations

from importlib import import_module

import click
from click.shell_completion import CompletionItem

from gatewayd import __version__
from gatewayd.cli.help_text import FittingFormatter

COMMANDS = {
    "demo": "Simulator, gateway, a PLC and a CANopen master in one terminal.",
    "check": "Find every mistake in mapping files, without a robot.",
    "diff": "Print what a new mapping file changes.",
    "show": "Print the register table of a mapping file.",
    "export": "Write the EDS, the DCF or robot program lines of a mapping file.",
    "simulate": "Simulate a robot controller to connect to.",
    "run": "Serve the cells of mapping files: the daemon.",
    "reload": "Make the running gateway read its mapping files again.",
    "status": "Print the state of the running gateway.",
    "watch": "Watch the variables of the running gateway live.",
    "locks": "Print who owns what; take and release locks.",
    "events": "Print past events, and follow new ones.",
    "trace": "Print the traffic on the links of the running gateway, decoded.",
    "force": "Force a variable to a value, for commissioning.",
    "unforce": "End a force before its time.",
    "completion": "Print the completion script of a shell.",
}
"""Name -> what the list of commands says. Module `gatewayd.cli.NAME` has the click command as `command`."""

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


class LazyGroup(click.Group):
    """A group that knows its commands' names and one-line helps, and imports a command only to use it."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names in the order in which people meet them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name; None when there is none."""
        if cmd_name not in COMMANDS:
            return None
        found = import_module(f"gatewayd.cli.{cmd_name}").command
        assert isinstance(found, click.Command)
        return found

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that was named; fails with the one that was meant."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            from difflib import get_close_matches

            close = get_close_matches(args[0], COMMANDS, n=1)
            if not close:
                raise
            raise click.UsageError(f"{error.message} Did you mean {close[0]!r}?", ctx) from error

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Command names and options that begin with `incomplete`."""
        names = [
            CompletionItem(name, help=text) for name, text in COMMANDS.items() if name.startswith(incomplete)
        ]
        return names + click.Command.shell_complete(self, ctx, incomplete)


@click.group(
    cls=LazyGroup,
    help=HELP,
    epilog=EPILOG,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(__version__, "-V", "--version", prog_name="gatewayd", message="%(prog)s %(version)s")
def command() -> None:
    """The root of all commands; does nothing itself."""
