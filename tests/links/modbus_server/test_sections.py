"""Where a variable lies in Modbus, as a mapping writes it."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.links.modbus_server.sections import ModbusPlaces
from gatewayd.mapping.language import VARIABLE
from gatewayd.mapping.typed import Invalid
from gatewayd.modbus.areas import Area


def placements(value: Any) -> list[tuple[Area, int, int | None]]:
    spec = VARIABLE.model_validate({"robot": "x", "modbus": value}).by(ModbusPlaces)
    return [(placed.area, placed.address, placed.bit) for placed in spec.modbus]


def test_placements_have_short_forms() -> None:
    """A number, a text, a table, or a list of these."""
    assert placements(100) == [(Area.HOLDING, 100, None)]
    assert placements("100.10") == [(Area.HOLDING, 100, 10)]
    assert placements({"input": 7}) == [(Area.INPUT, 7, None)]
    assert placements(["0.3", {"coil": 3}, {"discrete": 4}]) == [
        (Area.HOLDING, 0, 3),
        (Area.COIL, 3, None),
        (Area.DISCRETE, 4, None),
    ]


@pytest.mark.parametrize(
    "value",
    [
        {},
        {"type": "int16"},
        {"holding": 1, "coil": 1},
        {"coil": "1.3"},
        {"discrete": "1.0"},
        None,
        True,
        [[1]],
    ],
)
def test_placement_names_exactly_one_area(value: Any) -> None:
    """Coils and discrete inputs are bits already."""
    with pytest.raises(Invalid) as caught:
        placements(value)
    assert {mistake.kind for mistake in caught.value.mistakes} <= {"bad-address", "wrong-type"}
