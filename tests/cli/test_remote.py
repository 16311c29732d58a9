"""Durations, and the one way in which errors of the interface become errors of a command."""

from __future__ import annotations

import click
import pytest

from gatewayd.cli.remote import DURATION, RemoteError, Unreachable, refusals
from gatewayd.control.client import Client, ControlError, NoDaemon


@pytest.mark.parametrize(
    "text, seconds", [("30s", 30.0), ("500ms", 0.5), ("1.5min", 90.0), ("2h", 7200.0), (" 5 s ", 5.0)]
)
def test_durations(text: str, seconds: float) -> None:
    assert DURATION.convert(text, None, None) == seconds


@pytest.mark.parametrize(
    "text", ["", "30", "s", "-1s", "0s", "0.0s", "1 day", "1e3s", "٣s", "9" * 5000 + "s"]
)
def test_what_is_no_duration(text: str) -> None:
    with pytest.raises(click.BadParameter, match="is not a duration"):
        DURATION.convert(text, None, None)


def test_refusals_name_the_option_not_the_field() -> None:
    client = Client()
    with pytest.raises(RemoteError, match="say which with --cell") as caught, refusals(client, "x"):
        raise ControlError(409, "ambiguous", "x is in several cells (a, b): say which with `cell`", {})
    assert caught.value.exit_code == 1
    with pytest.raises(Unreachable) as gone, refusals(client, "x"):
        raise NoDaemon("nobody")
    assert gone.value.exit_code == 2
