"""The store: what fits, what moves, and packing once."""

from __future__ import annotations

import math
import struct

import pytest

from gatewayd.rtde.types import DataType
from gatewayd.simulator.arm import ControllerMoment
from gatewayd.simulator.store import FieldStore, Scalar, fitting

TYPES = {
    "clock": DataType.DOUBLE,
    "small": DataType.UINT8,
    "word": DataType.UINT32,
    "whole": DataType.INT32,
    "switch": DataType.BOOL,
    "place": DataType.VECTOR3D,
}


def make() -> FieldStore:
    return FieldStore(TYPES, {"clock": lambda moment: (moment.time,)}, {"whole": 7, "place": (1.0, 2.0, 3.0)})


@pytest.mark.parametrize(
    "value,code,held",
    [
        (2.6, "i", 3),
        (1e300, "i", 0x7FFFFFFF),
        (-1e300, "i", -0x80000000),
        (math.inf, "B", 255),
        (math.nan, "I", 0),
        (-1, "Q", 0),
        (2, "?", True),
        (3, "d", 3.0),
    ],
)
def test_a_value_is_made_to_fit(value: Scalar, code: str, held: Scalar) -> None:
    assert fitting(value, code) == held
    struct.pack(">" + code, fitting(value, code))


def test_moving_fields_follow_the_moment() -> None:
    store = make()
    store.moment = ControllerMoment(1, 0.5, 0.0, 0.0)
    assert store.read("clock") == (0.5,)
    assert store.read("place") == (1.0, 2.0, 3.0)


def test_a_view_packs_in_the_order_of_its_names() -> None:
    store = make()
    store.write("switch", (True,))
    assert store.view(("switch", "place", "whole")).payload() == struct.pack(">?3di", True, 1.0, 2.0, 3.0, 7)
    assert store.view(("small",)).payload() == b"\0"


def test_equal_recipes_share_a_view_that_packs_once_a_moment() -> None:
    store = make()
    view = store.view(("clock", "whole"))
    assert store.view(("clock", "whole")) is view
    first = view.payload()
    assert view.payload() is first
    store.moment = ControllerMoment(1, 0.002, 0.0, 0.0)
    assert view.payload() != first


def test_a_write_shows_in_the_same_moment() -> None:
    store = make()
    view = store.view(("whole",))
    view.payload()
    store.write("whole", (8,))
    assert view.payload() == struct.pack(">i", 8)


def test_a_pinned_field_moves_no_more_in_views_that_exist() -> None:
    store = make()
    view = store.view(("clock",))
    view.payload()
    store.pin("clock", (9.0,))
    store.moment = ControllerMoment(1, 0.002, 0.0, 0.0)
    assert view.payload() == struct.pack(">d", 9.0)
    assert not store.moves("clock")


def test_the_number_of_elements_is_checked() -> None:
    with pytest.raises(ValueError, match="place takes 3 values, not 1"):
        make().write("place", (1.0,))


def test_reset_brings_first_values_back() -> None:
    store = make()
    store.write("whole", (1,))
    store.write("small", (1,))
    store.reset()
    assert (store.read("whole"), store.read("small")) == ((7,), (0,))
