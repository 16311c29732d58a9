"""What the commands that talk to one robot share: what went wrong, in one line, with the exit code."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import click

from gatewayd.report.printable import printable

FAILED = 1
"""Exit code: the robot was not reached or lost, or refuses."""


class RobotFailure(click.ClickException):
    """The robot was not reached, or refuses; the text says why and what to do."""

    exit_code = FAILED

    def __init__(self, text: str) -> None:
        super().__init__(printable(text))


@contextmanager
def failures() -> Iterator[None]:
    """Turn what the library raises into the end of the command."""
    from gatewayd.cli.rtde.field_choice import hint
    from gatewayd.rtde import FieldsRefusedError, RtdeError

    try:
        yield
    except FieldsRefusedError as error:
        raise RobotFailure(
            "; ".join(f"{each.field}: {each.word}, {each.hint}{hint(each.field)}" for each in error.fields)
        ) from error
    except (RtdeError, TimeoutError) as error:
        raise RobotFailure(failure_text(error)) from error


def failure_text(error: Exception) -> str:
    """What went wrong with a robot, in words."""
    if isinstance(error, TimeoutError):
        return "the robot sends no data: its safety set-up may be unconfirmed"
    return str(error)
