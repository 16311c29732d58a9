"""Devices asked by hand through a running gateway, on the connections that it has: read, and written where it may be.

Every write is in the audit, done or refused.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import Any, Final

from gatewayd.audit.record import Record, plain_value
from gatewayd.audit.trail import Audit
from gatewayd.control.api import Api, ApiError, Gateway
from gatewayd.links.access import (
    AccessError,
    AccessProblem,
    PlaceAnswer,
    PlaceRequest,
    PlaceValue,
    PlainNumber,
)
from gatewayd.links.contract import Link
from gatewayd.links.registry import kind_of
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.report.event_text import DEVICE_WRITTEN, REFUSED, EventRecord
from gatewayd.report.schema import Json
from gatewayd.report.verdict import ServedCell

_STATUS: Final = {
    AccessProblem.BAD_PLACE: 400,
    AccessProblem.MAPPED: 409,
    AccessProblem.REFUSED: 409,
    AccessProblem.TAKEN: 409,
    AccessProblem.NO_ANSWER: 504,
    AccessProblem.UNUSABLE: 503,
}
_MAX_TEXT: Final = 2000
_SHOWN: Final = 200
"""Characters of a written value in the audit."""
_OPERATOR: Final = "operator"

log = logging.getLogger("gatewayd.control")


class DevicesByHand:
    """Reads and writes places of the devices of a gateway."""

    def __init__(self, gateway: Gateway, audit: Audit) -> None:
        self._gateway = gateway
        self._audit = audit

    async def read(self, name: str, body: Mapping[str, Any], _who: str) -> Json:
        """What stands at `place` of the device now; `type` and `order` say how its number is made."""
        served, link = self._device(name, body)
        request = PlaceRequest(_text(body, "place"), _text(body, "type"), _text(body, "order"))
        try:
            answer = await link.ask(request)
        except AccessError as error:
            raise _refused(error) from None
        return _head(served, name, answer) | {"values": _values(answer.values)}

    async def write(self, name: str, body: Mapping[str, Any], who: str) -> Json:
        """Write `value` to `place` of the device. What stood there before, and what stands there then."""
        served, link = self._device(name, body)
        value = _value(body)
        request = PlaceRequest(_text(body, "place"), _text(body, "type"), _text(body, "order"), value)
        try:
            answer = await link.ask(request)
        except AccessError as error:
            self._record(served, name, request, who, error)
            raise _refused(error) from None
        self._record(served, name, request, who, answer)
        return _head(served, name, answer) | {
            "values": _values(answer.values),
            "former": _values(answer.former),
        }

    def _record(
        self,
        served: ServedCell,
        device: str,
        request: PlaceRequest,
        who: str,
        what: PlaceAnswer | AccessError,
    ) -> None:
        """Have it in the audit and in the log."""
        value, cell = (request.value or "")[:_SHOWN], served.cell.definition.name
        asked = f"wrote {device} {request.place[:_SHOWN]} = {value}"
        if isinstance(what, AccessError):
            event = EventRecord(REFUSED, _OPERATOR, request=asked, reason=f"{what}", detail=who)
        else:
            former = ", ".join(str(each.value) for each in what.former)[:_SHOWN]
            was = f"was {former}" if former else "what was there before cannot be read"
            event = EventRecord(
                DEVICE_WRITTEN, _OPERATOR, request=asked, detail=", ".join(filter(None, (was, who)))
            )
        self._audit.append(Record(self._audit.wall(), clock.now(), cell, event))
        place = request.place[:_SHOWN]
        if isinstance(what, AccessError):
            log.warning(
                "device was not written by hand",
                extra=fields(
                    cell=cell, device=device, place=place, value=value, detail=who, reason=str(what)
                ),
            )
        else:
            log.warning(
                "device written by hand",
                extra=fields(cell=cell, device=device, place=place, value=value, detail=who),
            )

    def _device(self, name: str, body: Mapping[str, Any]) -> tuple[ServedCell, Link]:
        cell = _text(body, "cell", required=False)
        found, names = [], []
        for served in self._gateway.runtimes:
            for link, plan in served.plan.links.items():
                if not kind_of(plan.kind).access or cell not in ("", served.cell.definition.name):
                    continue
                names.append(link)
                if link == name:
                    found.append(served)
        if not found:
            there = f"only {', '.join(names)}" if names else "and no other: the mapping has no `devices`"
            raise ApiError(404, "no_such_device", f"there is no device {name}, {there}")
        if len(found) > 1:
            cells = ", ".join(served.cell.definition.name for served in found)
            raise ApiError(409, "ambiguous", f"{name} is in several cells ({cells}): say which with `cell`")
        return found[0], found[0].links[name]


def devices_by_hand(api: Api) -> DevicesByHand:
    """Those of the gateway that the interface is for."""
    return DevicesByHand(api.gateway, api.audited)


def _refused(error: AccessError) -> ApiError:
    return ApiError(_STATUS[error.problem], error.problem.value, str(error))


def _head(served: ServedCell, name: str, answer: PlaceAnswer) -> Json:
    return {"cell": served.cell.definition.name, "device": name, "place": answer.place}


def _values(values: Sequence[PlaceValue]) -> list[Json]:
    return [{"place": each.place, "value": _plain(each.value), "raw": each.raw} for each in values]


def _plain(value: PlainNumber) -> PlainNumber | None:
    return value if isinstance(value, str) else plain_value(value)


def _text(body: Mapping[str, Any], name: str, *, required: bool = True) -> str:
    value = body.get(name)
    if value is None and (not required or name != "place"):
        return ""
    if not isinstance(value, str) or len(value) > _MAX_TEXT:
        raise ApiError(400, "bad_request", f"`{name}` must be a text of at most {_MAX_TEXT} characters")
    return value


def _value(body: Mapping[str, Any]) -> str:
    value = body.get("value")
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, int | float):
        return str(value)
    if not isinstance(value, str) or not value:
        raise ApiError(400, "bad_request", "`value` must be a text, a number, or true or false")
    return value
