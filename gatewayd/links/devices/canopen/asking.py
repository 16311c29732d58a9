"""Reading and writing an object of a CANopen device by hand, whatever channel the transfers go by."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from gatewayd.canopen.manager.channel import reason_of
from gatewayd.canopen.sdo.client import SdoResult
from gatewayd.core.definition import CellDefinition
from gatewayd.links.access import AccessError, AccessProblem, PlaceAnswer, PlaceRequest
from gatewayd.links.devices.canopen.asked_object import AskedObject, object_of, refuse_carried
from gatewayd.links.devices.canopen.plan import CanopenDevicePlan

Transfer = Callable[[int, int, bytes | None], Awaitable[SdoResult]]
"""Reads an object by index and sub-index, or writes the bytes to it."""


async def ask_object(
    plan: CanopenDevicePlan, cell: CellDefinition, request: PlaceRequest, transfer: Transfer
) -> PlaceAnswer:
    """Read the object; with a value write it, and read it before and after. Raises AccessError.

    An object that cannot be read, and can be written all the same, has no values in the answer.
    """
    asked = object_of(request)
    if request.value is None:
        result = await transfer(asked.index, asked.subindex, None)
        if not result.good:
            raise _failed(f"{asked.text} was not read", result)
        return PlaceAnswer(asked.text, (asked.value(result.data),))
    refuse_carried(asked, plan, cell)
    before = await transfer(asked.index, asked.subindex, None)
    if before.silent:
        raise _failed(f"{asked.text} was not written", before)
    data = asked.content(request.value, before.data if before.good else None)
    done = await transfer(asked.index, asked.subindex, data)
    if not done.good:
        raise _failed(f"{asked.text} was not written", done)
    after = await transfer(asked.index, asked.subindex, None)
    former = (asked.value(before.data),) if before.good and _reads(asked, before.data) else ()
    values = (asked.value(after.data),) if after.good and _reads(asked, after.data) else ()
    return PlaceAnswer(asked.text, values, former)


def _reads(asked: AskedObject, data: bytes) -> bool:
    try:
        asked.value(data)
    except AccessError:
        return False
    return True


def _failed(what: str, result: SdoResult) -> AccessError:
    problem = AccessProblem.NO_ANSWER if result.silent else AccessProblem.REFUSED
    return AccessError(problem, f"{what}: {reason_of(result)}")
