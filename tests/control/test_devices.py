"""Devices asked by hand through a gateway: which one, what comes of it, and that the audit has every write."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from gatewayd.audit.trail import Audit
from gatewayd.control.api import Api, ApiError
from gatewayd.control.devices import devices_by_hand
from gatewayd.core.cell import Cell
from gatewayd.links.access import AccessError, AccessProblem, PlaceAnswer, PlaceRequest, PlaceValue
from gatewayd.links.contract import Link
from tests.control.served import FixedGateway, Served
from tests.links.devices.cells import HEAD, VARIABLES, planned


class AskedLink(Link):
    """Keeps what it was asked, and answers what a test wants."""

    def __init__(self) -> None:
        self.requests: list[PlaceRequest] = []
        self.error: AccessError | None = None
        self.value: float = 9

    async def ask(self, request: PlaceRequest) -> PlaceAnswer:
        self.requests.append(request)
        if self.error is not None:
            raise self.error
        former = () if request.value is None else (PlaceValue("holding 100", 7, "0007"),)
        return PlaceAnswer("holding 100", (PlaceValue("holding 100", self.value, "0009"),), former)


class Desk:
    """A gateway with cells that have the device `island`."""

    def __init__(self, names: Sequence[str] = ("press",)) -> None:
        self.link = AskedLink()
        self.audit = Audit()
        cells = []
        for name in names:
            plan = planned(VARIABLES, HEAD.replace("cell: press", f"cell: {name}"))
            served = Served(plan, Cell(plan.cell))
            served.links["island"] = self.link
            cells.append(served)
        self.devices = devices_by_hand(Api(FixedGateway(cells), self.audit))


@pytest.fixture
def desk() -> Desk:
    return Desk()


async def test_read(desk: Desk) -> None:
    answer = await desk.devices.read("island", {"place": "100", "type": "int16", "order": "BADC"}, "by anna")
    assert answer == {
        "cell": "press",
        "device": "island",
        "place": "holding 100",
        "values": [{"place": "holding 100", "value": 9, "raw": "0009"}],
    }
    assert desk.link.requests == [PlaceRequest("100", "int16", "BADC")]
    assert list(desk.audit) == []


async def test_write_is_in_the_audit(desk: Desk) -> None:
    answer = await desk.devices.write("island", {"place": "100", "value": 9}, "by anna")
    assert (answer["former"][0]["value"], answer["values"][0]["value"]) == (7, 9)
    (record,) = desk.audit
    assert record.event.text() == "operator wrote island 100 = 9 (was 7, by anna)"
    assert record.as_json()["what"] == "device written"
    assert record.cell == "press"


async def test_refused_write_is_in_the_audit(desk: Desk) -> None:
    desk.link.error = AccessError(AccessProblem.MAPPED, "coil 0 is not written: `clamp` is mapped there")
    with pytest.raises(ApiError) as raised:
        await desk.devices.write("island", {"place": "coil:0", "value": True}, "by anna")
    assert (raised.value.status, raised.value.code) == (409, "mapped")
    (record,) = desk.audit
    assert record.event.text() == (
        "operator wrote island coil:0 = on: refused, coil 0 is not written: `clamp` is mapped there (by anna)"
    )


async def test_nan_is_a_text(desk: Desk) -> None:
    desk.link.value = math.nan
    answer = await desk.devices.read("island", {"place": "100"}, "")
    assert answer["values"][0]["value"] == "nan"


@pytest.mark.parametrize(
    "problem, status",
    [
        (AccessProblem.BAD_PLACE, 400),
        (AccessProblem.REFUSED, 409),
        (AccessProblem.NO_ANSWER, 504),
        (AccessProblem.UNUSABLE, 503),
    ],
)
async def test_what_a_device_did_not_do(desk: Desk, problem: AccessProblem, status: int) -> None:
    desk.link.error = AccessError(problem, "no")
    with pytest.raises(ApiError) as raised:
        await desk.devices.read("island", {"place": "100"}, "")
    assert (raised.value.status, raised.value.code) == (status, problem.value)


@pytest.mark.parametrize(
    "name, body, code",
    [
        ("islnd", {"place": "100"}, "no_such_device"),
        ("modbus", {"place": "100"}, "no_such_device"),
        ("island", {}, "bad_request"),
        ("island", {"place": 100}, "bad_request"),
        ("island", {"place": "1" * 2001}, "bad_request"),
        ("island", {"place": "100", "type": 5}, "bad_request"),
        ("island", {"place": "100", "cell": "other"}, "no_such_device"),
    ],
)
async def test_bad_request(desk: Desk, name: str, body: dict[str, object], code: str) -> None:
    for act, more in ((desk.devices.read, {}), (desk.devices.write, {"value": 1})):
        with pytest.raises(ApiError) as raised:
            await act(name, {**body, **more}, "")
        assert raised.value.code == code
    assert desk.link.requests == []


@pytest.mark.parametrize("value", [None, "", [1], {}])
async def test_value_that_is_none(desk: Desk, value: object) -> None:
    with pytest.raises(ApiError, match="`value`"):
        await desk.devices.write("island", {"place": "100", "value": value}, "")


async def test_device_of_several_cells() -> None:
    desk = Desk(("press", "lathe"))
    with pytest.raises(ApiError) as raised:
        await desk.devices.read("island", {"place": "100"}, "")
    assert raised.value.code == "ambiguous"
    answer = await desk.devices.read("island", {"place": "100", "cell": "lathe"}, "")
    assert answer["cell"] == "lathe"


async def test_text_of_an_unknown_device_names_the_others(desk: Desk) -> None:
    with pytest.raises(ApiError, match="only island, gripper"):
        await desk.devices.read("islnd", {"place": "100"}, "")
