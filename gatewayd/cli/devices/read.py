"""`gatewayd devices read`: what stands at a place of a device now."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gatewayd.cli.devices.asking import asked, complete_devices, device_options
from gatewayd.cli.remote import json_option

if TYPE_CHECKING:
    from gatewayd.cli.devices.asking import Asked


@click.command(
    name="read",
    epilog="""\b
PLACE is one of:
  holding:100, holding:100..103, or 100 alone    holding registers of a Modbus device
  input:4, coil:0..15, discrete:3                its input registers, coils and discrete inputs
  0x6004, 0x1018:4                               an object of a CANopen device, with its sub-index

\b
Examples:
  gatewayd devices read island holding:100..103              four registers
  gatewayd devices read island 100 --type float32 --order CDAB
  gatewayd devices read island coil:0..15
  gatewayd devices read encoder 0x6004                       an object by SDO
  gatewayd devices read encoder 0x1018:4                     its serial number
  gatewayd devices read gripper 1000 --mapping press.yaml    without a gateway

\b
Exit codes:
  0  read
  1  the device does not answer or refuses, or the running gateway has the line
  2  wrong usage, a mapping with errors, or no gateway could be reached
""",
)
@click.argument("device", shell_complete=complete_devices)
@click.argument("place")
@device_options
@json_option
def command(asking: Asked, device: str, place: str, *, as_json: bool) -> None:
    """Read PLACE of DEVICE: registers, coils or inputs of a Modbus device, an object of a CANopen device.

    The running gateway asks, on the connection that it has and between its polls. With --mapping no gateway is needed:
    the file says where the device is. Nothing is written.
    """
    answer = asked(asking, device, place, None)
    answer.show(as_json=as_json)
