"""Variables with several places in a table: what a request says of them, all in all."""

from __future__ import annotations

import struct

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.definition import ValueKind
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.links.modbus_server.plan import Placement
from gatewayd.links.modbus_server.repeated import Repeated
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import make_codec

FINE = make_codec("float32", kind=ValueKind.FLOAT)
COARSE = make_codec("int16", kind=ValueKind.FLOAT, scale=0.1)
PLACES = [
    Placement(0, Area.HOLDING, 10, None, FINE),
    Placement(0, Area.HOLDING, 12, None, COARSE),
    Placement(1, Area.HOLDING, 13, None, COARSE),
]


def test_only_several_places_count() -> None:
    assert Repeated(PLACES)
    assert not Repeated(PLACES[1:])
    assert not Repeated([])


@pytest.mark.parametrize(
    "fine, coarse, meant",
    [(12.25, 122, 12.25), (12.25, 123, None), (0.0, 0, 0.0), (5000.0, 32767, 5000.0), (5000.0, 0, None)],
)
def test_the_value_that_all_places_say(fine: float, coarse: int, meant: float | None) -> None:
    """The finer place has it; a place that saturates says it as well as it can."""
    data = struct.pack(">fhh", fine, coarse, 7)
    decoded = COARSE.decode(data[4:6])
    assert decoded is not None
    changes = [Change(0, fine), Change(0, decoded), Change(1, 0.7)]
    expected = Refusal(Reason.CONTRADICTED, 0)
    agreed = [Change(0, fine), Change(0, fine), Change(1, 0.7)]
    assert Repeated(PLACES).settled(changes, 10, data) == (expected if meant is None else agreed)


def test_a_place_that_the_request_does_not_cover_says_nothing() -> None:
    changes = [Change(0, 4.2), Change(1, 0.7)]
    assert Repeated(PLACES).settled(changes, 12, struct.pack(">hh", 42, 7)) == changes
