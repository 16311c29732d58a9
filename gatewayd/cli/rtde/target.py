"""Which controller a command is for: `HOST` or `HOST:PORT`, as people type it."""

from __future__ import annotations

from typing import Any

import click

from gatewayd.report.format import parse_address
from gatewayd.rtde.types import DEFAULT_PORT

Target = tuple[str, int]
"""Host and port."""


class TargetType(click.ParamType):  # type: ignore[type-arg]
    """`192.0.2.10`, `robot.local:30004`, `::1`, `[::1]:30004`; the port is RTDE's where none is named."""

    name = "host"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Target:
        """Host and port; fails with what was expected."""
        if isinstance(value, tuple):
            return value
        try:
            return parse_address(str(value), DEFAULT_PORT)
        except ValueError as error:
            self.fail(str(error), param, ctx)


TARGET = TargetType()
