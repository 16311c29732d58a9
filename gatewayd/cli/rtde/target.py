"""Which controller a command is for: `HOST` or `HOST:PORT`, as people type it."""

from __future__ import annotations

import re
from typing import Any

import click

from gatewayd.rtde.types import DEFAULT_PORT

Target = tuple[str, int]
"""Host and port."""

_BRACKETED = re.compile(r"\[([0-9A-Fa-f:.%\w]+)\](?::([0-9]+))?")
_NAMED = re.compile(r"([^\s:/\[\]]+)(?::([0-9]+))?")


class TargetType(click.ParamType):  # type: ignore[type-arg]
    """`192.168.1.10`, `robot.local:30004`, `::1`, `[::1]:30004`; the port is RTDE's where none is named."""

    name = "host"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Target:
        """Host and port; fails with what was expected."""
        if isinstance(value, tuple):
            return value
        text = str(value)
        if text.count(":") > 1 and not text.startswith("["):
            return text, DEFAULT_PORT
        found = _BRACKETED.fullmatch(text) or _NAMED.fullmatch(text)
        port = int(found[2] or DEFAULT_PORT) if found is not None else 0
        if found is None or not 0 < port < 65536:
            self.fail(f"{text!r} is not HOST or HOST:PORT, say 192.168.1.10 or robot.local:30004", param, ctx)
        return found[1], port


TARGET = TargetType()
