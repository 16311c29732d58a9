"""Reading and writing a place of a Modbus device by hand, whatever connection the requests go by."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from gatewayd.core.definition import CellDefinition
from gatewayd.links.access import AccessError, AccessProblem, PlaceAnswer, PlaceRequest
from gatewayd.links.devices.asking import refuse_mapped
from gatewayd.links.devices.modbus.asked_place import AskedPlace, content_of, place_of
from gatewayd.links.devices.modbus.plan import ModbusDevicePlan
from gatewayd.modbus.client.requests import ExceptionAnswer, Failure, ModbusRequest, TimedOut, read
from gatewayd.modbus.client.station import Station

Exchange = Callable[[ModbusRequest], Awaitable[bytes | Failure]]
"""Sends a request to the device; the data of its answer, or why there are none."""


async def ask_place(
    plan: ModbusDevicePlan, cell: CellDefinition, request: PlaceRequest, exchange: Exchange
) -> PlaceAnswer:
    """Read the place; with a value write it, and read it before and after. Raises AccessError.

    A place that cannot be read, and can be written all the same, has no values in the answer.
    """
    place = place_of(request)
    if request.value is None:
        found = await exchange(_reading(place))
        if not isinstance(found, bytes):
            raise _failed(f"{place.text} was not read", found)
        return PlaceAnswer(place.text, place.values(found))
    data, bits = content_of(place, request.value)
    refuse_mapped(place.text, place.mapped(plan.placements), cell)
    before = await exchange(_reading(place))
    for number, each in enumerate(place.requests(data, bits, plan.write)):
        done = await exchange(each)
        if not isinstance(done, bytes):
            part = f" after {number} of its values" if number else ""
            raise _failed(f"{place.text} was not written{part}", done)
    after = await exchange(_reading(place))
    return PlaceAnswer(
        place.text,
        place.values(after) if isinstance(after, bytes) else (),
        place.values(before) if isinstance(before, bytes) else (),
    )


async def exchange(station: Station, request: ModbusRequest, limit: float) -> bytes | Failure:
    """Send one request in the station's turn; its outcome, at the latest after `limit` seconds."""
    answered: asyncio.Future[bytes | Failure] = asyncio.get_running_loop().create_future()

    def hear(outcome: bytes | Failure, _now: float) -> None:
        if not answered.done():
            answered.set_result(outcome)

    if not station.ask(request, hear):
        busy = station.reason or "too many requests wait for it already"
        raise AccessError(AccessProblem.NO_ANSWER, f"the device is not asked: {busy}")
    try:
        async with asyncio.timeout(limit):
            return await answered
    except TimeoutError:
        return TimedOut(limit)


def _reading(place: AskedPlace) -> ModbusRequest:
    return read(place.area, place.address, place.count)


def _failed(what: str, failure: Failure) -> AccessError:
    refused = isinstance(failure, ExceptionAnswer) and not failure.is_no_answer
    return AccessError(
        AccessProblem.REFUSED if refused else AccessProblem.NO_ANSWER, f"{what}: {failure.text}"
    )
