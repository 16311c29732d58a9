"""`gatewayd completion SHELL`: print the script that completes commands, options and file names."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

INSTRUCTIONS = {
    "bash": "gatewayd completion bash > ~/.local/share/bash-completion/completions/gatewayd",
    "zsh": 'gatewayd completion zsh > "${fpath[1]}/_gatewayd"',
    "fish": "gatewayd completion fish > ~/.config/fish/completions/gatewayd.fish",
}
"""Shell -> the line that installs its script for one user."""


@click.command("completion")
@click.argument("shell", type=click.Choice(sorted(INSTRUCTIONS)))
@click.pass_context
def command(ctx: click.Context, shell: str) -> None:
    """Print the completion script of SHELL.

    To try it in this shell: eval "$(gatewayd completion bash)". The script's last line says how to keep it.
    """
    script = get_completion_class(shell)
    assert script is not None
    click.echo(script(ctx.find_root().command, {}, "gatewayd", "_GATEWAYD_COMPLETE").source().strip())
    click.echo(f"# To keep it, once:  {INSTRUCTIONS[shell]}")
