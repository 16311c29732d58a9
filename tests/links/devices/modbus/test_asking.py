"""A place of a Modbus device is read, or written and read again; where a variable is mapped, nothing is sent."""

from __future__ import annotations

import pytest

from gatewayd.links.access import AccessError, AccessProblem, PlaceAnswer, PlaceRequest
from gatewayd.links.devices.modbus.asking import ask_place, exchange
from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.requests import (
    ExceptionAnswer,
    Failure,
    ModbusRequest,
    TimedOut,
    parse_answer,
    read,
)
from gatewayd.modbus.client.station import Station
from gatewayd.modbus.client.unit import StationSettings
from tests.links.devices.cells import device, planned
from tests.modbus.client.world import Heard, Unit

PLAN = planned()


class Fake:
    """A device in the test: what it was asked, and how it answers."""

    def __init__(self) -> None:
        self.unit = Unit()
        self.failure: Failure | None = None

    async def exchange(self, request: ModbusRequest) -> bytes | Failure:
        answer = self.unit.answer(request.pdu)
        assert answer is not None
        return self.failure or parse_answer(request, answer)

    async def ask(self, place: str, value: str | None = None, type_name: str = "") -> PlaceAnswer:
        request = PlaceRequest(place, type_name, value=value)
        return await ask_place(device(PLAN, "island"), PLAN.cell, request, self.exchange)


@pytest.fixture
def fake() -> Fake:
    return Fake()


async def test_reads(fake: Fake) -> None:
    fake.unit.registers = {100: 7}
    answer = await fake.ask("holding:100..101")
    assert answer.place == "holding 100..101"
    assert [value.value for value in answer.values] == [7, 0]
    assert answer.former == ()


async def test_writes_between_two_reads(fake: Fake) -> None:
    fake.unit.registers = {100: 7}
    answer = await fake.ask("100", "9")
    assert [request[0] for request in fake.unit.requests] == [3, 6, 3]
    assert ([each.value for each in answer.former], [each.value for each in answer.values]) == ([7], [9])


async def test_what_cannot_be_read_is_written_all_the_same(fake: Fake) -> None:
    fake.unit.functions = {6}
    answer = await fake.ask("100", "9")
    assert (answer.values, answer.former) == ((), ())
    assert fake.unit.registers == {100: 9}


@pytest.mark.parametrize("place", ["coil:0", "holding:7", "holding:5..8"])
async def test_mapped_place_is_not_written(fake: Fake, place: str) -> None:
    value = "on" if place.startswith("coil") else ",".join("0" * (4 if ".." in place else 1))
    with pytest.raises(AccessError, match=r"`gatewayd force (clamp|speed) VALUE`") as raised:
        await fake.ask(place, value)
    assert raised.value.problem is AccessProblem.MAPPED
    assert fake.unit.requests == []


async def test_refusal_and_silence_are_told_apart(fake: Fake) -> None:
    for failure, problem in (
        (ExceptionAnswer(2), AccessProblem.REFUSED),
        (ExceptionAnswer(0x0B), AccessProblem.NO_ANSWER),
        (TimedOut(0.3), AccessProblem.NO_ANSWER),
    ):
        fake.failure = failure
        for value in (None, "1"):
            with pytest.raises(AccessError, match="holding 100 was not ") as raised:
                await fake.ask("100", value)
            assert raised.value.problem is problem


async def test_station_that_is_not_there_is_not_waited_for() -> None:
    station = Station(StationSettings(1), Heard())
    with pytest.raises(AccessError, match="the device is not asked"):
        await exchange(station, read(Area.HOLDING, 0, 1), 1.0)
