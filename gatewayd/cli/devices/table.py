"""Devices as a gateway reports them, in lines for a terminal. Pure: JSON objects in, texts out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import click

from gatewayd.links.registry import kinds
from gatewayd.report.format import age, counted

_COLOURS: Final = {
    "good": "green",
    "partial": "yellow",
    "starting": "yellow",
    "lost": "red",
    "refusing": "red",
}
_NOUNS: Final = {"canopen": "node"}
"""Family -> what its `unit` is called there."""

Device = Mapping[str, Any]


def devices_of(status: Mapping[str, Any], cell: str | None) -> list[dict[str, Any]]:
    """The devices of a status, of one cell or of all, each with `cell` and `name` before its own fields."""
    titles = {kind.title for kind in kinds() if kind.access}
    return [
        {"cell": served["name"], "name": link["name"], **served[link["name"]]}
        for served in status["cells"]
        if cell in (None, served["name"])
        for link in served["links"]
        if link["title"] in titles
    ]


def lines(devices: Sequence[Device]) -> Iterator[str]:
    """A headline for each device, and below it what is known of it."""
    if not devices:
        yield "no devices: no mapping of this gateway has `devices`"
        return
    several = len({device["cell"] for device in devices}) > 1
    for device in devices:
        name = f"{device['cell']}:{device['name']}" if several else device["name"]
        state = click.style(_state(device), fg=_COLOURS.get(device["state"]))
        yield f"{click.style(name, bold=True)}  {state}  {_where(device)}"
        for text in filter(
            None, (device["reason"], device.get("identity"), _traffic(device), _troubles(device))
        ):
            yield f"    {text}"


def _state(device: Device) -> str:
    letter, since = device.get("letter"), device.get("since")
    lasting = f" for {age(since)}" if since is not None else ""
    return str(device["state"]) + (f" ({letter})" if letter else "") + lasting


def _where(device: Device) -> str:
    unit, nmt = device["unit"], device.get("nmt_state")
    number = "" if unit is None else f" {_NOUNS.get(device['family'], 'unit')} {unit}"
    return f"{device['address']}{number}" + (f", {nmt}" if nmt else "")


def _traffic(device: Device) -> str:
    trip, heard = device["round_trip"], device["age"]
    pdos = device.get("pdos_received"), device.get("pdos_sent")
    found = (
        counted(device["answers"], "answer"),
        f"the last {age(heard)} ago" if heard is not None else "",
        f"in {1000 * trip:.1f} ms" if trip is not None else "",
        f"PDOs: {pdos[0]} received, {pdos[1]} sent" if any(pdos) else "",
    )
    return ", ".join(filter(None, found))


def _troubles(device: Device) -> str:
    """What has gone wrong since the gateway knows it; empty if nothing has."""
    emergency = device.get("emergency")
    codes = ", ".join(f"{code}: {count}" for code, count in (device["exceptions"] or {}).items())
    refusals = "SDO aborts" if device["family"] == "canopen" else "exceptions"
    found = (
        _count(device["timeouts"], "time-out"),
        _count(device["errors"], "error"),
        f"{refusals} by code: {codes}" if codes else "",
        f"lost {counted(device['losses'], 'time')}" if device.get("losses") else "",
        f"{counted(device['heartbeat_misses'], 'heartbeat')} missed"
        if device.get("heartbeat_misses")
        else "",
        _count(device.get("emergencies"), "EMCY message") + (f", the last: {emergency}" if emergency else ""),
    )
    return "; ".join(filter(None, found))


def _count(number: int | None, noun: str) -> str:
    return counted(number, noun) if number else ""
