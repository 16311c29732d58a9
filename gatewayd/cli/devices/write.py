"""`gatewayd devices write`: a value at a place of a device, past the variables of the mapping."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gatewayd.cli.devices.asking import asked, complete_devices, device_options
from gatewayd.cli.remote import json_option

if TYPE_CHECKING:
    from gatewayd.cli.devices.asking import Asked


@click.command(
    name="write",
    context_settings={"ignore_unknown_options": True},
    epilog="""\b
Examples:
  gatewayd devices write island holding:200 7
  gatewayd devices write island holding:200..201 7,8
  gatewayd devices write island 210 -12.5 --type float32
  gatewayd devices write island coil:9 on
  gatewayd devices write encoder 0x6003 0 --type uint32     an object by SDO

\b
Exit codes:
  0  written, and confirmed by the device
  1  a variable is mapped there, the device does not answer or refuses, or the running gateway has the line
  2  wrong usage, a mapping with errors, or no gateway could be reached
""",
)
@click.argument("device", shell_complete=complete_devices)
@click.argument("place")
@click.argument("value")
@device_options
@json_option
def command(asking: Asked, device: str, place: str, value: str, *, as_json: bool) -> None:
    """Write VALUE to PLACE of DEVICE. PLACE is as for `gatewayd devices read`; several values have commas between.

    Where a variable is mapped, nothing is written: its owner and its limits would be passed over. `gatewayd force` puts
    a value in its place. Every write is in the audit of the gateway, done or refused, with your name; without a
    gateway (--mapping) it is printed, since nobody keeps it.
    """
    answer = asked(asking, device, place, value)
    answer.show(as_json=as_json)
