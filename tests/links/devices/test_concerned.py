from __future__ import annotations

import pytest

from gatewayd.links.devices.concerned import Concerned, DeviceId, concerned_by

ISLAND, GRIPPER, OTHER = (
    DeviceId("press", "island"),
    DeviceId("press", "gripper"),
    DeviceId("lathe", "island"),
)


@pytest.mark.parametrize(
    "devices, found",
    [
        ([], Concerned(None, ())),
        ([ISLAND], Concerned("press", ("island",))),
        ([ISLAND, GRIPPER], Concerned("press", ("island", "gripper"))),
        ([ISLAND, OTHER], Concerned(None, ("island", "island"))),
    ],
)
def test_the_cell_is_named_where_it_is_one(devices: list[DeviceId], found: Concerned) -> None:
    assert concerned_by(devices) == found
