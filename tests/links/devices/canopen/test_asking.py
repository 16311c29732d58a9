"""An object of a CANopen device is read, or written and read again; where a variable is mapped, nothing is sent."""

from __future__ import annotations

import pytest

from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.sdo.client import SdoResult
from gatewayd.links.access import AccessError, AccessProblem, PlaceAnswer, PlaceRequest
from gatewayd.links.devices.canopen.asking import ask_object
from tests.links.devices.canopen.cells import planned, the_device

PLAN = planned()


class Fake:
    """A device in the test: objects by index, and what was asked of it."""

    def __init__(self) -> None:
        self.objects: dict[int, bytes] = {0x2003: b"\7\0"}
        self.write_only: set[int] = set()
        self.silent = False
        self.asked: list[tuple[int, bytes | None]] = []

    async def transfer(self, index: int, subindex: int, data: bytes | None) -> SdoResult:
        self.asked.append((index, data))
        if self.silent:
            return SdoResult(index, subindex, code=AbortCode.TIMED_OUT, silent=True)
        if index not in self.objects:
            return SdoResult(index, subindex, code=AbortCode.NO_OBJECT)
        if data is not None:
            self.objects[index] = data
            return SdoResult(index, subindex)
        if index in self.write_only:
            return SdoResult(index, subindex, code=AbortCode.WRITE_ONLY)
        return SdoResult(index, subindex, self.objects[index])

    async def ask(self, place: str, value: str | None = None, type_name: str = "") -> PlaceAnswer:
        request = PlaceRequest(place, type_name, value=value)
        return await ask_object(the_device(PLAN), PLAN.cell, request, self.transfer)


@pytest.fixture
def fake() -> Fake:
    return Fake()


async def test_reads(fake: Fake) -> None:
    answer = await fake.ask("0x2003")
    assert (answer.place, answer.values[0].value, answer.values[0].raw) == ("2003h:00", 7, "0700")


async def test_writes_between_two_reads(fake: Fake) -> None:
    answer = await fake.ask("0x2003", "9")
    assert fake.asked == [(0x2003, None), (0x2003, b"\x09\0"), (0x2003, None)]
    assert (answer.former[0].value, answer.values[0].value) == (7, 9)


async def test_what_cannot_be_read_is_written_with_a_type(fake: Fake) -> None:
    fake.write_only = {0x2003}
    with pytest.raises(AccessError, match="say it with --type"):
        await fake.ask("0x2003", "9")
    answer = await fake.ask("0x2003", "9", "uint16")
    assert (answer.values, answer.former, fake.objects[0x2003]) == ((), (), b"\x09\0")


async def test_mapped_object_is_not_written(fake: Fake) -> None:
    with pytest.raises(AccessError, match="gatewayd force clamp VALUE"):
        await fake.ask("0x6200:1", "1")
    assert fake.asked == []


async def test_abort_and_silence_are_told_apart(fake: Fake) -> None:
    for value in (None, "1"):
        with pytest.raises(AccessError, match="06020000h no such object") as raised:
            await fake.ask("0x3000", value, "uint8")
        assert raised.value.problem is AccessProblem.REFUSED
    fake.silent = True
    for value in (None, "1"):
        with pytest.raises(AccessError, match="no answer") as raised:
            await fake.ask("0x2003", value)
        assert raised.value.problem is AccessProblem.NO_ANSWER
