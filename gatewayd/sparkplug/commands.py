"""What NCMD and DCMD want: the metrics they name, and typed values for them, or why not (specification 5.17)."""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.sparkplug.actions import CommandReceived, CommandRefused
from gatewayd.sparkplug.datatypes import Scalar, ValueField, WireValue, commanded_value
from gatewayd.sparkplug.declarations import REBIRTH, MetricDeclaration
from gatewayd.sparkplug.payload import Metric, PayloadLimits, decode_payload
from gatewayd.sparkplug.roster import RosterDevice
from gatewayd.sparkplug.wire import PayloadError

COMMAND_LIMITS = PayloadLimits(size=8192, metrics=256, depth=0)
"""All inputs of a robot at once are 6 KiB. The worst of this size takes some milliseconds of the loop."""
_MAX_NAME = 80
"""Characters of a foreign name that are repeated."""
_TRUE = WireValue(ValueField.BOOLEAN, content=True)


@dataclass(frozen=True, slots=True)
class ReadCommand:
    """What a command wants: a rebirth, values, or neither."""

    wants_rebirth: bool = False
    outcome: CommandReceived | CommandRefused | None = None


def read_command(device: RosterDevice, data: bytes) -> ReadCommand:
    """The command of a payload for a device, or for the edge node. One fault refuses all of its values."""
    try:
        payload = decode_payload(data, COMMAND_LIMITS)
    except PayloadError as error:
        return ReadCommand(outcome=CommandRefused(device.name, (), f"the payload {error}"))
    metrics = payload.metrics
    wants_rebirth = False
    if not device.name:
        metrics = tuple(metric for metric in payload.metrics if metric.name != REBIRTH)
        wants_rebirth = any(metric.name == REBIRTH and metric.value == _TRUE for metric in payload.metrics)
        if not metrics and payload.metrics:
            refused = None if wants_rebirth else CommandRefused("", (), f"{REBIRTH} is not true")
            return ReadCommand(wants_rebirth, refused)
    return ReadCommand(wants_rebirth, _values(device, metrics, payload.timestamp))


def _values(
    device: RosterDevice, metrics: tuple[Metric, ...], timestamp: int | None
) -> CommandReceived | CommandRefused:
    if not metrics:
        return CommandRefused(device.name, (), "names no metric")
    values: dict[str, Scalar] = {}
    known: dict[str, None] = {}
    reason = ""
    for metric in metrics:
        declared = device.find(metric.name, metric.alias)
        if declared is None:
            reason = reason or f"{_named(metric)}: there is no such metric"
            continue
        known[declared.name] = None
        try:
            values[declared.name] = _value(device, declared, metric)
        except PayloadError as error:
            reason = reason or f"{_named(metric)}: {error}"
    if reason:
        return CommandRefused(device.name, tuple(known), reason)
    return CommandReceived(device.name, tuple(values.items()), timestamp)


def _value(device: RosterDevice, declared: MetricDeclaration, metric: Metric) -> Scalar:
    if metric.alias is not None and device.by_alias.get(metric.alias) != declared.name:
        raise PayloadError(f"its alias {metric.alias} is that of another metric")
    if not declared.is_writable:
        raise PayloadError("is not writable")
    if metric.is_historical:
        raise PayloadError("is historical")
    if metric.is_null or metric.value is None:
        raise PayloadError("has no value")
    return commanded_value(declared.type, metric.datatype, metric.value)


def _named(metric: Metric) -> str:
    if metric.name is not None:
        return repr(metric.name[:_MAX_NAME])
    return "a metric without name and alias" if metric.alias is None else f"alias {metric.alias}"
