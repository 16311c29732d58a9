"""What reading and writing a device have in common: through the running gateway, or by a mapping file without one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from gatewayd.cli.remote import RemoteError, cell_option, echo_json, readable, refusals
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from gatewayd.links.examination import RunningCell

_BROKEN = 2
"""Exit code of a mapping that says nothing of devices, because it has errors."""
_COMPLETION_PATIENCE = 0.5
_GATEWAY_PATIENCE = 30.0
"""Seconds for an answer: the device may be slow, and several requests may be needed."""


@dataclass(frozen=True, slots=True)
class Asked:
    """By which way a device is asked, and how its numbers are made."""

    socket: Path | None
    cell: str | None
    mapping: str | None
    type: str
    order: str


@dataclass(frozen=True, slots=True)
class HandAnswer:
    """What came of it, as the control interface answers it."""

    found: dict[str, Any]
    note: str = ""

    def show(self, *, as_json: bool) -> None:
        """Print it."""
        if self.note:
            click.echo(printable(self.note), err=True)
        if as_json:
            echo_json(self.found)
            return
        found = readable(self.found)
        former = {value["place"]: value["value"] for value in found.get("former", ())}
        if not found["values"]:
            click.echo(f"{found['place']}: written; it cannot be read")
        for value in found["values"]:
            before = former.get(value["place"])
            was = f"  (was {_shown(before)})" if before is not None else ""
            raw = f"  {value['raw']}h" if value["raw"] else ""
            click.echo(f"{value['place']}: {_shown(value['value'])}{raw}{was}")


def device_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give the command its options, and what they say as `asking`."""

    @click.option(
        "--type", "type_", metavar="TYPE", default="", help="int16, uint32, float32, text and so on."
    )
    @click.option(
        "--order", metavar="ORDER", default="", help="Of the bytes of a value in several registers: CDAB."
    )
    @click.option(
        "--mapping",
        metavar="FILE",
        help="Ask the device directly, where no gateway runs; the mapping says where it is.",
    )
    @click.option(
        "--socket",
        type=click.Path(path_type=Path),
        envvar="GATEWAYD_CONTROL",
        is_eager=True,
        help="Control socket of the gateway. Default: that of the only gateway here.",
    )
    @cell_option
    @wraps(command)
    def run(
        type_: str, order: str, mapping: str | None, socket: Path | None, cell: str | None, **options: Any
    ) -> None:
        group = click.get_current_context().parent
        given = group.params if group is not None else {}
        asking = Asked(socket or given.get("socket"), cell or given.get("cell"), mapping, type_, order)
        command(asking=asking, **options)

    return run


def complete_devices(
    context: click.Context, _param: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Names of devices of the running gateway; nothing if it cannot be asked at once."""
    from gatewayd.cli.devices.table import devices_of
    from gatewayd.control.client import Client, ControlError, NoDaemon

    client = Client(context.params.get("socket"), _COMPLETION_PATIENCE)
    try:
        found = devices_of(client.get("/v1/status"), context.params.get("cell"))
    except (NoDaemon, ControlError, OSError, KeyError):
        return []
    return [
        CompletionItem(device["name"], help=printable(f"{device['state']}, {device['address']}"))
        for device in found
        if device["name"].startswith(incomplete)
    ]


def asked(asking: Asked, device: str, place: str, value: str | None) -> HandAnswer:
    """Read the place, or write a value there; ends the command where that cannot be."""
    if asking.mapping is not None:
        return _directly(asking, device, place, value)
    from gatewayd.control.client import Client, segment

    client = Client(asking.socket)
    body = {"place": place, "type": asking.type, "order": asking.order}
    body |= {"cell": asking.cell} if asking.cell is not None else {}
    body |= {"value": value} if value is not None else {}
    act = "read" if value is None else "write"
    with refusals(client, device):
        path = f"/v1/devices/{segment(device)}/{act}"
        return HandAnswer(client.post(path, body, patience=_GATEWAY_PATIENCE))


def running_cells(socket: Path | None) -> tuple[RunningCell, ...]:
    """What gateways on this machine serve: the one at `socket`, and all at the usual places."""
    import os

    from gatewayd.control.running import ask, sockets

    named = [socket] if socket is not None else []
    return ask(list(dict.fromkeys([*named, *sockets(None, os.environ)]))).cells


def _directly(asking: Asked, device: str, place: str, value: str | None) -> HandAnswer:
    import asyncio
    import getpass

    from gatewayd.cli.files import load_file
    from gatewayd.links.access import AccessError, PlaceRequest
    from gatewayd.links.registry import access_of, kind_of

    assert asking.mapping is not None
    loaded = load_file(asking.mapping)
    if loaded is None or loaded.plan is None:
        click.get_current_context().exit(_BROKEN)
    plan = loaded.plan
    devices = {name: link for name, link in plan.links.items() if kind_of(link.kind).access}
    if device not in devices:
        there = f"only {', '.join(devices)}" if devices else "nor any other"
        raise click.UsageError(printable(f"{loaded.name} has no device {device}, {there}"))
    access = access_of(devices[device].kind)
    assert access is not None
    refusal = access.refusal(devices[device], running_cells(asking.socket))
    if refusal:
        raise RemoteError(refusal)
    request = PlaceRequest(place, asking.type, asking.order, value)
    try:
        answer = asyncio.run(access.ask(devices[device], plan.cell, request))
    except AccessError as error:
        raise RemoteError(error) from error
    note = ""
    if value is not None:
        note = (
            f"no gateway runs, so no audit keeps this: {getpass.getuser()} wrote {device} {place} = {value}"
        )
    found = {
        "cell": plan.cell.name,
        "device": device,
        "place": answer.place,
        "values": _objects(answer.values),
    }
    if value is not None:
        found["former"] = _objects(answer.former)
    return HandAnswer(found, note)


def _objects(values: Any) -> list[dict[str, Any]]:
    return [{"place": each.place, "value": each.value, "raw": each.raw} for each in values]


def _shown(value: Any) -> str:
    return {True: "on", False: "off"}.get(value, str(value)) if isinstance(value, bool) else str(value)
