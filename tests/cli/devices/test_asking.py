"""Names of devices, completed."""

from __future__ import annotations

from pathlib import Path

import click

from gatewayd.cli.devices.asking import complete_devices
from gatewayd.cli.devices.read import command
from tests.cli.conftest import Invoke
from tests.cli.devices.conftest import Plant


def test_names_are_completed(plant: Plant, tmp_path: Path) -> None:
    context = click.Context(command)
    context.params["socket"] = tmp_path / "control.sock"
    (found,) = complete_devices(context, command.params[0], "is")
    assert (found.value, found.help) == ("island", f"good, 127.0.0.1:{plant.port}")


def test_nothing_without_a_gateway(invoke: Invoke) -> None:
    del invoke
    assert complete_devices(click.Context(command), command.params[0], "") == []
